// SPDX-License-Identifier: Apache-2.0
// calibration_values -- the correction of a sine/cosine signal: offsets, gain, quadrature error and
// harmonics.
#include "calibration/calibration_values.h"

#include "calibration/equations.h"

const struct calibration_values calibration_identity = {.gain = 65536};

bool calibration_values_fit(const struct calibration_values* values) {
    bool fit = values->gain >= 32768 && values->gain < 131072 &&
               magnitude(values->quadrature_error) <= 65536 &&
               magnitude(values->sin_offset) <= 16384 && magnitude(values->cos_offset) <= 16384 &&
               magnitude(values->shift / 2) <= 1 << 20;
    for (uint32_t k = 0; k < CALIBRATION_ORDERS; k++)
        fit = fit && magnitude(values->cosine[k] / 2) <= 1 << 20 &&
              magnitude(values->sine[k] / 2) <= 1 << 20;
    return fit;
}

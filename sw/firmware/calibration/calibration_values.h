// SPDX-License-Identifier: Apache-2.0
// calibration_values -- the correction of a sine/cosine signal: offsets, gain, quadrature error and
// harmonics.
#ifndef MOIRE_CALIBRATION_VALUES_H
#define MOIRE_CALIBRATION_VALUES_H

#include <stdbool.h>
#include <stdint.h>

// Orders of the phase error. A harmonic k of the signal appears in order k - 1, a harmonic -k in
// order k + 1: so the harmonics +-2 … +-8 are covered.
#define CALIBRATION_ORDERS 10u

// sin' = gain (sin - sin_offset) + quadrature_error (cos - cos_offset), then
// phase' = phase - shift - sum over k of cosine[k-1] cos(k phase) + sine[k-1] sin(k phase)
struct calibration_values {
    int16_t sin_offset;                  // 2^-15 of full scale, +-16384 at most
    int16_t cos_offset;                  // the same
    int32_t gain;                        // 2^-16, 0.5 … 2
    int32_t quadrature_error;            // 2^-16, +-1 at most
    int32_t cosine[CALIBRATION_ORDERS];  // 2^-24 period, +-1/8 period at most
    int32_t sine[CALIBRATION_ORDERS];    // the same
    int32_t shift;                       // 2^-24 period: half of the phase error that drifted
};

extern const struct calibration_values calibration_identity;  // corrects nothing

// All values are within their ranges.
bool calibration_values_fit(const struct calibration_values* values);

#endif

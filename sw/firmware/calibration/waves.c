// SPDX-License-Identifier: Apache-2.0
// waves -- sine and cosine from a table of 512 points a circle, 1.0 = 32767.
#include "calibration/waves.h"

const int16_t sine_table[WAVES_POINTS + WAVES_POINTS / 4] = {WAVES_SINE};

// The change from the nearest point of the table to the phase; 201 / 2^21 is pi / 2^15.
static int32_t step_from_point(int32_t derivative, uint32_t phase) {
    return (derivative * (int32_t)((phase + 64) % 128 - 64) * 201) >> 21;
}

int32_t sine_of(uint32_t phase) {
    uint32_t point = (phase + 64) >> 7;
    return sine_at(point) + step_from_point(cosine_at(point), phase);
}

int32_t cosine_of(uint32_t phase) {
    uint32_t point = (phase + 64) >> 7;
    return cosine_at(point) - step_from_point(sine_at(point), phase);
}

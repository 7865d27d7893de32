// SPDX-License-Identifier: Apache-2.0
// waves -- sine and cosine from a table of 512 points a circle, 1.0 = 32767.
#include "calibration/waves.h"

int16_t sine_table[640];

void waves_fill(void) {
    int64_t sine = 0, cosine = 1 << 30;
    for (int n = 0; n <= 128; n++) {
        sine_table[n] = sine_table[256 - n] = (int16_t)((sine * 32767 + (1 << 29)) >> 30);
        // Rotate by pi / 256.
        int64_t next = (sine * 1073660973 + cosine * 13176464 + (1 << 29)) >> 30;
        cosine = (cosine * 1073660973 - sine * 13176464 + (1 << 29)) >> 30;
        sine = next;
    }
    for (int n = 0; n < 256; n++) sine_table[256 + n] = (int16_t)-sine_table[n];
    for (int n = 0; n < 128; n++) sine_table[512 + n] = sine_table[n];
}

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

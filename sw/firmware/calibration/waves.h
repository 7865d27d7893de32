// SPDX-License-Identifier: Apache-2.0
// waves -- sine and cosine from a table of 512 points a circle, 1.0 = 32767.
#ifndef MOIRE_WAVES_H
#define MOIRE_WAVES_H

#include <stdint.h>

#include "made/waves.h"

extern const int16_t sine_table[WAVES_POINTS + WAVES_POINTS / 4];

// Sine and cosine of a point of the circle.

static inline int32_t sine_at(uint32_t point) { return sine_table[point % WAVES_POINTS]; }

static inline int32_t cosine_at(uint32_t point) {
    return sine_table[point % WAVES_POINTS + WAVES_POINTS / 4];
}

// Sine and cosine of any phase, one period = 2^16; within 3 LSB.
int32_t sine_of(uint32_t phase);
int32_t cosine_of(uint32_t phase);

#endif

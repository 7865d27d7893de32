// SPDX-License-Identifier: Apache-2.0
// waves -- sine and cosine from a table of 512 points a circle, 1.0 = 32767.
#ifndef MOIRE_WAVES_H
#define MOIRE_WAVES_H

#include <stdbool.h>
#include <stdint.h>

extern int16_t sine_table[640];  // the sine of a circle and a quarter

void waves_fill(void);

static inline bool waves_filled(void) { return sine_table[128] != 0; }

// Of a point of the circle, which has 512.

static inline int32_t sine_at(uint32_t point) { return sine_table[point % 512]; }

static inline int32_t cosine_at(uint32_t point) { return sine_table[point % 512 + 128]; }

// Of any phase, one period = 2^16; within 3 LSB.
int32_t sine_of(uint32_t phase);
int32_t cosine_of(uint32_t phase);

#endif

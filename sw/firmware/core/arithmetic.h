// SPDX-License-Identifier: Apache-2.0
// arithmetic -- integers as the planner needs them: wide, exact, and quick on a core that divides
// 32 bits only.
#ifndef MOIRE_ARITHMETIC_H
#define MOIRE_ARITHMETIC_H

#include <stdbool.h>
#include <stdint.h>

static inline uint64_t size(int64_t x) { return x < 0 ? -(uint64_t)x : (uint64_t)x; }

static inline uint64_t least(uint64_t a, uint64_t b) { return a < b ? a : b; }

static inline uint64_t most(uint64_t a, uint64_t b) { return a > b ? a : b; }

static inline int larger(int a, int b) { return a > b ? a : b; }

static inline uint64_t ceiling(uint64_t dividend, uint64_t divisor) {
    return dividend == 0 ? 0 : (dividend - 1) / divisor + 1;
}

int bits(uint64_t x);                               // x < 2^bits
uint64_t pairs(uint32_t n);                         // n (n-1) / 2
uint64_t triples(uint32_t n);                       // n (n-1) (n-2) / 6 modulo 2^64
int64_t product(int64_t x, uint32_t m, int shift);  // x m / 2^shift, rounded down
int64_t ratio(int64_t x, int shift,
              uint64_t divisor);  // x 2^shift / divisor, rounded towards zero and held below 2^62
int64_t share(int64_t x, uint64_t part,
              uint64_t whole);  // x part / whole, right to a 2^-15th of itself
uint32_t root(uint64_t x);      // rounded down

#endif

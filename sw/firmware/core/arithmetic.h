// SPDX-License-Identifier: Apache-2.0
// arithmetic -- integer functions for the planner: wide, exact, and fast on a core that divides
// only 32 bits.
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

// Number of bits of x: the smallest n with x < 2^n.
int bits(uint64_t x);

// n (n-1) / 2, and n (n-1) (n-2) / 6 modulo 2^64: the number of pairs and triples of n things.
uint64_t pairs(uint32_t n);
uint64_t triples(uint32_t n);

// x m / 2^shift, rounded down. A negative shift multiplies.
int64_t product(int64_t x, uint32_t m, int shift);

// x 2^shift / divisor, rounded towards zero; saturates at 2^62.
int64_t ratio(int64_t x, int shift, uint64_t divisor);

// x part / whole, with a relative error of at most 2^-15.
int64_t share(int64_t x, uint64_t part, uint64_t whole);

// Square root, rounded down.
uint32_t root(uint64_t x);

#endif

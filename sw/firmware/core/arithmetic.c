// SPDX-License-Identifier: Apache-2.0
// arithmetic -- integer functions for the planner.
#include "core/arithmetic.h"

int bits(uint64_t x) {
    int n = x >> 32 ? 32 : 0;
    uint32_t word = (uint32_t)(x >> n);
    for (int half = 16; half; half /= 2)
        if (word >> half) word >>= half, n += half;
    return n + (int)word;
}

uint64_t pairs(uint32_t n) { return n ? (uint64_t)n * (n - 1) / 2 : 0; }

uint64_t triples(uint32_t n) {
    return n < 3 ? 0 : pairs(n) * (n - 2) * 0xAAAAAAAAAAAAAAABu;  // divided by 3, modulo 2^64
}

int64_t product(int64_t x, uint32_t m, int shift) {
    uint64_t low = (uint64_t)(uint32_t)x * m, high = (uint64_t)((x >> 32) * m) + (low >> 32);
    if (shift < 0) return (int64_t)(((high << 32) + (uint32_t)low) << -shift);
    if (shift >= 32) return (int64_t)high >> (shift < 95 ? shift - 32 : 63);
    return (int64_t)((high << (32 - shift)) + ((uint32_t)low >> shift));
}

int64_t ratio(int64_t x, int shift, uint64_t divisor) {
    uint64_t whole = shift < -63 ? 0 : shift < 0 ? size(x) >> -shift : size(x);
    uint64_t quotient = whole / divisor, remainder = whole - quotient * divisor;
    for (; shift > 0; shift--) {
        if (quotient >> 61) return x < 0 ? INT64_MIN / 2 : INT64_MAX / 2;
        remainder <<= 1;
        quotient <<= 1;
        if (remainder >= divisor) remainder -= divisor, quotient++;
    }
    return x < 0 ? -(int64_t)quotient : (int64_t)quotient;
}

int64_t share(int64_t x, uint64_t part, uint64_t whole) {
    const int a = bits(part), b = bits(whole);
    const uint32_t dividend = (uint32_t)(a > 32 ? part >> (a - 32) : part << (32 - a));
    const uint32_t divisor = (uint32_t)(b > 16 ? whole >> (b - 16) : whole << (16 - b));
    return product(x, dividend / divisor, 16 - a + b);
}

// Newton's method from above gives the upper half of the digits, one division the lower half.
uint32_t root(uint64_t x) {
    if (x == 0) return 0;
    const int shift = (64 - bits(x)) & ~1;
    const uint64_t normal = x << shift;
    const uint32_t upper = (uint32_t)(normal >> 32);
    uint32_t guess = (upper / 49152u + 49152u) / 2, before;
    do {
        before = guess;
        guess = (guess + upper / guess) / 2;
    } while (guess < before);
    const uint32_t remainder = upper - before * before;
    const uint32_t digits =
        (uint32_t)least(((remainder << 15) + ((uint32_t)normal >> 17)) / before, 0xFFFF);
    uint64_t made = ((uint64_t)before << 16) + digits;
    while (made * made > normal) made--;
    return (uint32_t)(made >> (shift / 2));
}

// SPDX-License-Identifier: Apache-2.0
// common.h -- what the drivers of the figures share: their source of random numbers, and the
// CRC-32 of a frame or of a set of coefficients.
#pragma once
#include <cstddef>
#include <cstdint>

namespace moire {

struct Random {  // xorshift64*; only the upper bits of its product are good
    uint64_t state;
    uint64_t operator()() {
        state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
        return (state * 2685821657736338717ULL) >> 16;
    }
    uint32_t bits32() { return uint32_t((*this)() >> 16); }
    double share() { return bits32() / 4294967296.0; }  // 0 <= share < 1
    int64_t below(int64_t n) { return int64_t((*this)() % uint64_t(n)); }
    int64_t from(int64_t low, int64_t high) { return low + below(high - low + 1); }
    double between(double low, double high) {
        return low + (high - low) * double(below(1 << 20)) / (1 << 20);
    }
    bool one_in(int64_t n) { return below(n) == 0; }
};

inline uint32_t crc32(const uint8_t* bytes, size_t size) {
    uint32_t crc = ~0u;
    for (size_t n = 0; n < size; n++) {
        crc ^= bytes[n];
        for (int bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
    return ~crc;
}

}  // namespace moire

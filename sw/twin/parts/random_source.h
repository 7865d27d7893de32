// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend on the seed and the name of the stream only: xoshiro256++ seeded by
// splitmix64.
#pragma once
#include <cmath>
#include <cstdint>

namespace twin {

class RandomSource {
 public:
    explicit RandomSource(uint64_t seed = 0, uint64_t stream = 0) {
        uint64_t x = seed * 0x9E3779B97F4A7C15u ^ stream;
        for (auto& word : state_) {
            uint64_t z = x += 0x9E3779B97F4A7C15u;
            z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
            z = (z ^ z >> 27) * 0x94D049BB133111EBu;
            word = z ^ z >> 31;
        }
    }
    uint64_t bits() {
        const uint64_t sum = state_[0] + state_[3], result = (sum << 23 | sum >> 41) + state_[0],
                       t = state_[1] << 17;
        state_[2] ^= state_[0];
        state_[3] ^= state_[1];
        state_[1] ^= state_[2];
        state_[0] ^= state_[3];
        state_[2] ^= t;
        state_[3] = state_[3] << 45 | state_[3] >> 19;
        return result;
    }
    double uniform() { return double(bits() >> 11) * 0x1p-53; }  // [0, 1)
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    double exponential(double mean) { return -mean * std::log1p(-uniform()); }
    double normal() {  // Marsaglia's polar method
        if (spare_valid_) {
            spare_valid_ = false;
            return spare_;
        }
        double u, v, s;
        do {
            u = 2 * uniform() - 1;
            v = 2 * uniform() - 1;
            s = u * u + v * v;
        } while (s >= 1 || s == 0);
        const double scale = std::sqrt(-2 * std::log(s) / s);
        spare_ = v * scale;
        spare_valid_ = true;
        return u * scale;
    }

 private:
    uint64_t state_[4];
    double spare_ = 0;
    bool spare_valid_ = false;
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// Vibration of the floor under a machine: the acceleration of its base.
//
// In each third-octave band from 4 to 80 Hz the velocity has the given rms value, as the generic
// criteria (VC-A ... VC-E) state their limit. A band holds one tone, whose frequency within the
// band and whose phase are drawn from the seed.
//
// source    Gordon, Generic vibration criteria for vibration-sensitive equipment, Proc. SPIE 1619
//           (1991): VC-C 12.5 um/s, VC-E 3.1 um/s
#pragma once
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>

#include "parts/random_source.h"

namespace twin {

class Floor {
 public:
    Floor(double dt, uint64_t seed, uint64_t stream) {  // s
        RandomSource random(~seed, ~stream);
        double centre = LOWEST;
        for (Tone& tone : tones_) {
            const double turn = 2 * M_PI * centre * std::exp2(random.uniform(-1, 1) / 6);
            tone.value = std::polar(std::sqrt(2) * turn, random.uniform(0, 2 * M_PI));
            tone.turn = std::polar(1.0, turn * dt);
            centre *= THIRD;
        }
    }
    double step(double velocity) {  // m/s rms; m/s2, after one more time step
        if (velocity == 0) return 0;
        double sum = 0;
        for (Tone& tone : tones_) sum += (tone.value *= tone.turn).real();
        return velocity * sum;
    }

 private:
    static constexpr double LOWEST = 4, THIRD = 1.2599210498948732;
    static constexpr int BANDS = 14;  // 4 to 80 Hz
    struct Tone {
        std::complex<double> value, turn;  // acceleration for 1 m/s, and its turn in a time step
    };
    std::array<Tone, BANDS> tones_{};
};

}  // namespace twin

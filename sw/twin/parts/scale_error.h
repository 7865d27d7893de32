// SPDX-License-Identifier: Apache-2.0
// Error of a scale along its travel: the indicated position minus the true position.
//
//   error = linear x + cyclic sin(2 pi x / pitch) + walk(x)
//
// The walk has independent normal steps every WALK_STEP and straight lines between them. Each part
// is 0 at x = 0.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>

#include "parameters.h"
#include "parts/random_source.h"

namespace twin {

class ScaleError {
 public:
    void configure(const StageParameters& p, uint64_t seed, uint64_t stream) {
        linear_ = p.scale_linear;
        cyclic_ = p.scale_cyclic;
        turns_ = 2 * M_PI / p.scale_pitch;
        there_ = linear_ != 0 || cyclic_ != 0 || p.scale_walk != 0;
        RandomSource random(~seed,
                            stream);  // its own stream: all other random numbers stay the same
        double sum = 0;
        for (double& error : walk_) error = sum += p.scale_walk * random.normal();
        const double zero = walk_at(0);
        for (double& error : walk_) error -= zero;
    }
    double at(double x) const {
        return there_ ? linear_ * x + cyclic_ * std::sin(turns_ * x) + walk_at(x) : 0;
    }

 private:
    static constexpr double WALK_STEP = 1e-3, WALK_FROM = -4e-3;
    static constexpr int POINTS = 132;  // 4 mm farther than the travel of S0 on either side

    double walk_at(double x) const {
        const double index = std::fmin(std::fmax((x - WALK_FROM) / WALK_STEP, 0), POINTS - 1.001);
        const int n = int(index);
        return walk_[n] + (walk_[n + 1] - walk_[n]) * (index - n);
    }

    bool there_ = false;
    double linear_ = 0, cyclic_ = 0, turns_ = 0;
    std::array<double, POINTS> walk_{};
};

}  // namespace twin

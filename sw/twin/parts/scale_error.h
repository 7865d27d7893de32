// SPDX-License-Identifier: Apache-2.0
// Error of a scale along its travel: the indicated position minus the true position of the work
// piece.
//
//   error = linear x + cyclic sin(2 pi x / pitch) + walk(x)
//           + expansion * change of temperature * (x - anchor)
//           - angle^2 / 2 x
//           + abbe_arm * guide_tilt sin(2 pi x / guide_length)
//           + rotation * guide_straightness (cos(2 pi x / guide_length) - 1)
//
// The walk has independent normal steps every WALK_STEP and straight lines between them; it is 0 at
// x = 0. The temperature approaches its change exponentially from power-up on. The angle is that
// between scale and travel (cosine error), abbe_arm the distance from the line of the scale to the
// work piece, rotation that of the scale's lines in its plane: the guide tilts the table and leads
// it off its line.
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
        linear_ = p.scale_linear - p.scale_angle * p.scale_angle / 2;
        cyclic_ = p.scale_cyclic;
        turns_ = 2 * M_PI / p.scale_pitch;
        growth_ = p.scale_expansion * p.temperature_change;
        rate_ = 1 / p.temperature_time;
        anchor_ = p.scale_anchor;
        abbe_ = p.scale_abbe_arm * p.guide_tilt;
        aside_ = p.scale_rotation * p.guide_straightness;
        waves_ = 2 * M_PI / p.guide_length;
        there_ = linear_ != 0 || cyclic_ != 0 || p.scale_walk != 0 || growth_ != 0 || abbe_ != 0 ||
                 aside_ != 0;
        RandomSource random(~seed,
                            stream);  // its own stream: all other random numbers stay the same
        double sum = 0;
        for (double& error : walk_) error = sum += p.scale_walk * random.normal();
        const double zero = walk_at(0);
        for (double& error : walk_) error -= zero;
    }
    double at(double x, double seconds) const {  // m, s from power-up
        if (!there_) return 0;
        double error = linear_ * x + cyclic_ * std::sin(turns_ * x) + walk_at(x);
        if (growth_ != 0) error -= growth_ * std::expm1(-rate_ * seconds) * (x - anchor_);
        if (abbe_ != 0) error += abbe_ * std::sin(waves_ * x);
        if (aside_ != 0) error += aside_ * (std::cos(waves_ * x) - 1);
        return error;
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
    double linear_ = 0, cyclic_ = 0, turns_ = 0, growth_ = 0, rate_ = 0, anchor_ = 0, abbe_ = 0,
           aside_ = 0, waves_ = 0;
    std::array<double, POINTS> walk_{};
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// A limit switch at either end of the travel, with hysteresis and scatter.
#pragma once
#include "parts/random_source.h"

namespace twin {

class LimitSwitches {
 public:
    template <class P>
    void configure(const P& p) {
        low_ = p.switch_low;
        high_ = p.switch_high;
        hysteresis_ = p.switch_hysteresis;
        scatter_ = p.switch_scatter;
    }
    void set_position(double position, RandomSource& random) {
        low_pressed = position < low_ - hysteresis_;
        high_pressed = position > high_ + hysteresis_;
        low_edge_ = next_low(random);
        high_edge_ = next_high(random);
    }
    void move(double position, RandomSource& random) {
        if (low_pressed != (position < low_edge_)) {
            low_pressed = !low_pressed;
            low_edge_ = next_low(random);
        }
        if (high_pressed != (position > high_edge_)) {
            high_pressed = !high_pressed;
            high_edge_ = next_high(random);
        }
    }

    bool low_pressed = false, high_pressed = false;

 private:
    double next_low(RandomSource& random) const {
        return low_ + random.uniform(-scatter_, scatter_) - (low_pressed ? 0 : hysteresis_);
    }
    double next_high(RandomSource& random) const {
        return high_ + random.uniform(-scatter_, scatter_) + (high_pressed ? 0 : hysteresis_);
    }

    double low_ = 0, high_ = 0, hysteresis_ = 0, scatter_ = 0;
    double low_edge_ = 0, high_edge_ = 0;  // where each changes next
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// The circular grating of S1 with its read head: from the true angle to the measured one and to
// A/B/Z. A pure function of angle and time, drawn by the seed.
//
//   measured = angle + sum of a_k sin(k angle + phase_k) + error within a line + drift(time)
//
// Order 1 is the eccentricity, 2 the tilt and 3 the distortion of the ring; the higher ones fall as
// 1/k. All are scaled so that their peak over a turn is ring_peak.
#pragma once
#include <array>
#include <cstdint>

#include "parameters.h"

namespace twin {

class RotaryRing {
 public:
    static constexpr int ORDERS = 64;

    RotaryRing(const RotaryRingParameters& parameters, uint64_t seed);

    double error(double angle) const;    // rad; orders and lines, without drift
    double drift(double seconds) const;  // rad
    double measured(double angle, double seconds) const {
        return angle + error(angle) + drift(seconds);
    }
    int64_t counts(double measured) const;   // edges of A and B from the angle 0
    unsigned levels(double measured) const;  // a in bit 0, b in bit 1, z in bit 2

    std::array<double, ORDERS + 1> amplitude{}, phase{};  // rad, of each order

 private:
    static constexpr int SLOW = 3;

    double peak() const;  // of the orders, over a turn

    RotaryRingParameters p_;
    double line_phase_;
    std::array<double, SLOW> drift_phase_{};
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// How the errors of sine and cosine change: with time from power-up, and along the travel.
//
//   error = as adjusted + drift * min(1, time / drift_time) + travel * x / 0.12 m
//
// The drift adds to the offset of both channels, to the gain of the cosine and to the phase error;
// the change along the travel likewise, and to the amplitude (a scale is never clean and straight
// enough to give the same light everywhere).
#pragma once
#include <cmath>

#include "parameters.h"

namespace twin {

struct SignalErrors {
    double amplitude;                         // of full scale
    double offset_sin, offset_cos, gain_cos;  // of amplitude, of amplitude, of sine
    double sin_of_error, cos_of_error;        // of the phase error
};

class SignalDrift {
 public:
    void configure(const StageParameters& p) {
        p_ = &p;
        changes_ = p.drift_offset != 0 || p.drift_gain != 0 || p.drift_phase != 0 ||
                   p.drift_amplitude != 0 || p.travel_offset != 0 || p.travel_gain != 0 ||
                   p.travel_phase != 0 || p.travel_amplitude != 0;
        still_ = made(0, 0);
    }
    SignalErrors at(double x, double seconds) const {  // m, s from power-up
        if (!changes_) return still_;
        return made(std::fmin(1, seconds / p_->drift_time), x / TRAVEL);
    }

 private:
    static constexpr double TRAVEL = 0.12;  // m, of S0
    SignalErrors made(double time, double way) const {
        const StageParameters& p = *p_;
        const double offset = p.drift_offset * time + p.travel_offset * way,
                     phase = (p.signal_phase_error + p.drift_phase * time + p.travel_phase * way) *
                             M_PI / 180;
        return {p.signal_amplitude * (1 + p.drift_amplitude * time + p.travel_amplitude * way),
                p.signal_offset_sin + offset,
                p.signal_offset_cos + offset,
                p.signal_gain_cos + p.drift_gain * time + p.travel_gain * way,
                std::sin(phase),
                std::cos(phase)};
    }
    const StageParameters* p_ = nullptr;
    bool changes_ = false;
    SignalErrors still_{};
};

}  // namespace twin

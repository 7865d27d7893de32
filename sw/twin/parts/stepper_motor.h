// SPDX-License-Identifier: Apache-2.0
// Stepper motor and its driver: each rising edge of step turns the field by a microstep. The rotor
// hangs on the field by a spring whose torque is a sine of the angle between them, so a load above
// the pull-out torque makes it slip by four full steps at a time.
//
//   torque = pull * sin(poles (field - angle)) + damping (field speed - speed)
//   pull   = holding / sqrt(1 + (speed / corner)^2)
//
// While it is disabled there is no torque and steps are not taken.
#pragma once
#include <cmath>
#include <cstdint>

#include "machines/machine.h"

namespace twin {

class StepperMotor {
 public:
    template <class P>
    void configure(const P& p, double clk_hz) {
        microstep_ = 2 * M_PI / (p.stepper_full_steps * p.stepper_microsteps);
        poles_ = p.stepper_full_steps / 4;
        holding_ = p.stepper_holding;
        corner_ = p.stepper_corner;
        damping_ = p.stepper_damping;
        settle_ = p.stepper_field_settle;
        auto clk = [clk_hz](double seconds) {
            return uint64_t(std::ceil(seconds * clk_hz - 1e-6));
        };
        pulse_clk_ = clk(p.stepper_pulse);
        setup_cycles_ = clk(p.stepper_direction_setup);
        hold_cycles_ = clk(p.stepper_direction_hold);
    }
    void set_position(double angle) {  // the field where the rotor is
        origin_ = angle - double(steps) * microstep_;
        field_speed_ = 0;
    }
    void drive_changed(uint64_t now, unsigned before, unsigned after) {
        const unsigned changed = before ^ after, rising = changed & after;
        if (changed & DIRECTION) {
            timing_errors += steps_began_ && now - step_at_ < hold_cycles_;
            direction_at_ = now;
        }
        if (changed & STEP) {
            timing_errors += steps_began_ && now - edge_at_ < pulse_clk_;
            edge_at_ = now;
        }
        if (rising & STEP) {
            timing_errors += now - direction_at_ < setup_cycles_ && direction_at_;
            steps_began_ = true;
            step_at_ = now;
            if (after & DRIVE_ENABLE) steps += after & DIRECTION ? 1 : -1;
        }
    }
    double field() const { return origin_ + double(steps) * microstep_; }  // rad
    double torque(double angle, double speed, bool enabled, double dt) {   // once a time step
        const double rate = double(steps - steps_before_) * microstep_ / dt;
        steps_before_ = steps;
        field_speed_ += (rate - field_speed_) * -std::expm1(-dt / settle_);
        if (!enabled) return 0;
        return holding_ / std::hypot(1, speed / corner_) * std::sin(poles_ * (field() - angle)) +
               damping_ * (field_speed_ - speed);
    }
    // microsteps that the rotor slipped behind the field, in whole periods of the torque
    int64_t lost(double angle) const {
        const double period = 2 * M_PI / poles_;
        return std::llround((field() - angle) / period) * std::llround(period / microstep_);
    }

    int64_t steps = 0;           // taken, by direction
    uint64_t timing_errors = 0;  // pulses and directions too short for the driver

 private:
    double microstep_ = 0, poles_ = 0, holding_ = 0, corner_ = 0, damping_ = 0, settle_ = 0,
           origin_ = 0, field_speed_ = 0;
    uint64_t pulse_clk_ = 0, setup_cycles_ = 0, hold_cycles_ = 0, edge_at_ = 0, step_at_ = 0,
             direction_at_ = 0;
    int64_t steps_before_ = 0;
    bool steps_began_ = false;
};

}  // namespace twin

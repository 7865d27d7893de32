// SPDX-License-Identifier: Apache-2.0
// The linear motor of S3: voice coil on a current amplifier that a bipolar DAC sets, mover on
// guides with a flexure and a cable, linear scale with a reference mark, end stops and limit
// switches.
//
//   m dv/dt = drive - springs - friction + stops + force from outside
//   drive   = constant * current
//   springs = flexure x + cable (x - cable position)
#pragma once
#include "parts/dac_input.h"
#include "parts/friction.h"
#include "parts/incremental_scale.h"
#include "parts/limit_switches.h"
#include "machines/machine.h"
#include "parameters.h"

namespace twin {

class LinearMotor : public Machine {
 public:
    LinearMotor(const LinearMotorParameters& parameters, uint64_t seed, uint64_t stream,
                double clk_hz);

    const char* faults() const override {
        return "limit_low limit_high drive_fault motor_jam encoder_cut a_stuck b_stuck z_stuck";
    }
    void set_position(double where) override;
    void push(double newton) override { pushed_ = newton; }
    const char* state_names() const override {
        return "time_s position_m velocity_m_s current_a friction_n limit_low? limit_high? a? b? "
               "z? enabled? scale_counts# dac_code# "
               "dac_frames# dac_bad_frames#";
    }
    void state(uint64_t now, double* out) const override;

 protected:
    unsigned pins() const override {
        return scale_.levels() | switches_.low_pressed * LIMIT_LOW_OPEN |
               switches_.high_pressed * LIMIT_HIGH_OPEN | SENSOR_RX;
    }
    void drive_changed(uint64_t, unsigned before, unsigned after) override {
        dac_.drive_changed(before, after);
    }
    void move(uint64_t now) override;
    uint64_t sense(uint64_t now) override;
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override;
    bool own_fault(const char* name, bool on) override;

 private:
    double position(uint64_t now) const final { return position_ + velocity_ * since(now); }

    LinearMotorParameters p_;
    RandomSource random_;
    DacInput dac_;
    Friction guide_{};
    LimitSwitches switches_;
    IncrementalScale scale_;
    double position_ = 0, velocity_ = 0, current_ = 0, friction_ = 0, pushed_ = 0;
    bool jammed_ = false;
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// An axis of S2: stepper motor on a lead screw, table, limit switches, incremental scale with an
// index.
#pragma once
#include "parts/drivetrain.h"
#include "parts/incremental_scale.h"
#include "parts/limit_switches.h"
#include "machines/machine.h"
#include "parameters.h"
#include "parts/stepper_motor.h"

namespace twin {

class StepperStage : public Machine {
 public:
    StepperStage(const StepperStageParameters& parameters, uint64_t seed, uint64_t stream,
                 double clk_hz);

    const char* faults() const override {
        return "limit_low limit_high drive_fault motor_jam encoder_cut a_stuck b_stuck z_stuck";
    }
    void set_position(double where) override;
    void push(double newton) override { drivetrain_.external_force = newton; }
    // nut, field: where motor and field would put the table; scale_changes: how often scale_counts
    // has changed; steps: taken by the driver; lost: microsteps behind the field, in whole slips
    const char* state_names() const override {
        return "time_s position_m velocity_m_s nut_m field_m motor_rad_s screw_n limit_low? "
               "limit_high? a? b? z? enabled? "
               "scale_counts# scale_changes# steps# lost_steps# step_timing_errors#";
    }
    void state(uint64_t now, double* out) const override;

 protected:
    unsigned pins() const override {
        return scale_.levels() | switches_.low_pressed * LIMIT_LOW_OPEN |
               switches_.high_pressed * LIMIT_HIGH_OPEN | SENSOR_RX;
    }
    void drive_changed(uint64_t now, unsigned before, unsigned after) override {
        motor_.drive_changed(now, before, after);
    }
    void move(uint64_t now) override;
    uint64_t sense(uint64_t now) override;
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override;
    bool own_fault(const char* name, bool on) override;

 private:
    double position(uint64_t now) const final {
        return drivetrain_.position + drivetrain_.velocity * since(now);
    }

    StepperStageParameters p_;
    RandomSource random_;
    StepperMotor motor_;
    Drivetrain drivetrain_;
    LimitSwitches switches_;
    IncrementalScale scale_;
};

}  // namespace twin

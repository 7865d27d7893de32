// SPDX-License-Identifier: Apache-2.0
// The rotary table of S4: stepper, worm with periodic error and backlash, table, absolute angle
// sensor. Angles in rad.
#pragma once
#include "parts/angle_sensor.h"
#include "parts/drivetrain.h"
#include "machines/machine.h"
#include "parameters.h"
#include "parts/stepper_motor.h"

namespace twin {

class WormTable : public Machine {
 public:
    WormTable(const WormTableParameters& parameters, uint64_t seed, uint64_t stream, double clk_hz);

    const char* faults() const override { return "drive_fault motor_jam sensor_cut sensor_stuck"; }
    void set_position(double where) override;
    double position(uint64_t now) const final {
        return drivetrain_.position + drivetrain_.velocity * since(now);
    }
    void push(double newton_metre) override { drivetrain_.external_force = newton_metre; }
    // nut: where the worm would put the table without backlash, its error included; lost:
    // microsteps behind the field, in whole slips
    const char* state_names() const override {
        return "time_s position_rad velocity_rad_s nut_rad worm_error_rad motor_rad_s worm_nm "
               "enabled? steps# lost_steps# "
               "step_timing_errors# sensor_frames# sensor_dropped# sensor_corrupt#";
    }
    void state(uint64_t now, double* out) const override;

 protected:
    unsigned pins() const override { return sensor_.rx * SENSOR_RX; }
    void drive_changed(uint64_t now, unsigned before, unsigned after) override {
        motor_.drive_changed(now, before, after);
    }
    void move(uint64_t now) override;
    uint64_t sense(uint64_t now) override { return sensor_.advance(now, position(now)); }
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override;
    bool own_fault(const char* name, bool on) override;

 private:
    double worm_error(double angle) const;  // of the table, at this angle of the worm

    WormTableParameters p_;
    RandomSource random_;
    double worm_phase_, second_phase_, wheel_phase_;
    StepperMotor motor_;
    Drivetrain drivetrain_;
    AngleSensor sensor_;
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
#include "machines/stepper_stage.h"

#include <cstring>

namespace twin {

StepperStage::StepperStage(const StepperStageParameters& parameters, uint64_t seed, uint64_t stream,
                           double clk_hz)
    : Machine(clk_hz, parameters.time_step), p_(parameters), random_(seed, stream) {
    configure();
    set_position(random_.uniform(p_.travel_start_lowest, p_.travel_start_highest));
}

void StepperStage::configure() {
    drivetrain_.configure(screw_and_table(p_));
    motor_.configure(p_, clk_hz());
    switches_.configure(p_);
    scale_.configure(p_);
}

void StepperStage::set_position(double where) {
    drivetrain_.set_position(where);
    motor_.set_position(drivetrain_.angle);
    switches_.set_position(where, random_);
    scale_.move(where, random_);
}

void StepperStage::move(uint64_t) {
    const double dt = time_step();
    drivetrain_.step(
        motor_.torque(drivetrain_.angle, drivetrain_.speed, drive() & DRIVE_ENABLE, dt), dt);
    switches_.move(drivetrain_.position, random_);
}

uint64_t StepperStage::sense(uint64_t now) {
    scale_.move(position(now), random_);
    return scale_.next_change(now, position(now), drivetrain_.velocity, clk_hz());
}

bool StepperStage::own_fault(const char* name, bool on) {
    if (std::strcmp(name, "motor_jam")) return false;
    drivetrain_.jammed = on;
    return true;
}

void StepperStage::state(uint64_t now, double* out) const {
    for (const double value :
         {double(now) / clk_hz(), position(now), drivetrain_.velocity, drivetrain_.nut(),
          motor_.field() * p_.screw_lead / (2 * M_PI), drivetrain_.speed, drivetrain_.force(),
          double(flag(LIMIT_LOW_OPEN)), double(flag(LIMIT_HIGH_OPEN)), double(flag(ENCODER_A)),
          double(flag(ENCODER_B)), double(flag(ENCODER_Z)), double((drive() & DRIVE_ENABLE) != 0),
          double(scale_.counts()), double(scale_.changes()), double(motor_.steps),
          double(motor_.lost(drivetrain_.angle)), double(motor_.timing_errors)})
        *out++ = value;
}

}  // namespace twin

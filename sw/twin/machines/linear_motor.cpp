// SPDX-License-Identifier: Apache-2.0
#include "machines/linear_motor.h"

#include <cstring>

namespace twin {

LinearMotor::LinearMotor(const LinearMotorParameters& parameters, uint64_t seed, uint64_t stream,
                         double clk_hz)
    : Machine(clk_hz, parameters.time_step), p_(parameters), random_(seed, stream) {
    configure();
    set_position(random_.uniform(p_.travel_start_lowest, p_.travel_start_highest));
}

void LinearMotor::configure() {
    const double pushed = guide_.deflection;
    guide_ = {p_.guide_coulomb,
              p_.guide_static,
              p_.guide_stribeck_velocity,
              p_.guide_viscous,
              p_.guide_presliding,
              p_.guide_presliding_damping,
              pushed};
    switches_.configure(p_);
    scale_.configure(p_);
}

void LinearMotor::set_position(double where) {
    position_ = where;
    velocity_ = current_ = friction_ = 0;
    // the guide carries what pulls at the mover as far as it can, so it stays
    const double pull =
        -p_.flexure_stiffness * where - p_.cable_stiffness * (where - p_.cable_position);
    guide_.deflection = std::fmax(-1, std::fmin(1, pull / p_.guide_coulomb)) * p_.guide_presliding;
    switches_.set_position(where, random_);
    scale_.move(where, random_);
}

void LinearMotor::move(uint64_t) {
    const double dt = time_step();
    double demanded =
        drive() & DRIVE_ENABLE ? p_.amplifier_gain * p_.amplifier_reference * dac_.share() : 0;
    demanded = std::fmax(-p_.amplifier_limit, std::fmin(p_.amplifier_limit, demanded));
    current_ += (demanded - current_) * -std::expm1(-2 * M_PI * p_.amplifier_bandwidth * dt);

    double force = p_.motor_constant * current_ + pushed_ - p_.flexure_stiffness * position_ -
                   p_.cable_stiffness * (position_ - p_.cable_position);
    if (position_ < p_.travel_low_stop)
        force += std::fmax(0, p_.travel_stop_stiffness * (p_.travel_low_stop - position_) -
                                  p_.travel_stop_damping * velocity_);
    else if (position_ > p_.travel_high_stop)
        force += std::fmin(0, p_.travel_stop_stiffness * (p_.travel_high_stop - position_) -
                                  p_.travel_stop_damping * velocity_);
    friction_ = guide_.force(velocity_, dt);
    velocity_ = jammed_ ? 0 : velocity_ + dt / p_.mover_mass * (force - friction_);
    position_ += dt * velocity_;
    switches_.move(position_, random_);
}

uint64_t LinearMotor::sense(uint64_t now) {
    scale_.move(position(now), random_);
    return scale_.next_change(now, position(now), velocity_, clk_hz());
}

bool LinearMotor::own_fault(const char* name, bool on) {
    if (std::strcmp(name, "motor_jam")) return false;
    jammed_ = on;
    return true;
}

void LinearMotor::state(uint64_t now, double* out) const {
    for (const double value :
         {double(now) / clk_hz(), position(now), velocity_, current_, friction_,
          double(flag(LIMIT_LOW_OPEN)), double(flag(LIMIT_HIGH_OPEN)), double(flag(ENCODER_A)),
          double(flag(ENCODER_B)), double(flag(ENCODER_Z)), double((drive() & DRIVE_ENABLE) != 0),
          double(scale_.counts()), double(dac_.code), double(dac_.frames), double(dac_.bad_frames)})
        *out++ = value;
}

}  // namespace twin

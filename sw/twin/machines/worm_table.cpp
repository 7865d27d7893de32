// SPDX-License-Identifier: Apache-2.0
#include "machines/worm_table.h"

#include <cstring>
#include <limits>

namespace twin {

constexpr double ARC_SECOND = M_PI / 180 / 3600;

WormTable::WormTable(const WormTableParameters& parameters, uint64_t seed, uint64_t stream,
                     double clk_hz)
    : Machine(clk_hz, parameters.time_step),
      p_(parameters),
      random_(seed, stream),
      worm_phase_(2 * M_PI * random_.uniform()),
      second_phase_(2 * M_PI * random_.uniform()),
      wheel_phase_(2 * M_PI * random_.uniform()),
      sensor_(seed, stream + 1) {
    configure();
    set_position(2 * M_PI * random_.uniform());
}

void WormTable::configure() {
    constexpr double ENDLESS = std::numeric_limits<double>::infinity();
    drivetrain_.configure({p_.motor_inertia,
                           1 / p_.worm_ratio,
                           p_.worm_stiffness,
                           p_.worm_damping,
                           p_.worm_backlash * ARC_SECOND,
                           0,
                           p_.table_inertia,
                           {p_.motor_coulomb, p_.motor_static, p_.motor_stribeck_velocity,
                            p_.motor_viscous, p_.motor_presliding, p_.motor_presliding_damping},
                           {p_.table_coulomb, p_.table_static, p_.table_stribeck_velocity,
                            p_.table_viscous, p_.table_presliding, p_.table_presliding_damping},
                           -ENDLESS,
                           ENDLESS,
                           0,
                           0});
    motor_.configure(p_, clk_hz());
    sensor_.configure(p_, clk_hz());
}

double WormTable::worm_error(double angle) const {
    return ARC_SECOND * (p_.worm_error * std::sin(angle + worm_phase_) +
                         p_.worm_second_error * std::sin(2 * angle + second_phase_) +
                         p_.worm_wheel_error * std::sin(angle / p_.worm_ratio + wheel_phase_));
}

void WormTable::set_position(double where) {
    drivetrain_.error = 0;
    for (int n = 0; n < 10; n++) {  // the error depends on the angle that it shifts, by little
        drivetrain_.set_position(where);
        drivetrain_.error = worm_error(drivetrain_.angle);
    }
    motor_.set_position(drivetrain_.angle);
}

void WormTable::move(uint64_t) {
    const double dt = time_step();
    drivetrain_.error = worm_error(drivetrain_.angle);
    drivetrain_.step(
        motor_.torque(drivetrain_.angle, drivetrain_.speed, drive() & DRIVE_ENABLE, dt), dt);
}

bool WormTable::own_fault(const char* name, bool on) {
    if (!std::strcmp(name, "motor_jam")) return drivetrain_.jammed = on, true;
    if (!std::strcmp(name, "sensor_stuck")) return sensor_.stuck = on, true;
    return false;
}

void WormTable::state(uint64_t now, double* out) const {
    for (const double value :
         {double(now) / clk_hz(), position(now), drivetrain_.velocity, drivetrain_.nut(),
          drivetrain_.error, drivetrain_.speed, drivetrain_.force(),
          double((drive() & DRIVE_ENABLE) != 0), double(motor_.steps),
          double(motor_.lost(drivetrain_.angle)), double(motor_.timing_errors),
          double(sensor_.frames), double(sensor_.dropped), double(sensor_.corrupt)})
        *out++ = value;
}

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
#include "plant.h"

#include <cmath>

namespace twin {

Plant::Plant(const Parameters& parameters, uint64_t seed, uint64_t stream) : p(parameters), random_(seed, stream) {
    configure();
    place(random_.uniform(p.travel_start_lowest, p.travel_start_highest));
}

void Plant::configure() {
    metre_per_radian_ = p.screw_lead / (2 * M_PI);
    const double wound = bearing_.deflection, pushed = guide_.deflection;
    bearing_ = {p.motor_coulomb, p.motor_static, p.motor_stribeck_velocity, p.motor_viscous, p.motor_presliding, p.motor_presliding_damping, wound};
    guide_ = {p.table_coulomb, p.table_static, p.table_stribeck_velocity, p.table_viscous, p.table_presliding, p.table_presliding_damping, pushed};
}

void Plant::place(double where) {
    position = where;
    velocity = speed = current = voltage = 0;
    bearing_.deflection = guide_.deflection = 0;
    // the flank carries the preload, so nothing pulls at the table
    angle = (where - p.screw_backlash / 2 - p.screw_preload / p.screw_stiffness) / metre_per_radian_;
    low_pressed = where < p.switch_low - p.switch_hysteresis;
    high_pressed = where > p.switch_high + p.switch_hysteresis;
    low_edge_ = p.switch_low + scatter() - (low_pressed ? 0 : p.switch_hysteresis);
    high_edge_ = p.switch_high + scatter() + (high_pressed ? 0 : p.switch_hysteresis);
}

double Plant::screw_force() const {
    const double stretch = nut() - position, rate = speed * metre_per_radian_ - velocity, play = p.screw_backlash / 2;
    double flank = 0;
    if (stretch > play)
        flank = std::fmax(0, p.screw_stiffness * (stretch - play) + p.screw_damping * rate);
    else if (stretch < -play)
        flank = std::fmin(0, p.screw_stiffness * (stretch + play) + p.screw_damping * rate);
    return flank + p.screw_preload;
}

void Plant::conduct(double emf, double seconds, double& charge) {
    const double end = emf / p.motor_resistance, x = seconds * p.motor_resistance / p.motor_inductance;
    const double left = std::exp(-x), before = current;
    current = end + (before - end) * left;
    charge += end * seconds + (before - current) * p.motor_inductance / p.motor_resistance;   // exact integral
}

void Plant::step(const BridgeTime& bridge) {
    const double dt = p.time_step, total = double(bridge.coast) + bridge.forward + bridge.reverse + bridge.brake;
    const double back = p.motor_constant * speed, before = current;
    double charge = 0;
    auto share = [&](uint32_t clk) { return dt * clk / total; };

    if (bridge.forward) conduct(p.supply_voltage - back, share(bridge.forward), charge);
    if (bridge.reverse) conduct(-p.supply_voltage - back, share(bridge.reverse), charge);
    if (bridge.brake) conduct(-back, share(bridge.brake), charge);
    if (bridge.coast && current != 0) {                       // the diodes feed the current back into the supply until it ends
        const double sign = current > 0 ? 1 : -1, against = -sign * (p.supply_voltage + 2 * p.supply_diode_drop) - back;
        const double end = against / p.motor_resistance, tau = p.motor_inductance / p.motor_resistance;
        const double seconds = share(bridge.coast), ends = sign * end < 0 ? tau * std::log1p(-current / end) : seconds;
        if (ends < seconds) {
            charge += end * ends + current * tau;
            current = 0;
        } else {
            conduct(against, seconds, charge);
        }
    }
    const double mean = charge / dt;
    voltage = mean * p.motor_resistance + back + p.motor_inductance * (current - before) / dt;

    const double push = screw_force();
    double stop = 0;
    if (position < p.travel_low_stop)
        stop = std::fmax(0, p.travel_stop_stiffness * (p.travel_low_stop - position) - p.travel_stop_damping * velocity);
    else if (position > p.travel_high_stop)
        stop = std::fmin(0, p.travel_stop_stiffness * (p.travel_high_stop - position) - p.travel_stop_damping * velocity);

    if (jammed)
        speed = 0;
    else
        speed += dt / p.motor_inertia * (p.motor_constant * mean - bearing_.force(speed, dt) - metre_per_radian_ * push);
    if (table_clamped)
        velocity = 0;
    else
        velocity += dt / p.table_mass * (push + stop + external_force - guide_.force(velocity, dt));
    angle += dt * speed;
    position += dt * velocity;
    switches();
}

void Plant::switches() {
    if (low_pressed != (position < low_edge_)) {
        low_pressed = !low_pressed;
        low_edge_ = p.switch_low + scatter() - (low_pressed ? 0 : p.switch_hysteresis);
    }
    if (high_pressed != (position > high_edge_)) {
        high_pressed = !high_pressed;
        high_edge_ = p.switch_high + scatter() + (high_pressed ? 0 : p.switch_hysteresis);
    }
}

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
#include "machines/plant.h"

#include <cmath>

namespace twin {

Plant::Plant(const StageParameters& parameters, uint64_t seed, uint64_t stream)
    : p(parameters), random_(seed, stream) {
    configure();
    set_position(random_.uniform(p.travel_start_lowest, p.travel_start_highest));
}

void Plant::configure() {
    drivetrain.configure(screw_and_table(p));
    switches.configure(p);
}

void Plant::set_position(double position) {
    drivetrain.set_position(position);
    switches.set_position(position, random_);
    current = voltage = 0;
}

void Plant::conduct(double emf, double seconds, double& charge) {
    const double end = emf / p.motor_resistance,
                 x = seconds * p.motor_resistance / p.motor_inductance;
    const double left = std::exp(-x), before = current;
    current = end + (before - end) * left;
    charge += end * seconds +
              (before - current) * p.motor_inductance / p.motor_resistance;  // exact integral
}

void Plant::step(const BridgeTime& bridge, double dt) {
    const double total = double(bridge.coast) + bridge.forward + bridge.reverse + bridge.brake;
    const double back = p.motor_constant * drivetrain.speed, before = current;
    double charge = 0;
    auto share = [&](uint32_t clk) { return dt * clk / total; };

    const double supply = p.supply_voltage + p.supply_ripple * std::sin(hum_);
    if (p.supply_ripple != 0) hum_ += 2 * M_PI * p.supply_hum * dt;

    if (bridge.forward) conduct(supply - back, share(bridge.forward), charge);
    if (bridge.reverse) conduct(-supply - back, share(bridge.reverse), charge);
    if (bridge.brake) conduct(-back, share(bridge.brake), charge);
    if (bridge.coast &&
        current != 0) {  // the diodes feed the current back into the supply until it ends
        const double sign = current > 0 ? 1 : -1,
                     against = -sign * (supply + 2 * p.supply_diode_drop) - back;
        const double end = against / p.motor_resistance,
                     tau = p.motor_inductance / p.motor_resistance;
        const double seconds = share(bridge.coast),
                     ends = sign * end < 0 ? tau * std::log1p(-current / end) : seconds;
        if (ends < seconds) {
            charge += end * ends + current * tau;
            current = 0;
        } else {
            conduct(against, seconds, charge);
        }
    }
    const double mean = charge / dt;
    voltage = mean * p.motor_resistance + back + p.motor_inductance * (current - before) / dt;

    double torque = p.motor_constant * mean;
    if (p.motor_ripple != 0)
        torque *= 1 + p.motor_ripple * std::sin(p.motor_segments * drivetrain.angle);
    if (p.motor_cogging != 0)
        torque += p.motor_cogging * std::sin(p.motor_slots * drivetrain.angle);
    if (p.screw_error != 0) drivetrain.error = p.screw_error * std::sin(drivetrain.angle);
    drivetrain.step(torque, dt);
    switches.move(drivetrain.position, random_);
}

}  // namespace twin

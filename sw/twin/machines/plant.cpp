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

    if (bridge.forward) conduct(p.supply_voltage - back, share(bridge.forward), charge);
    if (bridge.reverse) conduct(-p.supply_voltage - back, share(bridge.reverse), charge);
    if (bridge.brake) conduct(-back, share(bridge.brake), charge);
    if (bridge.coast &&
        current != 0) {  // the diodes feed the current back into the supply until it ends
        const double sign = current > 0 ? 1 : -1,
                     against = -sign * (p.supply_voltage + 2 * p.supply_diode_drop) - back;
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

    drivetrain.step(p.motor_constant * mean, dt);
    switches.move(drivetrain.position, random_);
}

}  // namespace twin

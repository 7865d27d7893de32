// SPDX-License-Identifier: Apache-2.0
// One axis of the stage: bridge, DC motor, lead screw, table, guides, end stops, limit switches.
#pragma once
#include <cstdint>

#include "friction.h"
#include "parameters.h"                                       // made by build.py from parameters.toml
#include "random_source.h"

namespace twin {

struct BridgeTime {                                           // how one plant step was spent, clk
    uint32_t coast = 0, forward = 0, reverse = 0, brake = 0;
};

class Plant {
public:
    Plant(const Parameters& parameters, uint64_t seed, uint64_t stream);
    void step(const BridgeTime& bridge);                      // advance by parameters.time_step
    void configure();                                         // take over changed parameters, keep the state
    void place(double position);                              // at rest, preload and screw in equilibrium

    Parameters p;
    double position = 0, velocity = 0;                        // of the table, m, m/s
    double angle = 0, speed = 0;                              // of the motor, rad, rad/s
    double current = 0, voltage = 0;                          // A, mean V over the last step
    double external_force = 0;                                // on the table, N
    bool jammed = false;                                      // the rotor does not turn
    bool table_clamped = false;                               // the table does not move
    bool low_pressed = false, high_pressed = false;           // limit switches

    double nut() const { return angle * metre_per_radian_; }  // m
    double screw_force() const;                               // on the table, N

private:
    void conduct(double emf, double seconds, double& charge); // current through the windings with this voltage across R and L
    void switches();
    double scatter() { return random_.uniform(-p.switch_scatter, p.switch_scatter); }

    RandomSource random_;
    Friction bearing_{}, guide_{};
    double metre_per_radian_ = 0, low_edge_ = 0, high_edge_ = 0;
};

}  // namespace twin

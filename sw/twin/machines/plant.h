// SPDX-License-Identifier: Apache-2.0
// Bridge, DC motor, lead screw, table, guides, end stops, limit switches of the stage.
#pragma once
#include <cstdint>

#include "parts/drivetrain.h"
#include "parts/limit_switches.h"
#include "parameters.h"  // made by build.py
#include "parts/random_source.h"

namespace twin {

struct BridgeTime {  // how one time step was spent, cycles
    uint32_t coast = 0, forward = 0, reverse = 0, brake = 0;
};

class Plant {
 public:
    Plant(const StageParameters& parameters, uint64_t seed, uint64_t stream);
    void step(const BridgeTime& bridge, double dt);
    void configure();  // take over changed parameters, keep the state
    void set_position(double position);

    Drivetrain drivetrain;
    LimitSwitches switches;
    double current = 0, voltage = 0;  // A, mean V over the last step

 private:
    void conduct(double emf, double seconds,
                 double& charge);  // current through the windings with this voltage across R and L

    const StageParameters& p;
    RandomSource random_;
    double hum_ = 0;  // phase of the supply's ripple, rad
};

}  // namespace twin

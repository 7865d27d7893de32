// SPDX-License-Identifier: Apache-2.0
#include "stage.h"

namespace twin {

bool Stage::set(const char* name, double value) {
    const double step = plant.p.time_step;
    if (!set_parameter(plant.p, name, value)) return false;
    plant.p.time_step = step;                                 // is fixed at the start
    interferometer.p = plant.p;
    plant.configure();
    interferometer.configure();
    return true;
}

}  // namespace twin

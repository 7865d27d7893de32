// SPDX-License-Identifier: Apache-2.0
// Friction with presliding: the elasto-plastic single-state model of Dupont, Hayward, Armstrong and
// Altpeter, IEEE Trans. Automatic Control 47 (2002) 787. Below break-away it is a spring that never
// creeps, so stiction holds for ever. In steady sliding it gives Stribeck's curve:
//
//   coulomb + (static - coulomb) exp(-(v/stribeck)^2) + viscous v
//
// The deflection is advanced by a step that is implicit in the sliding term, so it is stable at any
// speed and any step.
#pragma once
#include <cmath>

namespace twin {

struct Friction {
    double coulomb, breakaway, stribeck_velocity, viscous;  // N, N, m/s, Ns/m (or their rotary kin)
    double presliding;                                      // deflection at coulomb friction
    double damping;                                         // of the deflection
    double deflection = 0;

    double sliding(double v) const {  // what deflection alone carries in steady sliding
        const double r = v / stribeck_velocity;
        return r * r > 30 ? coulomb : coulomb + (breakaway - coulomb) * std::exp(-r * r);
    }
    double force(double v, double dt) {  // against the motion, after one step of dt at speed v
        const double stiffness = coulomb / presliding;
        const double limit = sliding(v) / stiffness, elastic = 0.7 * presliding, z = deflection,
                     size = std::fabs(z);
        double plastic = 0;  // share of the motion that slides
        if (z * v > 0 && size > elastic) {
            const double t = (size - elastic) / (limit - elastic);
            plastic = t < 1 ? t * t * (3 - 2 * t) : 1;
        }
        deflection = (z + v * dt) / (1 + plastic * std::fabs(v) * dt / limit);
        return stiffness * deflection + damping * (deflection - z) / dt + viscous * v;
    }
};

}  // namespace twin

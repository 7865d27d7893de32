// SPDX-License-Identifier: Apache-2.0
// Fine stage: amplifier with a slew limit, piezo with hysteresis and creep, a flexure with its
// first mode, a mass on it.
//
//   hysteresis  y = w0 u + w sum play(u, r_i), as Prandtl and Ishlinskii have it
//   mode        x'' + 2 d w x' + w^2 x = w^2 (y + noise) - acceleration of the base
//
// The weights of the hysteresis follow from the range, which the full loop reaches, and from the
// width of that loop at its middle. The creep is nearly logarithmic: two relaxations per decade
// from 10 ms to 1000 s, which together make `creep` of the travel per decade. The noise of
// converter and amplifier is white and given by its density.
#pragma once
#include <array>
#include <cmath>

#include "parameters.h"
#include "parts/random_source.h"

namespace twin {

class Piezo {
 public:
    Piezo(uint64_t seed, uint64_t stream) : random_(~seed, stream ^ NOISE_STREAM) {}

    template <class P>
    void configure(const P& p) {
        range_ = p.piezo_range;
        slew_ = p.piezo_slew;
        creep_ = p.piezo_creep / PER_DECADE;
        natural_ = 2 * M_PI * p.piezo_mode;
        damping_ = p.piezo_mode_damping;
        mass_ = p.piezo_mass;
        noise_ = p.piezo_noise;
        double width = 0, travel = 0;  // of the full loop, for a weight of 1
        for (int i = 0; i < PLAYS; i++) {
            width += 2 * std::fmin(radius(i), 1 - radius(i));
            travel += 2 * (1 - radius(i));
        }
        weight_ = p.piezo_hysteresis * range_ / width;
        direct_ = (range_ - weight_ * travel) / 2;
    }
    // demanded: -1..1 of the amplifier's swing; base: acceleration of the base, m/s2
    void step(double demanded, double dt, double base = 0) {
        const double most = slew_ * dt;
        drive += std::fmax(-most, std::fmin(most, demanded - drive));
        double travel = direct_ * drive;
        for (int i = 0; i < PLAYS; i++) {
            play_[i] = std::fmax(drive - radius(i), std::fmin(drive + radius(i), play_[i]));
            travel += weight_ * play_[i];
        }
        double crept = 0, tau = SHORTEST;
        for (double& state : crept_) {
            state += (creep_ * travel - state) * -std::expm1(-dt / tau);
            crept += state;
            tau *= RATIO;
        }
        double demand = travel + crept;
        if (noise_ != 0) demand += noise_ * std::sqrt(0.5 / dt) * random_.normal();
        const double acceleration =
            natural_ * natural_ * (demand - position) - 2 * damping_ * natural_ * velocity;
        velocity += dt * (acceleration - base);
        position += dt * velocity;
        reaction = -mass_ * acceleration;
    }

    double drive = 0;                   // of the amplifier's swing
    double position = 0, velocity = 0;  // of the platform on the table, m, m/s
    double reaction = 0;                // on the table, N

 private:
    static constexpr uint64_t NOISE_STREAM = 0x7069657A6F;
    static constexpr int PLAYS = 10, PER_DECADE = 2, RELAXATIONS = 11;
    static constexpr double SHORTEST = 0.01, RATIO = 3.1622776601683795;  // s; two a decade
    static constexpr double radius(int i) { return (i + 1) / double(PLAYS + 1); }

    double range_ = 0, slew_ = 0, creep_ = 0, natural_ = 0, damping_ = 0, mass_ = 0, weight_ = 0,
           direct_ = 0, noise_ = 0;
    RandomSource random_;
    std::array<double, PLAYS> play_{};
    std::array<double, RELAXATIONS> crept_{};
};

}  // namespace twin

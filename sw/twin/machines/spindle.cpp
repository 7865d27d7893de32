// SPDX-License-Identifier: Apache-2.0
#include "machines/spindle.h"

namespace twin {

Spindle::Spindle(const SpindleParameters& parameters, uint64_t, uint64_t, double clk_hz)
    : Machine(clk_hz, parameters.time_step), p_(parameters), angle_(parameters.encoder_start) {}

void Spindle::move(uint64_t) {
    const double dt = time_step();
    angle_ += rate_ * dt;
    speed_ += (p_.drive_speed - speed_) * -std::expm1(-dt / p_.drive_settle);
    rate_ = speed_ * (1 + p_.drive_unevenness * std::cos(2 * M_PI * p_.drive_order * angle_));
}

uint64_t Spindle::sense(uint64_t now) {
    const double at = position(now) * counts_per_turn();
    counts_ = int64_t(std::floor(at));
    const double left = rate_ > 0 ? double(counts_ + 1) - at : at - double(counts_);
    const double clk = rate_ ? left / std::fabs(rate_ * counts_per_turn()) * clk_hz() : 1e18;
    return clk < 1e15 ? now + 1 + uint64_t(clk) : NEVER;
}

unsigned Spindle::pins() const {
    const unsigned quarter = unsigned(counts_) & 3;
    const bool index = counts_ % int64_t(counts_per_turn()) == 0;
    return SENSOR_RX | ((quarter ^ quarter >> 1) & 1) * ENCODER_A | (quarter >> 1) * ENCODER_B |
           index * ENCODER_Z;
}

void Spindle::state(uint64_t now, double* out) const {
    for (const double value :
         {double(now) / clk_hz(), position(now), speed_, double(flag(ENCODER_A)),
          double(flag(ENCODER_B)), double(flag(ENCODER_Z)), double(counts_)})
        *out++ = value;
}

}  // namespace twin

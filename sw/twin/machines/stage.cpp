// SPDX-License-Identifier: Apache-2.0
#include "machines/stage.h"

#include <algorithm>
#include <cstring>

namespace twin {

Stage::Stage(const StageParameters& parameters, uint64_t seed, uint64_t stream, double clk_hz)
    : Machine(clk_hz, parameters.time_step),
      p_(parameters),
      plant(p_, seed, stream),
      interferometer(p_, seed, stream + 1, clk_hz),
      piezo(seed, stream),
      floor_(time_step(), seed, stream) {
    piezo.configure(p_);
}

void Stage::configure() {
    plant.configure();
    interferometer.configure();
    piezo.configure(p_);
}

double Stage::coupled(uint64_t now) const {
    if (coupling_ == 0) return 0;
    return coupling_ * std::exp(-double(now - bridge_edge_) / clk_hz() / p_.signal_coupling_time);
}

void Stage::drive_changed(uint64_t now, unsigned before, unsigned after) {
    spend(now - 1, before);  // cycle `now` itself is the first of the new state
    const unsigned falling = before & ~after;
    if (falling & ADC_CS_N)
        interferometer.chip_select(table(now), coupled(now));
    else if ((falling & ADC_SCLK) && !(after & ADC_CS_N))
        interferometer.next_bit();
    dac.drive_changed(before, after);
    constexpr unsigned BRIDGE = BRIDGE_A | BRIDGE_B;
    if (p_.signal_coupling != 0 && ((before ^ after) & BRIDGE)) {
        const bool rises = ~before & after & BRIDGE;
        coupling_ = (rises ? 1 : -1) * p_.signal_coupling;
        bridge_edge_ = now;
    }
}

void Stage::move(uint64_t now) {
    spend(now, drive());
    const double shaken = floor_.step(p_.floor_velocity);
    plant.drivetrain.external_force = pushed_ + piezo.reaction - p_.table_mass * shaken;
    const double before = plant.drivetrain.velocity;
    plant.step({spent_[0], spent_[1], spent_[2], spent_[3]}, time_step());
    spent_ = {};
    const double gained = plant.drivetrain.velocity - before;
    if (p_.piezo_fitted != 0) piezo.step(dac.share(), time_step(), shaken + gained / time_step());
}

uint64_t Stage::sense(uint64_t now) {
    const uint64_t spike = levels_at(now, table(now));
    const bool moves = std::fabs(velocity()) * time_step() > 1e-9;
    return moves ? std::min(spike, now + std::max<uint64_t>(1, step_clk() / LEVELS_PER_STEP))
                 : spike;
}

bool Stage::own_fault(const char* name, bool on) {
    if (!std::strcmp(name, "motor_jam")) return plant.drivetrain.jammed = on, true;
    if (!std::strcmp(name, "converter_stuck")) return interferometer.converter_stuck = on, true;
    if (!std::strcmp(name, "encoder_cut")) return interferometer.cut = on, true;
    return false;
}

void Stage::state(uint64_t now, double* out) const {
    const Drivetrain& mechanics = plant.drivetrain;
    for (const double value :
         {double(now) / clk_hz(), position(now), velocity(), mechanics.nut(), mechanics.speed,
          plant.current, plant.voltage, mechanics.force(), double(flag(LIMIT_LOW_OPEN)),
          double(flag(LIMIT_HIGH_OPEN)), double(flag(ENCODER_A)), double(flag(ENCODER_B)),
          double((drive() & DRIVE_ENABLE) != 0), double(interferometer.code_sin),
          double(interferometer.code_cos), piezo.position, double(dac.code),
          double(dac.bad_frames)})
        *out++ = value;
}

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
#include "machines/machine.h"

#include <algorithm>
#include <cstring>

namespace twin {

namespace {

enum Level { LOW, HIGH, GIVEN };
struct WireFault {
    const char* name;
    unsigned pins;
    Level level;
};
constexpr WireFault WIRE_FAULTS[] = {
    {"limit_low", LIMIT_LOW_OPEN, HIGH},
    {"limit_high", LIMIT_HIGH_OPEN, HIGH},
    {"drive_fault", DRIVE_FAULT, HIGH},
    {"a_stuck", ENCODER_A, GIVEN},
    {"b_stuck", ENCODER_B, GIVEN},
    {"z_stuck", ENCODER_Z, GIVEN},
    {"encoder_cut", ENCODER_A | ENCODER_B | ENCODER_Z, HIGH},  // receivers fail safe high
    {"sensor_cut", SENSOR_RX, HIGH},
};

bool among(const char* names, const char* name) {
    const size_t length = std::strlen(name);
    for (const char* at = names; (at = std::strstr(at, name)); at += length)
        if (length && (at == names || at[-1] == ' ') && (at[length] == 0 || at[length] == ' '))
            return true;
    return false;
}

}  // namespace

Machine::Machine(double clk_hz, double time_step)
    : clk_hz_(clk_hz),
      step_clk_(std::max<uint64_t>(1, uint64_t(std::llround(time_step * clk_hz)))),
      wire_faults_(std::size(WIRE_FAULTS)) {}

void Machine::advance(uint64_t now, unsigned drive) {
    if (drive != drive_) {
        const unsigned before = drive_;
        drive_ = drive;
        drive_changed(now, before, drive);
    }
    if (now < event_at_) return;
    if (now >= last_step_ + step_clk_) {
        move(now);
        last_step_ = now;
        if (trace_every_ && ++trace_count_ >= trace_every_) {
            trace_count_ = 0;
            rows.resize(rows.size() + size_t(state_count_));
            state(now, &rows[rows.size() - size_t(state_count_)]);
        }
    }
    event_at_ = std::min(sense(now), last_step_ + step_clk_);
}

bool Machine::set(const char* name, double value) {
    double* found = parameter(name);
    if (!found || !std::strcmp(name, "time_step"))
        return false;  // the time step is fixed at the start
    *found = value;
    configure();
    return true;
}

bool Machine::get(const char* name, double& value) {
    const double* found = parameter(name);
    if (found) value = *found;
    return found;
}

bool Machine::fault(const char* name, bool on, bool level) {
    if (!among(faults(), name)) return false;
    bool known = own_fault(name, on);
    for (size_t n = 0; n < std::size(WIRE_FAULTS); n++) {
        const WireFault& wire = WIRE_FAULTS[n];
        if (std::strcmp(wire.name, name)) continue;
        const bool high = wire.level == HIGH || (wire.level == GIVEN && level);
        wire_faults_[n] = {on ? wire.pins : 0, on && high ? wire.pins : 0};
        known = true;
    }
    forced_ = forced_high_ = 0;
    for (const auto& [pins, high] : wire_faults_) {
        forced_ |= pins;
        forced_high_ |= high;
    }
    event_at_ = 0;  // the node sees it in the next cycle
    return known;
}

void Machine::trace(uint64_t every_clk) {
    trace_every_ = every_clk ? std::max<uint64_t>(1, (every_clk + step_clk_ / 2) / step_clk_) : 0;
    trace_count_ = 0;
    const char* names = state_names();
    state_count_ = 1 + int(std::count(names, names + std::strlen(names), ' '));
    rows.clear();
}

}  // namespace twin

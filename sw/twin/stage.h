// SPDX-License-Identifier: Apache-2.0
// One axis of the machine as the node's pins see it: plant, interferometer and converters, advanced clk by clk.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "interferometer.h"
#include "plant.h"

namespace twin {

// one row of a trace; the order of twin.TRACE_COLUMNS
struct TraceRow {
    double time, position, velocity, nut, current, voltage;
};

class Stage {
public:
    Stage(const Parameters& parameters, uint64_t seed, uint64_t stream, double clk_hz)
        : plant(parameters, seed, stream), interferometer(parameters, seed, stream + 1, clk_hz), clk_hz_(clk_hz) {
        step_clk_ = std::max<uint64_t>(1, uint64_t(std::llround(parameters.time_step * clk_hz)));
        plant.p.time_step = double(step_clk_) / clk_hz;
    }

    // the pins of the node after clk `now`
    void step(uint64_t now, unsigned cs_n, unsigned sclk, unsigned bridge_a, unsigned bridge_b, unsigned drive_enable) {
        spent_[drive_enable * (bridge_a | bridge_b << 1)]++;
        const unsigned falling = (pins_ & ~(cs_n | sclk << 1));
        pins_ = cs_n | sclk << 1;
        if (falling) {
            if (falling & 1)
                interferometer.chip_select(position(now));
            else if (!cs_n)
                interferometer.next_bit();
        }
        if (now >= event_at_) event(now);
    }
    double position(uint64_t now) const { return plant.position + plant.velocity * (double(now - last_step_) / clk_hz_); }
    bool low_open() const { return plant.low_pressed || force_low; }
    bool high_open() const { return plant.high_pressed || force_high; }
    bool set(const char* name, double value);
    void trace(uint64_t every_clk) {
        trace_every_ = every_clk ? std::max<uint64_t>(1, (every_clk + step_clk_ / 2) / step_clk_) : 0;
        rows.clear();
        trace_count_ = 0;
    }

    Plant plant;
    Interferometer interferometer;
    bool force_low = false, force_high = false, drive_fault = false;   // faults to inject
    std::vector<TraceRow> rows;

private:
    static constexpr uint64_t LEVELS_PER_STEP = 4;            // while the table moves

    void event(uint64_t now) {
        if (now >= last_step_ + step_clk_) {
            plant.step({spent_[0], spent_[1], spent_[2], spent_[3]});
            spent_ = {};
            last_step_ = now;
            if (trace_every_ && ++trace_count_ >= trace_every_) {
                trace_count_ = 0;
                rows.push_back({double(now) / clk_hz_, plant.position, plant.velocity, plant.nut(), plant.current, plant.voltage});
            }
        }
        const uint64_t spike = interferometer.advance(now, position(now));
        const bool moves = std::fabs(plant.velocity) * plant.p.time_step > 1e-9;
        const uint64_t level = moves ? now + std::max<uint64_t>(1, step_clk_ / LEVELS_PER_STEP) : ~uint64_t(0);
        event_at_ = std::min({spike, level, last_step_ + step_clk_});
    }

    double clk_hz_;
    uint64_t step_clk_, last_step_ = 0, event_at_ = 0;
    std::array<uint32_t, 4> spent_{};                         // clk in: coast, forward, reverse, brake
    unsigned pins_ = 3;
    uint64_t trace_every_ = 0, trace_count_ = 0;
};

}  // namespace twin

// SPDX-License-Identifier: Apache-2.0
// counts_run -- move three scales in front of three Verilated axes, and compare their position
// registers with the pulses given.
//
//   counts_run PULSES SEED [too_fast]    until each axis has had so many; too_fast: the edges are
//                                        closer than the edge filter passes
//
// Each axis moves on its own: runs of random direction, length and speed, from the highest that its
// edge filter passes to a thousandth of it. At the end of each run its registers are read, while
// the other axes move. Now and then the origin moves, in motion, too, so that the next runs cross
// 0, a multiple of 2^16, +-2^31, +-2^32 or the +-2^33 counts where the register itself wraps.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "made/registers.h"
#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;

constexpr int AXES = 3, REST_CYCLES = 64, TICK_CYCLES = 15000, SAMPLE_CYCLES = 600;
constexpr unsigned NEEDED[AXES] = {1, 3, 5};  // equal samples for the edge filter; 1: every cycle
constexpr int64_t COUNT = 1 << 14, PERIOD = 1 << 16;  // of the position
constexpr int64_t POSITIONS = 1LL << 48, COUNTS = POSITIONS / COUNT;

int64_t wrapped(int64_t value, int64_t whole) {  // to -whole/2 .. whole/2 - 1
    value &= whole - 1;
    return value >= whole / 2 ? value - whole : value;
}

struct Scale {
    int64_t counts = 0;               // since reset
    int64_t origin = 0;               // periods by which the node's origin was moved
    int64_t direction = 1, left = 0;  // pulses of this run
    double spacing = 1, next = 0;     // cycles
    uint64_t pulses = 0, reversals = 0, checks = 0, wrong = 0, zero = 0, word = 0, long_word = 0,
             whole = 0, moved = 0;

    int64_t position() const { return counts + origin * (PERIOD / COUNT); }
    void step() {
        const int64_t border =
            position() + (direction > 0);  // the count whose lower edge is passed
        zero += (border & (COUNTS - 1)) == 0;
        word += (border & 0xFFFF) == 0;
        long_word += (border & 0x7FFFFFFF) == 0;
        whole += (border & (COUNTS - 1)) == COUNTS / 2;
        counts += direction, pulses++, left--;
    }
};

struct Bench {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vtop> pins = std::make_unique<Vtop>(context.get());
    Scale scales[AXES];
    uint64_t now = 0;

    void clk() {
        unsigned a = 0, b = 0;
        for (int n = 0; n < AXES; n++) {
            Scale& scale = scales[n];
            if (scale.left && double(now) >= scale.next) scale.step(), scale.next += scale.spacing;
            const unsigned quarter = unsigned(scale.counts) & 3;
            a |= ((quarter ^ quarter >> 1) & 1) << n, b |= (quarter >> 1) << n;
        }
        pins->a = a, pins->b = b;
        pins->tick = now % TICK_CYCLES == 0, pins->sample_tick = now % SAMPLE_CYCLES == 0;
        pins->clk = 1, pins->eval();
        pins->clk = 0, pins->eval();
        now++;
    }
    void access(int axis, bool feedback, unsigned address, bool write, uint32_t data = 0) {
        pins->select = feedback ? 0 : 1 << axis, pins->feedback_select = feedback ? 1 << axis : 0;
        pins->write = write, pins->word = address / 4, pins->wdata = data;
        clk();
        pins->select = pins->feedback_select = pins->write = 0;
    }
    uint32_t read(int axis, unsigned address) {
        access(axis, false, address, false);
        return pins->rdata;
    }
    void reset() {
        pins->rst = 1;
        for (int n = 0; n < 4; n++) clk();
        pins->rst = 0;
        for (int n = 0; n < AXES; n++) {
            access(n, true, FEEDBACK_POSITION_SOURCE, true, FEEDBACK_POSITION_SOURCE_COUNTS_MASK);
            access(n, false, AXIS_SENSING, true, NEEDED[n]);
            access(n, false, AXIS_ENCODER_EVENTS, true, AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_MASK);
        }
        for (int n = 0; n < 2 * SAMPLE_CYCLES; n++) clk();
    }
    void check(int axis) {
        Scale& scale = scales[axis];
        const uint64_t low = read(axis, AXIS_POSITION_LOW), high = read(axis, AXIS_POSITION_HIGH);
        const int64_t error =
            wrapped(int64_t(high << 32 | low) - scale.position() * COUNT, POSITIONS);
        const int32_t counted = int32_t(read(axis, AXIS_QUADRATURE_COUNT));
        const bool illegal =
            read(axis, AXIS_ENCODER_EVENTS) & AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_MASK;
        scale.checks++;
        if (error == 0 && counted == int32_t(scale.counts) && !illegal) return;
        scale.wrong += error ? uint64_t(std::llabs(error) + COUNT - 1) / COUNT : 1;
        scale.counts += error / COUNT;  // each wrong count is counted once
        access(axis, false, AXIS_ENCODER_EVENTS, true, AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_MASK);
    }
    void move_origin(int axis, Random& random) {  // near one border after the other
        const int64_t borders[] = {0,         random.below(COUNTS >> 16) << 16,
                                   1LL << 31, -(1LL << 31),
                                   1LL << 32, -(1LL << 32),
                                   COUNTS / 2};
        const int64_t near = borders[scales[axis].moved++ % 7] + random.below(201) - 100;
        const int32_t periods = int32_t(uint64_t(near - scales[axis].position()) >> 2);
        scales[axis].origin += periods;
        access(axis, false, AXIS_SHIFT_ORIGIN, true, uint32_t(periods));
    }
    void begin_run(int axis, Random& random, bool too_fast) {
        Scale& scale = scales[axis];
        const double fastest = (NEEDED[axis] + 1) / 2.0;
        const double slower = std::pow(random.one_in(2) ? 4 : 1000, random.share());
        const double cycles = random.one_in(500) ? 60000 : 30 * std::pow(100, random.share());
        const int64_t direction = random.one_in(2) ? 1 : -1;
        scale.spacing = too_fast ? fastest * 0.6 : fastest * slower;
        scale.left = std::fmax(1, cycles / scale.spacing);
        scale.reversals += direction != scale.direction;
        scale.direction = direction;
        scale.next = double(now);
    }
};

}  // namespace

int main(int count, char** words) {
    if (count < 3) return 2;
    const uint64_t pulses = std::strtoull(words[1], nullptr, 10);
    const bool too_fast = count > 3 && !std::strcmp(words[3], "too_fast");
    Random random{std::strtoull(words[2], nullptr, 10) * 0x9E3779B97F4A7C15ULL + 1};
    Bench bench;
    uint64_t resting[AXES] = {};  // until then; 0: not at rest
    int at_work = AXES;
    bench.reset();
    for (int n = 0; n < AXES; n++) bench.begin_run(n, random, too_fast);
    while (at_work) {
        bench.clk();
        at_work = 0;
        for (int n = 0; n < AXES; n++) {
            Scale& scale = bench.scales[n];
            if (scale.left) {
                if (random.one_in(100000)) bench.move_origin(n, random);
            } else if (!resting[n]) {
                resting[n] = bench.now + REST_CYCLES;
            } else if (bench.now >= resting[n] && scale.pulses < pulses) {
                resting[n] = 0;
                bench.check(n);
                if (random.one_in(20)) bench.move_origin(n, random);
                bench.begin_run(n, random, too_fast);
            }
            at_work += scale.left || bench.now < resting[n];
        }
    }
    for (int n = 0; n < AXES; n++) bench.check(n);
    for (const Scale& scale : bench.scales)
        std::printf(
            "%llu pulses %llu wrong %llu checks %llu reversals %llu zero %llu word %llu long_word "
            "%llu whole\n",
            (unsigned long long)scale.pulses, (unsigned long long)scale.wrong,
            (unsigned long long)scale.checks, (unsigned long long)scale.reversals,
            (unsigned long long)scale.zero, (unsigned long long)scale.word,
            (unsigned long long)scale.long_word, (unsigned long long)scale.whole);
    std::printf("%llu clk\n", (unsigned long long)bench.now);
    return 0;
}

// SPDX-License-Identifier: Apache-2.0
// steps_run -- drive the Verilated steps_bench and judge its pins from outside, by a driver that
// knows only its data sheet and the targets.
//
//   steps_run reversals COUNT SEED    random lines with reversals, random timings and polarity,
//                                     switched off and on at random
//   steps_run rate SEED               one random speed, up to a step every 2 cycles, for 4 million
//                                     cycles
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <algorithm>
#include <cmath>
#include <memory>

#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;

constexpr int64_t ONE = 1 << 16;

struct Driver {  // what a stepper driver sees on its two pins
    int64_t count = 0, now = 0, rose = -1'000'000, fell = -1'000'000, turned = -1'000'000;
    uint64_t violations = 0, turns = 0;
    bool pulse = false, up = false, edge = false;
    void judge(bool step, bool direction, const Vtop& set) {
        now++, edge = false;
        if (direction != up) {
            if (pulse || step) violations++;  // within a pulse
            violations += now - fell < std::max<int64_t>(set.hold_cycles, 1);
            up = direction, turned = now, turns++;
        }
        if (step == pulse) return;
        pulse = step, edge = step;
        if (step) {
            violations += now - fell < std::max<int64_t>(set.low_cycles, 1);
            violations += now - turned < std::max<int64_t>(set.setup_cycles, 1);
            rose = now, count += up ? 1 : -1;
        } else {
            violations += now - rose < std::max<int64_t>(set.high_cycles, 1);
            fell = now;
        }
    }
};

struct Bench {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vtop> pins = std::make_unique<Vtop>(context.get());
    Driver driver;
    void clk() {
        pins->clk = 1, pins->eval();
        pins->clk = 0, pins->eval();
        driver.judge(pins->step ^ pins->step_low, pins->direction ^ pins->direction_low, *pins);
    }
    void reset() {
        pins->rst = 1;
        for (int n = 0; n < 4; n++) clk();
        pins->rst = 0;
    }
    // A tick with this target, and what follows until the next one; the line to it begins then.
    template <class Each>
    void line(int64_t position, unsigned period, Each each) {
        target(position), pins->tick = 1;
        for (unsigned k = 0; k < period; k++) clk(), pins->tick = 0, each();
    }
    void line(int64_t position, unsigned period) {
        line(position, period, [] {});
    }
    void target(int64_t position) { pins->target = uint64_t(position) & 0xFFFFFFFFFFFFULL; }
    void settings(Random& random, unsigned longest, unsigned period) {
        pins->enable = 0;
        for (int n = 0; n < 600; n++) clk();  // until it is at rest
        pins->high_cycles = random.below(longest + 1), pins->low_cycles = random.below(longest + 1);
        pins->setup_cycles = random.below(longest + 1),
        pins->hold_cycles = random.below(longest + 1);
        pins->period = period, pins->step_low = random.below(2),
        pins->direction_low = random.below(2);
        for (int n = 0; n < 600; n++) {
            pins->clk = 1, pins->eval();
            pins->clk = 0, pins->eval();
        }
        const int64_t count = driver.count;  // a new polarity is not a step
        const uint64_t turns = driver.turns, violations = driver.violations;
        driver = Driver{};
        driver.count = count, driver.turns = turns, driver.violations = violations;
        driver.up = pins->direction ^ pins->direction_low;
    }
};

int64_t whole(int64_t position) { return position >> 16; }

int reversals(uint64_t required, uint64_t seed) {
    Random random{seed * 0x9E3779B97F4A7C15ULL + 1};
    Bench bench;
    auto& pins = *bench.pins;
    bench.reset();
    int64_t position = 0, lost = 0, clks = 0;
    uint64_t overruns = 0, lines = 0, offs = 0;
    while (bench.driver.turns < required) {
        const unsigned period = 60 + random.below(300), longest = random.one_in(2) ? 6 : 40;
        bench.target(position);
        bench.settings(random, longest, period);
        const int64_t per_step =
            std::max<int64_t>(pins.high_cycles, 1) + std::max<int64_t>(pins.low_cycles, 1);
        const int64_t fastest = std::min<int64_t>(ONE * period / per_step, 200 * ONE);  // per line
        pins.enable = 1;
        bench.line(position, period);  // the lines begin here
        const int64_t origin = whole(position) - int32_t(pins.steps);
        for (int stretch = 0; stretch < 400; stretch++) {
            const int64_t speed =
                (random.one_in(3) ? random.below(3 * ONE) : random.below(fastest)) *
                (random.one_in(2) ? 1 : -1);
            const int length = 1 + random.below(2);
            for (int n = 0; n < length; n++) {
                position += speed, lines++;
                bench.line(position, period, [&] {
                    clks++, lost += int32_t(pins.steps) != int32_t(bench.driver.count);
                });
            }
            overruns += pins.overrun;
        }
        bench.line(position, 4000);
        lost += int32_t(pins.steps) != whole(position) - origin;  // the target must be reached
        position += random.below(std::min<int64_t>(100 * ONE, fastest));
        bench.line(position, period), bench.line(position, random.below(period));  // off in motion
        pins.enable = 0, pins.tick = 0, offs++;
        for (int n = 0; n < 200; n++)
            bench.clk(), lost += int32_t(pins.steps) != int32_t(bench.driver.count);
    }
    std::printf(
        "%llu reversals %lld lost %llu violations %llu overruns %llu lines %llu offs %lld clk\n",
        (unsigned long long)bench.driver.turns, (long long)lost,
        (unsigned long long)bench.driver.violations, (unsigned long long)overruns,
        (unsigned long long)lines, (unsigned long long)offs, (long long)clks);
    return 0;
}

int rate(uint64_t seed) {
    Random random{seed * 0x9E3779B97F4A7C15ULL + 1};
    Bench bench;
    auto& pins = *bench.pins;
    bench.reset();
    const int64_t period = 1000 + random.below(60000);
    int64_t start = random.below(ONE * 1000);
    const int64_t top = ONE * period / 2;
    const int64_t span = std::max<int64_t>(top >> random.below(12), 2 * ONE);
    const int64_t speed =
        seed % 8 == 1 ? top : 1 + span - random.below(span / 2 + 1);  // 2^-16 step per line
    const int64_t slope = std::min(speed, top);
    bench.target(start), bench.settings(random, 0, unsigned(period)), pins.enable = 1;
    bench.line(start, unsigned(period)), start += 2 * ONE;
    // set to up; at the highest rate it cannot catch up after a reversal
    bench.line(start, unsigned(period)), bench.line(start, unsigned(period) + 20);
    const int64_t origin = whole(start) - bench.driver.count;
    int64_t position = start, clks = 0, edges = 0, first = 0, last = 0;
    double jitter = 0;
    while (clks < 4'000'000 + period) {
        position += slope;
        bench.line(position, unsigned(period), [&] {
            clks++;
            if (!bench.driver.edge || clks < 3 * period) return;
            if (!edges) first = clks;
            last = clks, edges++;
            // the step to `passed` is on the line in this cycle, counted from the second tick;
            // tick, line and pin take 2 cycles
            const int64_t passed = origin + bench.driver.count;
            const double ideal = double((__int128(passed * ONE - start) * period)) / double(slope);
            jitter = std::max(jitter, std::fabs(double(clks - 2 - period) - ideal));
        });
    }
    const double required = double(slope) / double(ONE) / double(period),
                 measured = double(edges - 1) / double(last - first);
    std::printf("%.6f ppm %.6f jitter %.9f rate %lld edges\n",
                std::fabs(measured / required - 1) * 1e6, jitter, required, (long long)edges);
    return 0;
}

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count == 4 && !std::strcmp(words[1], "reversals"))
        return reversals(std::strtoull(words[2], nullptr, 10),
                         std::strtoull(words[3], nullptr, 10));
    if (count == 3 && !std::strcmp(words[1], "rate"))
        return rate(std::strtoull(words[2], nullptr, 10));
    return std::fprintf(stderr, "usage: steps_run reversals COUNT SEED | rate SEED\n"), 2;
}

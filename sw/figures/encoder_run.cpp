// SPDX-License-Identifier: Apache-2.0
// encoder_run -- drive the Verilated incremental_encoder with the worst encoder whose counts are
// still known, and compare every cycle.
//
//   encoder_run EDGES SEED
//
// A position moves by single quarters, with random pauses and reversals. An edge is final once its
// wire has been stable for REQUIRED cycles; all else on a wire are pulses shorter than that:
// glitches in the pauses, jitter before and after edges. So the count of every cycle is known: the
// final edges that are LATENCY cycles old.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;

constexpr unsigned REQUIRED = 4, LATENCY = REQUIRED + 1, HISTORY = 8, PER_REVOLUTION = 1000;
static_assert(LATENCY < HISTORY);

struct Wire {
    bool level;             // of the final edges
    unsigned stable = 100;  // cycles since the last final edge
    unsigned pulse = 0;     // cycles left of a pulse on top
    unsigned quiet = 100;   // cycles since the last pulse
    bool ready() const { return stable >= REQUIRED && pulse == 0 && quiet > 0; }
};

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: encoder_run EDGES SEED\n"), 2;
    const uint64_t count_of_edges = std::strtoull(words[1], nullptr, 10);
    Random random{std::strtoull(words[2], nullptr, 10) * 0x9E3779B97F4A7C15ULL + 1};
    auto context = std::make_unique<VerilatedContext>();
    auto pins = std::make_unique<Vtop>(context.get());
    pins->filter_required = REQUIRED, pins->filter_skip = 0, pins->filter_tolerated = 0,
    pins->mode = 0, pins->own = 0;
    pins->index_up = pins->index_down = pins->index_each = 1,
    pins->index_low = pins->index_clears = 0;
    pins->counts_per_revolution = PER_REVOLUTION, pins->illegal_enable = 1;

    Wire a{false}, b{false}, z{false};
    int32_t position = 1, history[HISTORY] = {};  // of the last cycles; the index is at 0
    for (auto& old : history) old = position;
    a.level = true;
    unsigned slot = 0, pause = 0;
    int direction = 1;
    uint64_t edges = 0, wrong = 0, glitches = 0, reversals = 0, clks = 0, entries = 0, found = 0;
    auto tick = [&] {
        pins->now = uint32_t(clks++);
        pins->clk = 1, pins->eval();
        pins->clk = 0, pins->eval();
    };
    auto show = [&] {
        pins->a = a.level ^ (a.pulse > 0), pins->b = b.level ^ (b.pulse > 0),
        pins->z = z.level ^ (z.pulse > 0);
    };
    show();
    pins->rst = 1;
    for (int clk = 0; clk < 4; clk++) tick();
    pins->rst = 0;
    for (int clk = 0; clk < 40; clk++) tick();

    const int32_t origin = position;
    for (uint64_t tail = 0; tail < 40; edges >= count_of_edges ? tail++ : tail) {
        for (Wire* wire : {&a, &b, &z}) {
            wire->stable++;
            if (wire->pulse && --wire->pulse == 0)
                wire->quiet = 0;
            else if (!wire->pulse)
                wire->quiet++;
        }
        if (pause) {
            pause--;
        } else if (edges < count_of_edges) {
            // quarters 00 10 11 01: going up, a changes from 0 and from 2
            Wire& wire = ((position & 1) == (direction > 0)) ? b : a;
            const int32_t next = position + direction;
            const bool index = next % int32_t(PER_REVOLUTION) == 0;
            if (wire.ready() && (index == z.level || z.ready())) {
                wire.level = !wire.level, wire.stable = 0;
                if (index != z.level) z.level = index, z.stable = 0, entries += index;
                position = next, edges++;
                if (random.one_in(6))
                    direction = -direction, reversals++;  // often back over the last edge
                pause = random.one_in(4) ? random.bits32() % 24 : random.bits32() % 3;
            }
        }
        for (Wire* wire : {&a, &b, &z})
            if (wire->ready() && wire->stable > REQUIRED && random.one_in(8))
                wire->pulse = 1 + random.bits32() % (REQUIRED - 1), glitches++;
        show();
        history[slot++ % HISTORY] = position;
        tick();
        const int32_t expected = history[(slot - 1 - LATENCY) % HISTORY] - origin;
        wrong += int32_t(pins->count) != expected;
        if (pins->index_found)
            found++, wrong += (int32_t(pins->index_count) + origin) % int32_t(PER_REVOLUTION) != 0;
    }
    wrong += pins->illegal_seen + pins->illegal_fault + pins->revolution_fault + (found != entries);
    std::printf("%llu edges %llu wrong %llu glitches %llu reversals %llu indexes %llu clk\n",
                (unsigned long long)edges, (unsigned long long)wrong, (unsigned long long)glitches,
                (unsigned long long)reversals, (unsigned long long)found, (unsigned long long)clks);
    return 0;
}

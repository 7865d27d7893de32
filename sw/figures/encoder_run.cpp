// SPDX-License-Identifier: Apache-2.0
// encoder_run -- drive the Verilated incremental_encoder with a hostile but countable encoder, and
// hold every clk against it.
//
// A place moves by single quarters, with random pauses and reversals. An edge is final once its
// line has stood for `needed` clk; whatever else happens on a line is a pulse shorter than that:
// glitches in the pauses, jitter before and after edges. So the count of every clk is known: the
// final edges that are needed + 2 clk old.
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

struct Line {
    bool level;            // of the final edges
    unsigned stood = 100;  // clk since the last final edge
    unsigned pulse = 0;    // clk left of a pulse on top
    unsigned quiet = 100;  // clk since the last pulse
    bool ready() const { return stood >= REQUIRED && pulse == 0 && quiet > 0; }
};

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: encoder_run EDGES SEED\n"), 2;
    const uint64_t wanted = std::strtoull(words[1], nullptr, 10);
    Random random{std::strtoull(words[2], nullptr, 10) * 0x9E3779B97F4A7C15ULL + 1};
    auto context = std::make_unique<VerilatedContext>();
    auto pins = std::make_unique<Vtop>(context.get());
    pins->filter_required = REQUIRED, pins->filter_skip = 0, pins->filter_tolerated = 0,
    pins->mode = 0, pins->own = 0;
    pins->index_up = pins->index_down = pins->index_each = 1,
    pins->index_low = pins->index_clears = 0;
    pins->counts_per_revolution = PER_REVOLUTION, pins->illegal_enable = 1;

    Line a{false}, b{false}, z{false};
    int32_t place = 1,
            history[HISTORY] = {};  // place of the last clk: the index, at 0, is not under it
    for (auto& old : history) old = place;
    a.level = true;
    unsigned slot = 0, pause = 0;
    int way = 1;
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

    const int32_t origin = place;
    for (uint64_t tail = 0; tail < 40; edges >= wanted ? tail++ : tail) {
        for (Line* line : {&a, &b, &z}) {
            line->stood++;
            if (line->pulse && --line->pulse == 0)
                line->quiet = 0;
            else if (!line->pulse)
                line->quiet++;
        }
        if (pause) {
            pause--;
        } else if (edges < wanted) {
            Line& line = ((place & 1) == (way > 0))
                             ? b
                             : a;  // quarters 00 10 11 01: a moves out of 0 and 2 going up
            const int32_t next = place + way;
            const bool mark = next % int32_t(PER_REVOLUTION) == 0;
            if (line.ready() && (mark == z.level || z.ready())) {
                line.level = !line.level, line.stood = 0;
                if (mark != z.level) z.level = mark, z.stood = 0, entries += mark;
                place = next, edges++;
                if (random.one_in(6)) way = -way, reversals++;  // often over the edge just made
                pause = random.one_in(4) ? random.bits32() % 24 : random.bits32() % 3;
            }
        }
        for (Line* line : {&a, &b, &z})
            if (line->ready() && line->stood > REQUIRED && random.one_in(8))
                line->pulse = 1 + random.bits32() % (REQUIRED - 1), glitches++;
        show();
        history[slot++ % HISTORY] = place;
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

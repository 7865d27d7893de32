// SPDX-License-Identifier: Apache-2.0
// profile_run -- play random moves, planned by the firmware's planner, on the Verilated engine, and
// compare every step with the limits.
//
//   profile_run MOVES SEED
//
// A move has an S-curve, trapezoid or stepped profile. By chance it gets up to three new targets in
// flight, is slowed down by feed overrides and pauses, or is ended by a controlled stop. From its
// first change on an override may add the quarter of acceleration and jerk that
// planner_feed_override grants. A refusal counts as a miss, too.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>

#include "figures/common.h"
#include "Vplayer.h"
extern "C" {
#include "planner/plan.h"
#include "planner/planner.h"
}
#include "verilated.h"

namespace {

using moire::Random;

constexpr int64_t ROUNDING = 8;  // 2^-40 period: what rounding adds to the third difference

double spread(Random& random, double low, double high) {  // evenly in their logarithm
    return low * std::pow(high / low, random.share());
}

struct Bench {
    VerilatedContext context;
    Vplayer pins{&context};
    uint64_t underruns = 0;

    void clk() {
        pins.clk = 1, pins.eval();
        underruns += pins.underrun;
        pins.clk = 0, pins.eval();
    }
    __int128 exact() const {
        unsigned __int128 value = pins.exact[2] & 0xFF;
        value = value << 32 | pins.exact[1];
        value = value << 32 | pins.exact[0];
        return __int128(value << 56) >> 56;
    }
    void tick() {
        pins.tick = 1, clk();
        pins.tick = 0;
        do clk();
        while (pins.busy);
        clk();  // the last result is shown
    }
    void reset() {
        pins.rst = 1, clk(), clk(), pins.rst = 0;
        while (!pins.ready) clk();
    }
    // The numbers of the words are those of tables/microcode/numbers.py.
    void setting(unsigned word, uint64_t value) {
        pins.setting_write = 1, pins.setting_word = word, pins.setting = value, clk();
        pins.setting_write = 0;
        while (pins.setting_waits) clk();
    }
    void request(uint8_t& strobe) {
        strobe = 1, clk(), strobe = 0;
        while (pins.pending) clk();
    }
    void fraction(uint32_t value) { setting(OVERRIDE, uint64_t(value) << 16); }
};

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: profile_run MOVES SEED\n"), 2;
    const uint64_t moves_required = std::strtoull(words[1], nullptr, 10),
                   seed = std::strtoull(words[2], nullptr, 10);
    Random random{seed * 0x9E3779B97F4A7C15ULL + 1};
    auto bench = std::make_unique<Bench>();
    auto& pins = bench->pins;
    bench->reset();

    uint64_t moves = 0, misses = 0, ticks = 0, retargets = 0, refused = 0, overridden = 0,
             stops = 0, landed_wrong = 0, above = 0;
    while (moves < moves_required) {
        const unsigned kind = random() % 8;  // 0 stepped, 1 trapezoid, else S-curve
        const bool slowed = kind > 0 && random.one_in(4), is_stopped = random.one_in(5);
        const auto velocity = uint32_t(spread(random, 10, 50000)),
                   acceleration = uint32_t(spread(random, 1000, 1e7));
        const auto jerk = uint32_t(spread(random, 1e5, 1e9));
        struct planner_limits limits = planner_limits(velocity, acceleration, jerk);
        struct planner_limits planned = limits;
        uint32_t ramp = 0, curve = 0;
        if (kind == 1) planned.jerk = PLANNER_ANY_JERK;
        if (slowed) planner_feed_override(&planned, &ramp, &curve);
        int64_t distance = int64_t(spread(random, 1, 1 << 26)) * (random.one_in(2) ? 1 : -1);
        struct plan plan;
        planner_stepped_profile stepped{};
        if (kind == 0) {
            stepped.first = random.one_in(8) ? limits.velocity : limits.velocity / 16 + 1,
            stepped.top = limits.velocity, stepped.ticks = 1 + random() % 40;
            for (auto& rise : stepped.rise) rise = limits.velocity / (8 + random() % 40) + 1;
            planner_stepped_borders(&stepped, 10923, random.one_in(2) ? 32768 : 21846);
            if (!planner_stepped_move(&plan, &stepped, distance)) {
                refused++, misses++;
                continue;
            }
        } else if (!planner_move(&plan, &planned, distance)) {
            refused++, misses++;
            continue;
        }
        if (plan.ticks > 4000) continue;
        moves++;

        bench->setting(OVERRIDE_SLOPE, ramp), bench->setting(OVERRIDE_CURVE, curve);
        bench->fraction(65536);
        const auto deceleration =
            uint32_t(std::fmin(double(limits.acceleration >> 8), 4294967295.0));
        bench->setting(STOP_DECELERATION,  // a stepped profile stops in a step
                       kind == 0 ? 0 : uint64_t(deceleration) << 8);
        bench->setting(STOP_JERK, kind == 1 ? 0 : limits.jerk);
        const __int128 begin = bench->exact();
        const uint64_t underruns = bench->underruns;
        __int128 before = begin, step = 0, slope = 0,
                 late = 0;  // late: a stop acts one tick after the strobe
        unsigned stop_at = is_stopped ? 1 + random() % (plan.ticks + 1) : 0,
                 retargets_left = kind > 0 && !slowed ? random() % 4 : 0;
        unsigned retarget_at = 1 + random() % (plan.ticks + 1), queued = 0, played = 0,
                 override_left = slowed ? 3 : 0;
        bool missed = false, started = false, end_queued = false, stopped = false, bad = false,
             over = false, changed = false;
        int64_t goal = distance;
        const char* why = "";
        for (unsigned idle = 0; idle < 400000; idle++) {
            while (!stopped && !end_queued && pins.queue_free && queued < played + 64) {
                if (retargets_left && queued >= retarget_at) {
                    int64_t other = random.one_in(2) ? goal + int64_t(spread(random, 1, 1 << 20)) *
                                                                  (random.one_in(2) ? 1 : -1)
                                                     : int64_t(spread(random, 1, 1 << 26)) *
                                                           (random.one_in(2) ? 1 : -1);
                    retargets_left--, retarget_at += 1 + random() % 200;
                    struct plan made;
                    if (planner_retarget(&made, &plan, 0, &planned, other, nullptr)) {
                        if (made.ticks <= 20000) plan = made, goal = other, retargets++;
                    } else
                        refused++, missed = true;
                }
                planner_segment piece;
                bool last;
                if (!planner_take_up_to(&plan, &piece, &last, 32)) break;
                bench->setting(SEGMENT_VELOCITY, uint64_t(piece.velocity)),
                    bench->setting(SEGMENT_ACCELERATION, uint64_t(piece.acceleration)),
                    bench->setting(SEGMENT_JERK, uint64_t(int64_t(piece.jerk))),
                    bench->setting(SEGMENT_TICKS, piece.ticks | uint32_t(last) << 24);
                bench->request(pins.push);
                queued += piece.ticks, end_queued = last;
            }
            if (!started) started = true, bench->request(pins.start);
            if (!pins.moving) break;
            if (override_left && random.one_in(100))
                bench->fraction(random.one_in(4) ? 0 : random() % 65537), override_left--,
                    overridden++, changed = true;
            else if (slowed && random.one_in(200))
                bench->fraction(65536);
            if (stop_at && played == stop_at && !stopped) {
                stopped = true, stops++, late = slope < 0 ? -slope : slope;
                bench->request(pins.controlled_stop);
            }
            bench->tick(), played++, ticks++;
            __int128 now = bench->exact(), step_now = now - before, slope_now = step_now - step,
                     bend = slope_now - slope;
            const __int128 roundoff =
                pins.moving ? ROUNDING : ROUNDING + (1 << 24);  // the end is rounded
            auto size = [](__int128 x) { return x < 0 ? -x : x; };
            const bool steps = kind == 0;  // these have a limit of velocity only
            if (size(step_now) > __int128(limits.velocity) + roundoff + late)
                over = true, why = "velocity";
            auto granted = [&](uint64_t limit) {
                return __int128(limit) + (changed ? limit / 4 : 0) + roundoff;
            };
            if (!steps && size(slope_now) > granted(limits.acceleration))
                over = true, why = "acceleration";
            if (!steps && kind != 1 && size(bend) > granted(limits.jerk)) over = true, why = "jerk";
            if (over && !bad) {
                bad = true, above++;
                if (above <= 5)
                    std::fprintf(stderr,
                                 "seed %llu move %llu: %s at tick %u kind %u slowed %d stopped %d: "
                                 "%g %g %g of %g %g %g\n",
                                 (unsigned long long)seed, (unsigned long long)moves, why, played,
                                 kind, slowed, stopped, double(step_now), double(slope_now),
                                 double(bend), double(limits.velocity), double(limits.acceleration),
                                 double(limits.jerk));
            }
            before = now, step = step_now, slope = slope_now;
        }
        missed = missed || pins.moving || bench->underruns != underruns ||
                 (!stopped && bench->exact() != begin + (__int128(goal) << 24));
        if (missed) {
            landed_wrong++;
            if (landed_wrong <= 5)
                std::fprintf(stderr,
                             "seed %llu move %llu landed wrong: kind %u slowed %d stopped %d "
                             "moving %d underruns %llu\n",
                             (unsigned long long)seed, (unsigned long long)moves, kind, slowed,
                             stopped, pins.moving,
                             (unsigned long long)(bench->underruns - underruns));
            bench->reset();
        }
        misses += missed || bad;
    }
    const std::pair<const char*, uint64_t> totals[] = {
        {"misses", misses},      {"moves", moves},
        {"ticks", ticks},        {"retargets", retargets},
        {"refused", refused},    {"overrides", overridden},
        {"stops", stops},        {"landed_wrong", landed_wrong},
        {"above_a_limit", above}};
    for (const auto& [name, total] : totals)
        std::printf("%llu %s ", (unsigned long long)total, name);
    std::printf("\n");
    return 0;
}

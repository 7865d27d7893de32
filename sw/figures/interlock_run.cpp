// SPDX-License-Identifier: Apache-2.0
// interlock_run -- inject faults into the Verilated axis in random cycles, and judge its
// drive_enable, its registers and its pins from outside.
//
//   interlock_run COUNT SEED    so many faults; prints how many of each cause, and what failed
//
// The axis has a scale that counts (a and b), and a machine that moves wherever the target is until
// something is wrong with it. Each fault has a window of cycles in which it may switch the drive
// off: from its first sign on a pin, until the latest that its cause allows. What the interlock
// reports must agree: the drive off within one servo tick of the cause, the cause that came first,
// the position at that time.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <vector>

#include "made/registers.h"
#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;

constexpr int64_t COUNT = 1 << 14;                // position, in 2^-16 period
constexpr int LIMIT_CYCLES = 4'000'000 / 10'000;  // limit switches must be stable for 0.1 ms,
constexpr int LIMIT_TICK = LIMIT_CYCLES / 8;      // less one period of limit_tick at most
constexpr int SENSED = 24;  // cycles from a and b to position, at most; 3 at least
constexpr int HISTORY = 1 << 15;
constexpr int SERVED = 570;  // cycles from a tick until the engine has served it
constexpr unsigned AXIS = 0x400, FEEDBACK = 0xC00, ACTUATOR = 0x1400;  // the blocks
constexpr int64_t NEVER = INT64_MAX / 2;

enum Cause {  // the bits of axis.faults
    LIMIT_LOW = AXIS_FAULTS_LIMIT_LOW_SHIFT,
    LIMIT_HIGH = AXIS_FAULTS_LIMIT_HIGH_SHIFT,
    ESTOP = AXIS_FAULTS_ESTOP_SHIFT,
    FOLLOWING = AXIS_FAULTS_FOLLOWING_ERROR_SHIFT,
    ENCODER = AXIS_FAULTS_ENCODER_SHIFT,
    WATCHDOG = AXIS_FAULTS_BUS_WATCHDOG_SHIFT,
    DRIVE = AXIS_FAULTS_DRIVE_SHIFT,
    CPU = AXIS_FAULTS_CPU_SHIFT,
    UNDERRUN = AXIS_FAULTS_PROFILE_UNDERRUN_SHIFT,
    OVERRUN = AXIS_FAULTS_STEP_OVERRUN_SHIFT,
    SERVO = AXIS_FAULTS_SERVO_OVERRUN_SHIFT,
    SAMPLE = AXIS_FAULTS_SAMPLE_OVERRUN_SHIFT,
    LINK = AXIS_FAULTS_LINK_WATCHDOG_SHIFT,
    CAUSES
};
static_assert(LIMIT_LOW == 0 && LIMIT_HIGH == 1 && ESTOP == 2 && FOLLOWING == 3 && ENCODER == 4 &&
                  WATCHDOG == 5 && DRIVE == 6 && CPU == 7 && UNDERRUN == 8 && OVERRUN == 9 &&
                  SERVO == 10 && SAMPLE == 11 && LINK == 12,
              "NAMES has the order of axis.faults");
const char* const NAMES[CAUSES] = {
    "limit_low",     "limit_high",     "estop",        "following_error",  "encoder",
    "bus_watchdog",  "drive",          "cpu",          "profile_underrun", "step_overrun",
    "servo_overrun", "sample_overrun", "link_watchdog"};
constexpr Cause LEVELS[] = {LIMIT_LOW, LIMIT_HIGH, ESTOP, WATCHDOG, DRIVE, CPU, LINK};
constexpr unsigned LATCH_ALWAYS = 1 << ESTOP | 1 << DRIVE | 1 << CPU;

struct Window {  // cycles in which a cause may switch the drive off
    int64_t first = NEVER, last = NEVER;
};

struct Bench {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vtop> pins = std::make_unique<Vtop>(context.get());
    int64_t now = 0, tick_at = 0, ticks = 0;
    int period = 1000, sample_period = 40, count_cycles = 10;
    // the machine: count is what a and b have shown, skew is a jump of both at once
    int64_t count = 0, wanted = 0, moved_at = 0;
    int skew = 0;
    bool follows = true, jammed = false;  // moves to the target; cannot move
    std::vector<int64_t> counts = std::vector<int64_t>(HISTORY);
    // what was seen
    int64_t target = 0, target_before = 0;  // of the last two ticks that were served, 2^-16 period
    int64_t early_at = NEVER;               // a tick too soon
    int64_t sine_position = NEVER;          // of sine and cosine, which stand still, while in use
    int64_t steps = 0, off_at = NEVER, on_clk = 0;
    bool was_on = false, step_was = false;

    void clk() {
        pins->tick = now - tick_at >= period || now == early_at;
        if (pins->tick) tick_at = now, ticks++;
        pins->sample_tick = now % sample_period == 0;
        pins->limit_tick = now % LIMIT_TICK == 0;
        if (!jammed && count != wanted && now - moved_at >= count_cycles)
            count += wanted > count ? 1 : -1, moved_at = now;
        const int gray = int(count + skew) & 3;
        pins->encoder_a = gray == 1 || gray == 2, pins->encoder_b = gray >= 2;
        pins->now = uint32_t(now);
        pins->clk = 1, pins->eval();
        pins->clk = 0, pins->eval();
        counts[size_t(++now % HISTORY)] = count;
        if (pins->step && !step_was) steps += pins->direction ? 1 : -1;
        step_was = pins->step;
        if (was_on && !pins->drive_enable) off_at = now;
        was_on = pins->drive_enable, on_clk += was_on;
    }
    int64_t count_at(int64_t when) const { return counts[size_t(when % HISTORY)]; }

    void access(bool write, unsigned address, uint32_t data) {
        pins->write = write, pins->address = uint16_t(address), pins->wdata = data;
        do clk();
        while (!pins->ready);
        pins->select = 1;
        clk();
        pins->select = 0;
    }
    void put(unsigned word, uint32_t data) { access(true, AXIS + word, data), clk(); }
    void put_actuator(unsigned word, uint32_t data) { access(true, ACTUATOR + word, data), clk(); }
    void put_wide(unsigned word, int64_t data) {
        put(word, uint32_t(data)), put(word + 4, uint32_t(data >> 32));
    }
    uint32_t get(unsigned word) { return access(false, AXIS + word, 0), pins->rdata; }
    int64_t get_position(unsigned word) {
        const uint64_t low = get(word), high = get(word + 4);
        return int64_t((high << 32 | low) << 16) >> 16;
    }
    int64_t target_now() const { return int64_t(uint64_t(pins->target) << 16) >> 16; }
    // One cycle; and when a tick was served the machine is sent to its target.
    void step() {
        clk();
        if (now - tick_at == SERVED) {
            target_before = target, target = target_now();
            if (follows) wanted = (target + COUNT / 2) >> 14;
        }
    }
    void run(int64_t clks) {
        for (const int64_t end = now + clks; now < end;) step();
    }
    void run_ticks(int n) {
        for (const int64_t end = ticks + n; ticks < end;) step();
    }
    void pin(Cause cause, bool on) {
        switch (cause) {
        case LIMIT_LOW: pins->limit_low_open = on; break;
        case LIMIT_HIGH: pins->limit_high_open = on; break;
        case ESTOP: pins->estop = on; break;
        case WATCHDOG: pins->watchdog_expired = on; break;
        case LINK: pins->link_expired = on; break;
        case DRIVE: pins->drive_fault_n = !on; break;
        case CPU: pins->cpu_stopped = on; break;
        default: break;
        }
    }
    // When a level may switch the drive off that is pressed in this cycle.
    Window window(Cause cause) const {
        switch (cause) {
        case LIMIT_LOW:
        case LIMIT_HIGH: return {now + LIMIT_CYCLES - LIMIT_TICK, now + LIMIT_CYCLES + 6};
        case DRIVE: return {now + 2, now + 6};
        default: return {now + 1, now + 1};
        }
    }
};

struct Campaign {
    Random random;
    std::unique_ptr<Bench> bench;
    std::map<Cause, uint64_t> injected;
    uint64_t faults = 0, harmless = 0, failures = 0;
    int64_t ratio = 0, clk_before = 0;  // ratio: steps per period
    Cause cause = ESTOP;                // of this fault
    bool good = true;                   // so far

    void fail(const char* what) {
        if (good)
            std::fprintf(stderr, "%s, cycle %lld of its axis: %s\n", NAMES[cause],
                         (long long)bench->now, what);
        good = false;
    }

    void begin() {  // a new axis, with other settings
        if (bench) clk_before += bench->now;
        bench = std::make_unique<Bench>();
        Bench& b = *bench;
        b.pins->drive_fault_n = 1, b.pins->rst = 1;
        b.period = int(random.from(600, 1600)), b.sample_period = int(random.from(20, 90)),
        b.count_cycles = int(random.from(6, 14));
        b.pins->tick_period = uint32_t(b.period);
        for (int n = 0; n < 8; n++) b.clk();
        b.pins->rst = 0;
        for (int n = 0; n < 20; n++) b.clk();
        b.put(AXIS_SENSING, FIELD_PUT(AXIS_SENSING_DEGLITCH, 2));
        b.put(AXIS_ENCODER_FAULT_MASK, 31), b.put(AXIS_DISAGREEMENT_LIMIT, 0);
        b.access(true, FEEDBACK + FEEDBACK_POSITION_SOURCE, FEEDBACK_POSITION_SOURCE_COUNTS_MASK);
        b.put(AXIS_KP, 1600), b.put(AXIS_KI, uint32_t(random.below(30000)));
        b.put(AXIS_OUTPUT_LIMIT, 30000), b.put(AXIS_INTEGRAL_LIMIT, 20000);
        b.put_actuator(ACTUATOR_PWM_PERIOD, 200), b.put_actuator(ACTUATOR_DAC, 2 | 500 << 8);
        b.put_actuator(ACTUATOR_STEP_PULSE, FIELD_PUT(ACTUATOR_STEP_PULSE_HIGH, 20) |
                                                FIELD_PUT(ACTUATOR_STEP_PULSE_LOW, 20));
        b.put_actuator(ACTUATOR_STEP_DIRECTION, FIELD_PUT(ACTUATOR_STEP_DIRECTION_SETUP, 20) |
                                                    FIELD_PUT(ACTUATOR_STEP_DIRECTION_HOLD, 20));
    }

    // A segment at a constant speed, in counts per tick.
    void push(int64_t speed_counts, int64_t ticks, bool last) {
        Bench& b = *bench;
        b.put_wide(AXIS_SEGMENT_VELOCITY_LOW, speed_counts << 38),
            b.put_wide(AXIS_SEGMENT_ACCELERATION_LOW, 0), b.put(AXIS_SEGMENT_JERK, 0);
        b.put(AXIS_SEGMENT_TICKS, uint32_t(ticks) | (last ? AXIS_SEGMENT_TICKS_LAST_MASK : 0));
    }
    void control(bool on, bool homing = false) {
        const uint32_t enable = on ? AXIS_CONTROL_ENABLE_MASK | AXIS_CONTROL_CLOSED_LOOP_MASK : 0;
        bench->put(AXIS_CONTROL, enable | (homing ? AXIS_CONTROL_HOMING_MASK : 0));
    }

    void kind_of_drive(unsigned kind) {
        bench->put_actuator(ACTUATOR_DRIVE, kind);
        ratio = random.from(400, 8000) * (random.one_in(2) ? 1 : -1);  // steps per period
        if (kind != 1) ratio = 0;
        const int64_t word = ratio * (int64_t(1) << 32);
        bench->put_actuator(ACTUATOR_STEP_RATIO_LOW, uint32_t(word)),
            bench->put_actuator(ACTUATOR_STEP_RATIO_HIGH, uint32_t(word >> 32));
    }

    // At rest with the drive off, no fault latched, the machine without a fault.
    void calm() {
        Bench& b = *bench;
        for (Cause cause : LEVELS) b.pin(cause, false);
        b.jammed = false, b.follows = true;
        control(false);
        b.put(AXIS_STROBES, AXIS_STROBES_SET_TARGET_TO_POSITION_MASK);
        b.wanted = b.count;
        b.run(LIMIT_CYCLES + 40);
        b.put(AXIS_STROBES,
              AXIS_STROBES_SET_TARGET_TO_POSITION_MASK | AXIS_STROBES_RESET_FAULTS_MASK);
        b.run_ticks(2);
        b.wanted = b.count;
    }

    bool person_resets() {
        Bench& b = *bench;
        calm();
        b.run(random.below(300));
        return b.get(AXIS_FAULTS) == 0 && b.get(AXIS_FIRST_FAULT) == 0 && !b.pins->drive_enable;
    }

    // The drive on, at rest or in motion at `speed` counts per tick for `ticks`.
    void switch_on(int64_t speed, int64_t ticks) {
        Bench& b = *bench;
        control(true);
        b.run_ticks(3);
        if (!speed) return;
        push(speed, ticks, true), b.put(AXIS_STROBES, AXIS_STROBES_START_MASK);
    }

    // Register writes of firmware that has gone wrong: whatever it does, but for a reset with
    // enable low, every fault stays and the drive stays off.
    void nonsense(Cause persistent) {
        Bench& b = *bench;
        const uint32_t before = b.get(AXIS_FAULTS), first = b.get(AXIS_FIRST_FAULT);
        const int64_t position = b.get_position(AXIS_FAULT_POSITION_LOW), on = b.on_clk;
        const bool level =
            std::find(std::begin(LEVELS), std::end(LEVELS), persistent) != std::end(LEVELS);
        bool enable = true;
        for (int n = 0; n < 24; n++) {
            if (random.one_in(2)) {
                enable = random.one_in(2);
                // not homing: there a switch is no cause
                const uint32_t others = ~AXIS_CONTROL_ENABLE_MASK & ~AXIS_CONTROL_HOMING_MASK;
                b.put(AXIS_CONTROL, (uint32_t(random.below(64)) & others) |
                                        (enable ? AXIS_CONTROL_ENABLE_MASK : 0));
            }
            // while its cause persists a level cannot be reset
            const bool resets = (level || enable) && random.one_in(2);
            b.put(AXIS_STROBES, (uint32_t(random.below(16)) << 1) | resets);
            if (random.one_in(4)) push(random.from(-4, 4), random.from(1, 9), random.one_in(2));
            if (random.one_in(4)) b.run(random.below(200));
        }
        if (b.on_clk != on) fail("drive on with a fault latched");
        const uint32_t after = b.get(AXIS_FAULTS);
        if (!(after >> persistent & 1))
            fail("fault reset without a person, or while its cause persists");
        if (!level && (before & ~after)) fail("fault reset without a person");
        if (b.get(AXIS_FIRST_FAULT) != first) fail("first cause changed");
        if (b.get_position(AXIS_FAULT_POSITION_LOW) != position) fail("latched position changed");
    }

    // The drive was on at `since`. Judges what the interlock reports of these causes.
    void judge(const std::map<Cause, Window>& causes, int64_t since) {
        Bench& b = *bench;
        int64_t first = NEVER, last = NEVER;
        for (auto& [cause, window] : causes)
            first = std::min(first, window.first), last = std::min(last, window.last);
        if (b.off_at == NEVER || b.off_at < since) return fail("drive not off");
        if (b.off_at < first) return fail("drive off before the cause");
        if (b.off_at > last) return fail("drive off late");
        unsigned may = 0;
        bool known = false;  // of several in the same cycle the lowest bit comes first
        for (auto& [cause, window] : causes) {
            const bool exact = window.first == window.last;
            if (window.first <= last && !(exact && known)) may |= 1 << cause, known |= exact;
        }
        const uint32_t reported = b.get(AXIS_FIRST_FAULT);
        if (!(reported & may) || (reported & (reported - 1))) fail("wrong first cause");
        if ((b.get(AXIS_FAULTS) & reported) != reported) fail("first cause not among the faults");
        const int64_t position = b.get_position(AXIS_FAULT_POSITION_LOW);
        bool there = false;
        for (int64_t t = b.off_at - SENSED; t <= b.off_at - 3; t++)
            there |=
                position == (b.sine_position == NEVER ? b.count_at(t) * COUNT : b.sine_position);
        if (!there) fail("wrong latched position");
    }

    // The pins of bridge and step driver must be off, too.
    void pins_rest() {
        Bench& b = *bench;
        b.run(2 * 40 + 40);  // the last step, and its times
        const int64_t steps = b.steps;
        for (int n = 0; n < 200; n++) {
            b.step();
            if (b.pins->bridge_a || b.pins->bridge_b)
                return fail("bridge driven with the drive off");
        }
        if (b.steps != steps) fail("steps with the drive off");
    }

    // One level, pressed while the drive is on; another one may follow.
    void level(Cause cause) {
        Bench& b = *bench;
        const bool moves = random.one_in(2);
        switch_on(moves ? random.from(-9, 9) : 0, 40);
        b.run(random.below(3 * b.period));
        std::map<Cause, Window> causes;
        const int64_t since = b.now, end = b.now + LIMIT_CYCLES + 2 * b.period;
        if (!b.pins->drive_enable) return fail("drive off without a cause");
        const Cause other = LEVELS[random.below(std::size(LEVELS))];
        const int64_t later = b.now + (random.one_in(3) ? 0 : random.below(b.period));
        const bool two = random.one_in(2) && other != cause;
        b.off_at = NEVER;
        causes[cause] = b.window(cause), b.pin(cause, true);
        while (b.now < end) {
            if (two && b.now == later) causes[other] = b.window(other), b.pin(other, true);
            b.clk();
        }
        judge(causes, since);
        pins_rest();
        nonsense(cause);
        if (two) b.pin(other, false);
        b.pin(cause, false);
        b.run(LIMIT_CYCLES + 20);
        control(true);
        b.run_ticks(1);
        if (b.pins->drive_enable || !(b.get(AXIS_FAULTS) >> cause & 1))
            fail("the fault was reset when its cause ended");
    }

    // A level that is there before the drive is enabled.
    void before_enable(Cause cause) {
        Bench& b = *bench;
        b.run(random.below(b.period));
        b.pin(cause, true);
        b.run(LIMIT_CYCLES + 20);
        const bool latched = b.get(AXIS_FAULTS) >> cause & 1;
        if (latched != bool(LATCH_ALWAYS >> cause & 1)) fail("latched wrongly with the drive off");
        const int64_t on = b.on_clk;
        control(true);
        b.run(random.from(10, 2 * b.period));
        if (b.on_clk != on) fail("drive on while the cause is there");
        if (!(b.get(AXIS_FAULTS) >> cause & 1) || b.get(AXIS_FIRST_FAULT) != 1u << cause)
            fail("wrong first cause");
        nonsense(cause);
        b.pin(cause, false);
        b.run(LIMIT_CYCLES + 20);
        if (b.on_clk != on) fail("the fault was reset when its cause ended");
    }

    // The machine is pushed away, or held while the target moves on.
    void following() {
        Bench& b = *bench;
        const bool moves = random.one_in(2);
        const int64_t limit = COUNT * random.from(moves ? 30 : 2, 60) - COUNT / 2;
        b.put(AXIS_FOLLOWING_LIMIT, uint32_t(limit));
        const int64_t speed = random.from(3, 12) * (random.one_in(2) ? 1 : -1);
        switch_on(moves ? speed : 0, 4000);
        b.run(random.below(3 * b.period) + b.period);
        const int64_t since = b.now, end = b.now + 60 * b.period;
        if (!b.pins->drive_enable) return fail("drive off without a cause");
        b.off_at = NEVER, b.follows = false;
        if (moves)
            b.jammed = true;
        else
            b.wanted = b.count + random.from(100, 300) * (random.one_in(2) ? 1 : -1);
        Window window;
        while (b.now < end && b.off_at == NEVER) {
            b.step();
            const int64_t target = b.target_now();
            if (std::abs(target - b.count * COUNT) > limit)
                window.first = std::min(window.first, b.now - SENSED);
            // the target of this tick is known when it is served; the position that the tick
            // measured is one of these two or between them
            const bool sure = std::abs(target - b.count_at(b.tick_at - SENSED) * COUNT) > limit &&
                              std::abs(target - b.count_at(b.tick_at + 8) * COUNT) > limit;
            if (b.now - b.tick_at == SERVED && sure && window.last == NEVER)
                window.last = b.tick_at + b.period;
        }
        judge({{FOLLOWING, window}}, since);
        pins_rest();
        nonsense(FOLLOWING);
        b.put(AXIS_FOLLOWING_LIMIT, 0);
    }

    // Both levels at once: the count can no longer be trusted.
    void encoder() {
        Bench& b = *bench;
        switch_on(random.one_in(2) ? random.from(-9, 9) : 0, 40);
        b.run(random.below(3 * b.period));
        while (b.now - b.moved_at < b.count_cycles / 2) b.step();  // between two edges
        const int64_t since = b.now;
        if (!b.pins->drive_enable) return fail("drive off without a cause");
        b.off_at = NEVER, b.moved_at = b.now, b.skew += 2;
        const Window window{b.now + 3, b.now + SENSED};
        b.run(2 * b.period);
        judge({{ENCODER, window}}, since);
        pins_rest();
        nonsense(ENCODER);
    }

    void underrun() {
        Bench& b = *bench;
        const int64_t ticks = random.from(1, 9);
        control(true);
        b.run_ticks(3);
        b.run(random.below(b.period));
        if (b.now - b.tick_at > b.period - 30)
            b.run(40);  // so that the segment is there before the next tick
        push(random.from(-9, 9), ticks, false), b.put(AXIS_STROBES, AXIS_STROBES_START_MASK);
        const int64_t since = b.now, begun = b.ticks;
        b.off_at = NEVER;
        Window window;
        while (b.ticks < begun + ticks + 5) {
            b.step();
            if (window.first == NEVER && b.ticks == begun + ticks)
                window.first = b.tick_at;  // its last tick
            if (window.last == NEVER && b.ticks == begun + ticks + 1)
                window.last = b.tick_at + b.period;  // one without a segment
        }
        judge({{UNDERRUN, window}}, since);
        pins_rest();
        nonsense(UNDERRUN);
    }

    // More steps than the wire can carry: the generator may be most_steps behind.
    void overrun() {
        Bench& b = *bench;
        kind_of_drive(1);
        switch_on(0, 0);
        b.run_ticks(2);
        const int64_t most_behind = b.pins->most_steps, origin = b.steps, position = b.target;
        const auto behind = [&](int64_t target) {
            return std::abs((((target - position) * ratio) >> 16) - (b.steps - origin));
        };
        push(random.from(8, 14) * (random.one_in(2) ? 1 : -1), 4000, true),
            b.put(AXIS_STROBES, AXIS_STROBES_START_MASK);
        const int64_t since = b.now, end = b.now + 400 * b.period;
        b.off_at = NEVER;
        Window window;
        while (b.now < end && b.off_at == NEVER) {
            b.step();
            if (window.first == NEVER &&
                std::max(behind(b.target), behind(b.target_before)) > most_behind - 3)
                window.first = b.now - b.period;
            // the line to the target of a tick begins at the next one and ends at the one after
            if (window.last == NEVER && b.now - b.tick_at == 62 &&
                behind(b.target_before) > most_behind + 3)
                window.last = b.tick_at + b.period;
        }
        judge({{OVERRUN, window}}, since);
        pins_rest();
        nonsense(OVERRUN);
        control(false);
        kind_of_drive(0);
    }

    // A tick while the engine serves the one before.
    void servo() {
        Bench& b = *bench;
        switch_on(random.one_in(2) ? random.from(-9, 9) : 0, 40);
        b.run(random.below(3 * b.period));
        const int64_t since = b.now;
        if (!b.pins->drive_enable) return fail("drive off without a cause");
        b.off_at = NEVER;
        b.run_ticks(1);
        b.early_at = b.now + random.from(1, 100);
        const Window window{b.early_at + 2, b.early_at + 3};
        b.run(3 * b.period);
        judge({{SERVO, window}}, since);
        pins_rest();
        nonsense(SERVO);
    }

    // The other converter of the chain sends a sample in every cycle, until one of the axis is
    // lost.
    void sample() {
        Bench& b = *bench;
        b.put(AXIS_ENCODER_FAULT_MASK, AXIS_ENCODER_EVENTS_OVERSPEED_MASK);
        b.access(true, FEEDBACK + FEEDBACK_POSITION_SOURCE, 0);
        calm();
        b.sine_position = b.get_position(AXIS_POSITION_LOW);
        switch_on(0, 0);
        b.run(random.below(3 * b.period));
        const int64_t since = b.now;
        if (!b.pins->drive_enable) return fail("drive off without a cause");
        b.off_at = NEVER, b.pins->other_sample = 1;
        for (int came = b.pins->sample_valid; came < 2; came += b.pins->sample_valid) b.step();
        const Window window{b.now + 2, b.now + 2};
        b.run(random.below(2 * b.period));
        b.pins->other_sample = 0;
        b.run(2 * b.period);
        judge({{SAMPLE, window}}, since);
        if (!(b.get(AXIS_ENCODER_EVENTS) & AXIS_ENCODER_EVENTS_OVERSPEED_MASK))
            fail("the axis that lost the sample reports no event");
        pins_rest();
        nonsense(SAMPLE);
    }

    // These are no faults: a glitch of a switch, and a switch while homing.
    void no_fault() {
        Bench& b = *bench;
        const Cause cause = random.one_in(2) ? LIMIT_LOW : LIMIT_HIGH;
        const bool homing = random.one_in(2);
        control(true, homing);
        b.run_ticks(3);
        const int64_t on = b.on_clk, begin = b.now;
        b.pin(cause, true);
        b.run(homing ? 2 * b.period : random.from(1, LIMIT_CYCLES - LIMIT_TICK - 1));
        b.pin(cause, false);
        b.run(LIMIT_CYCLES + 40);
        if (b.on_clk - on != b.now - begin || b.get(AXIS_FAULTS)) fail("fault without a cause");
    }

    void one() {
        good = true;
        cause = Cause(random.below(CAUSES));
        const bool is_level =
            std::find(std::begin(LEVELS), std::end(LEVELS), cause) != std::end(LEVELS);
        kind_of_drive(unsigned(random.below(3)) & 2);
        if (is_level && random.one_in(5))
            before_enable(cause);
        else if (is_level)
            level(cause);
        else if (cause == FOLLOWING)
            following();
        else if (cause == ENCODER)
            encoder();
        else if (cause == UNDERRUN)
            underrun();
        else if (cause == OVERRUN)
            overrun();
        else if (cause == SERVO)
            servo();
        else
            sample();
        faults++, injected[cause]++;
        if (!person_resets()) fail("a person cannot reset it");
        if (random.one_in(10)) harmless++, no_fault(), calm();
        if (cause == SAMPLE) begin(), calm();  // counts again
        failures += !good;
    }

    int run(uint64_t count) {
        while (faults < count) {
            if (faults % 40 == 0) begin(), calm();
            one();
        }
        std::printf("%llu faults %llu failures %llu harmless %lld clk", (unsigned long long)faults,
                    (unsigned long long)failures, (unsigned long long)harmless,
                    (long long)(clk_before + bench->now));
        for (auto& [cause, times] : injected)
            std::printf(" %llu %s", (unsigned long long)times, NAMES[cause]);
        std::printf("\n");
        return 0;
    }
};

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: interlock_run COUNT SEED\n"), 2;
    Campaign campaign{Random{std::strtoull(words[2], nullptr, 10) * 0x9E3779B97F4A7C15ULL + 1}};
    return campaign.run(std::strtoull(words[1], nullptr, 10));
}

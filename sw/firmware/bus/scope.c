// SPDX-License-Identifier: Apache-2.0
// scope -- records position, error and command of one axis, from before a trigger on.
#include "bus/scope.h"

#include "axis/axis.h"
#include "core/hardware.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "planner/planner.h"

#define SAMPLES 128u        // a power of two
#define LONGEST_EVERY 200u  // ticks: 50 ms, so that a time fits into 16 bits up to 80 MHz
#define HOLDS 16u           // open loop: a command lasts 1 to 16 samples, then its negative as long

struct setting {
    uint8_t axis;
    uint8_t trigger;    // bus_scope_trigger
    uint8_t before;     // samples from before the trigger
    uint16_t every;     // ticks from sample to sample, at least
    uint32_t level;     // of the error, or with an amplitude the largest movement; 2^-16 period
    int16_t amplitude;  // of the open loop; 0: closed loop
};

struct sample {        // as on the bus
    int32_t position;  // low word
    int32_t error;
    int16_t command;
    uint16_t time;
};

static struct scope {
    struct setting setting;
    struct sample samples[SAMPLES];
    uint32_t every, due, last;  // cycles
    uint32_t random;
    int32_t from;  // position when it was armed
    uint8_t state;
    uint8_t next, taken, left;  // index of the next sample, samples taken, samples missing
    uint8_t before;
    uint8_t hold, holds;  // samples left with this command, and all of them
    bool mirrored;
} scope;

void scope_start(unsigned axes) {
    (void)axes;
    scope.state = BUS_SCOPE_STATE_EMPTY;
}

static void end(void) {
    scope.state = BUS_SCOPE_STATE_FULL;
    if (scope.setting.amplitude) axis_excite(scope.setting.axis, false);
}

static uint8_t arm(const struct setting* setting) {
    bool right = setting->trigger <= BUS_SCOPE_TRIGGER_FAULT && setting->before < SAMPLES &&
                 setting->every >= 1 && setting->every <= LONGEST_EVERY &&
                 setting->amplitude >= 0 &&
                 (setting->amplitude == 0 ||
                  (setting->trigger == BUS_SCOPE_TRIGGER_NOW && setting->before == 0));
    if (!right) return BUS_CAUSE_OUT_OF_RANGE;
    if (scope.state == BUS_SCOPE_STATE_RECORDING && scope.setting.amplitude) return BUS_CAUSE_BUSY;
    uint8_t cause = setting->amplitude ? axis_excite(setting->axis, true) : BUS_CAUSE_OK;
    if (cause != BUS_CAUSE_OK) return cause;
    scope.setting = *setting;
    scope.every = setting->every * (node_read(NODE_CLK_HZ) / PLANNER_TICK_HZ);
    scope.due = scope.last = node_read(NODE_TIME_STAMP_LOW);
    scope.from = (int32_t)axis_read(setting->axis, AXIS_POSITION);
    scope.random = 1;
    scope.next = scope.taken = scope.before = scope.hold = 0;
    scope.mirrored = true;
    scope.left = SAMPLES;
    scope.state = BUS_SCOPE_STATE_WAITING;
    return BUS_CAUSE_OK;
}

static bool triggered(unsigned n, int32_t error) {
    uint8_t state = axis_state(n);
    switch (scope.setting.trigger) {
    case BUS_SCOPE_TRIGGER_MOTION: return state == BUS_STATE_MOVING || state == BUS_STATE_HOMING;
    case BUS_SCOPE_TRIGGER_SETTLING: return state == BUS_STATE_SETTLING;
    case BUS_SCOPE_TRIGGER_ERROR:
        return (error < 0 ? 0u - (uint32_t)error : (uint32_t)error) >= scope.setting.level;
    case BUS_SCOPE_TRIGGER_FAULT: return state == BUS_STATE_FAULTED;
    default: return true;
    }
}

static void take(unsigned n) {
    struct sample* s = &scope.samples[scope.next];
    uint32_t now = node_read(NODE_TIME_STAMP_LOW);
    s->position = (int32_t)axis_read(n, AXIS_POSITION);
    s->error = (int32_t)axis_read(n, AXIS_FOLLOWING_ERROR);
    s->command = (int16_t)axis_read(n, AXIS_COMMAND);
    s->time = (uint16_t)((now - scope.last) / SCOPE_CYCLES);
    scope.last += s->time * SCOPE_CYCLES;
    scope.next = (scope.next + 1u) % SAMPLES;
    if (scope.taken < SAMPLES) scope.taken++;
    if (scope.state == BUS_SCOPE_STATE_RECORDING) {
        scope.left--;
    } else if (triggered(n, s->error)) {
        scope.before = scope.taken - 1u < scope.setting.before ? (uint8_t)(scope.taken - 1u)
                                                               : scope.setting.before;
        scope.taken = (uint8_t)(scope.before + 1u);
        scope.left = (uint8_t)(SAMPLES - scope.taken);
        scope.state = BUS_SCOPE_STATE_RECORDING;
    }
}

// Commands of random duration, each followed by its negative, so that the axis returns.
static void excite(unsigned n) {
    if (scope.hold == 0) {
        scope.mirrored = !scope.mirrored;
        if (!scope.mirrored) {
            scope.random ^= scope.random << 13;
            scope.random ^= scope.random >> 17;
            scope.random ^= scope.random << 5;
            scope.holds = (uint8_t)(1u + scope.random % HOLDS);
        }
        scope.hold = scope.holds;
    }
    scope.hold--;
    bool up = (scope.random >> 16 & 1u) != scope.mirrored;
    axis_write(n, AXIS_OPEN_COMMAND,
               (uint32_t)(up ? scope.setting.amplitude : -scope.setting.amplitude));
}

bool scope_idle(void) {
    return scope.state != BUS_SCOPE_STATE_WAITING && scope.state != BUS_SCOPE_STATE_RECORDING;
}

void scope_work(void) {
    unsigned n = scope.setting.axis;
    if (scope_idle()) return;
    uint32_t now = node_read(NODE_TIME_STAMP_LOW);
    if ((int32_t)(now - scope.due) < 0) return;
    scope.due += scope.every;
    if ((int32_t)(now - scope.due) >= 0)
        scope.due = now + scope.every;  // samples that were missed are left out
    take(n);
    if (scope.setting.amplitude) {
        uint32_t moved = (uint32_t)scope.samples[(scope.next + SAMPLES - 1u) % SAMPLES].position -
                         (uint32_t)scope.from;
        if ((int32_t)moved < 0) moved = 0u - moved;
        if (axis_state(n) != BUS_STATE_EXCITED || moved > scope.setting.level)
            scope.left = 0;
        else
            excite(n);
    }
    if (scope.left == 0) end();
}

// Byte n of the samples from `first` on, where 0 is the oldest; 0 after the last sample.
static uint8_t byte_of(uint32_t first, uint32_t n) {
    uint32_t number = first + n / sizeof(struct sample);
    const struct sample* sample =
        &scope.samples[(scope.next + SAMPLES - scope.taken + number) % SAMPLES];
    return number < scope.taken ? ((const uint8_t*)sample)[n % sizeof *sample] : 0;
}

static uint8_t read_samples(uint8_t first) {
    if (scope.state != BUS_SCOPE_STATE_FULL || first >= scope.taken) return BUS_CAUSE_OUT_OF_RANGE;
    for (uint32_t n = 0; n < BUS_READ_SCOPE_REPLY_LENGTH - BUS_READ_SCOPE_REPLY_POSITION_0; n++)
        bus_reply_field(BUS_READ_SCOPE_REPLY_POSITION_0 + n, byte_of(first, n), 1);
    return BUS_CAUSE_OK;
}

static uint8_t report(void) {
    bus_reply_field(BUS_SCOPE_REPLY_STATE, scope.state, 1);
    bus_reply_field(BUS_SCOPE_REPLY_COUNT, scope.state == BUS_SCOPE_STATE_FULL ? scope.taken : 0,
                    1);
    bus_reply_field(BUS_SCOPE_REPLY_BEFORE, scope.before, 1);
    return BUS_CAUSE_OK;
}

uint8_t scope_operation(uint8_t operation) {
    switch (operation) {
    case BUS_OPERATION_SCOPE: return report();
    case BUS_OPERATION_READ_SCOPE:
        return read_samples((uint8_t)bus_request_field(BUS_READ_SCOPE_REQUEST_FIRST, 1));
    case BUS_OPERATION_ARM_SCOPE:
        return arm(&(struct setting){
            .axis = (uint8_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_AXIS, 1),
            .trigger = (uint8_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_TRIGGER, 1),
            .before = (uint8_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_BEFORE, 1),
            .every = (uint16_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_EVERY, 2),
            .level = (uint32_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_LEVEL, 4),
            .amplitude = (int16_t)bus_request_field(BUS_ARM_SCOPE_REQUEST_AMPLITUDE, 2)});
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

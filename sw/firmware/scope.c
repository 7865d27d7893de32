// SPDX-License-Identifier: Apache-2.0
// scope -- records position, error and command of one axis, from before a trigger on.
#include "scope.h"

#include "axis.h"
#include "hardware.h"
#include "line_protocol.h"
#include "planner.h"

#define SAMPLES 128u                    // a power of two
#define LONGEST_EVERY 200u              // ticks: 50 ms, so that a time fits its 16 bits up to a clk of 80 MHz
#define HOLDS 16u                       // of the open loop: a command stays for 1 to so many samples, then its mirror as long

static struct scope {
    struct scope_setting setting;
    struct scope_sample samples[SAMPLES];
    uint32_t every, due, last;              // clk
    uint32_t random;
    int32_t from;                           // position when it was armed
    uint8_t state;
    uint8_t next, taken, left;              // place of the next sample, samples there, samples still wanted
    uint8_t before;
    uint8_t hold, holds;                    // samples still to go with this command, and its length
    bool mirrored;
} scope;

void scope_start(void)
{
    scope.state = LINE_SCOPE_STATE_EMPTY;
}

uint8_t scope_state(void)
{
    return scope.state;
}

uint8_t scope_count(void)
{
    return scope.state == LINE_SCOPE_STATE_FULL ? scope.taken : 0;
}

uint8_t scope_before(void)
{
    return scope.before;
}

uint8_t scope_byte(uint8_t first, uint32_t n)
{
    uint32_t number = first + n / sizeof(struct scope_sample);
    const struct scope_sample *sample = &scope.samples[(scope.next + SAMPLES - scope.taken + number) % SAMPLES];
    return number < scope.taken ? ((const uint8_t *)sample)[n % sizeof *sample] : 0;
}

static void end(void)
{
    scope.state = LINE_SCOPE_STATE_FULL;
    if (scope.setting.amplitude) axis_excite(scope.setting.axis, false);
}

uint8_t scope_arm(const struct scope_setting *setting)
{
    bool right = setting->trigger <= LINE_SCOPE_TRIGGER_FAULT && setting->before < SAMPLES && setting->every >= 1 &&
                 setting->every <= LONGEST_EVERY && setting->amplitude >= 0 &&
                 (setting->amplitude == 0 || (setting->trigger == LINE_SCOPE_TRIGGER_NOW && setting->before == 0));
    if (!right) return LINE_CAUSE_OUT_OF_RANGE;
    if (scope.state == LINE_SCOPE_STATE_RECORDING && scope.setting.amplitude) return LINE_CAUSE_BUSY;
    uint8_t cause = setting->amplitude ? axis_excite(setting->axis, true) : LINE_CAUSE_OK;
    if (cause != LINE_CAUSE_OK) return cause;
    scope.setting = *setting;
    scope.every = setting->every * (node_read(NODE_CLK_HZ) / PLANNER_TICK_HZ);
    scope.due = scope.last = node_read(NODE_TIME_STAMP_LOW);
    scope.from = (int32_t)axis_read(setting->axis, AXIS_POSITION);
    scope.random = 1;
    scope.next = scope.taken = scope.before = scope.hold = 0;
    scope.mirrored = true;
    scope.left = SAMPLES;
    scope.state = LINE_SCOPE_STATE_WAITING;
    return LINE_CAUSE_OK;
}

static bool triggered(unsigned n, int32_t error)
{
    uint8_t state = axis_state(n);
    switch (scope.setting.trigger) {
    case LINE_SCOPE_TRIGGER_MOTION: return state == LINE_STATE_MOVING || state == LINE_STATE_HOMING;
    case LINE_SCOPE_TRIGGER_SETTLING: return state == LINE_STATE_SETTLING;
    case LINE_SCOPE_TRIGGER_ERROR: return (error < 0 ? 0u - (uint32_t)error : (uint32_t)error) >= scope.setting.level;
    case LINE_SCOPE_TRIGGER_FAULT: return state == LINE_STATE_FAULTED;
    default: return true;
    }
}

static void take(unsigned n)
{
    struct scope_sample *s = &scope.samples[scope.next];
    uint32_t now = node_read(NODE_TIME_STAMP_LOW);
    s->position = (int32_t)axis_read(n, AXIS_POSITION);
    s->error = (int32_t)axis_read(n, AXIS_FOLLOWING_ERROR);
    s->command = (int16_t)axis_read(n, AXIS_COMMAND);
    s->time = (uint16_t)((now - scope.last) / SCOPE_CLK);
    scope.last += s->time * SCOPE_CLK;
    scope.next = (scope.next + 1u) % SAMPLES;
    if (scope.taken < SAMPLES) scope.taken++;
    if (scope.state == LINE_SCOPE_STATE_RECORDING) {
        scope.left--;
    } else if (triggered(n, s->error)) {
        scope.before = scope.taken - 1u < scope.setting.before ? (uint8_t)(scope.taken - 1u) : scope.setting.before;
        scope.taken = (uint8_t)(scope.before + 1u);
        scope.left = (uint8_t)(SAMPLES - scope.taken);
        scope.state = LINE_SCOPE_STATE_RECORDING;
    }
}

// Steps of random length, each followed by its mirror, so that the axis comes back.
static void excite(unsigned n)
{
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
    axis_write(n, AXIS_OPEN_COMMAND, (uint32_t)(up ? scope.setting.amplitude : -scope.setting.amplitude));
}

void scope_poll(void)
{
    unsigned n = scope.setting.axis;
    if (scope.state != LINE_SCOPE_STATE_WAITING && scope.state != LINE_SCOPE_STATE_RECORDING) return;
    uint32_t now = node_read(NODE_TIME_STAMP_LOW);
    if ((int32_t)(now - scope.due) < 0) return;
    scope.due += scope.every;
    if ((int32_t)(now - scope.due) >= 0) scope.due = now + scope.every;     // too late for one: they are not made up for
    take(n);
    if (scope.setting.amplitude) {
        uint32_t gone = (uint32_t)scope.samples[(scope.next + SAMPLES - 1u) % SAMPLES].position - (uint32_t)scope.from;
        if ((int32_t)gone < 0) gone = 0u - gone;
        if (axis_state(n) != LINE_STATE_EXCITED || gone > scope.setting.level)
            scope.left = 0;
        else
            excite(n);
    }
    if (scope.left == 0) end();
}

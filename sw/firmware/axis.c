// SPDX-License-Identifier: Apache-2.0
// axis -- what an axis is doing.
//
// The switches: while homing, and from `enable` or `reset_faults` on a pressed switch until it is released (leaving), a
// switch only blocks the way into it. At any other time it is a fault.
#include "axis.h"

#include "clock.h"
#include "hardware.h"
#include "line_protocol.h"
#include "parameters.h"
#include "planner.h"

#define STAND_MS 4u             // an axis that was caught by its switch stands when in this time
#define STAND_DISTANCE 8192     // it moved less than an eighth of a period
#define LONGEST_SEARCH (1LL << 46)

enum home_step { APPROACH, CATCH, CREEP, RELEASE, DEPART, FIRST_SETTLE, ZERO, SECOND_SETTLE };

static struct axis {
    struct plan plan;
    uint8_t state;              // line_state
    uint8_t ended;              // line_cause
    uint8_t step;               // home_step while state is homing
    bool homed;
    bool homing;                // a switch only blocks, until this motion has ended
    bool leaving;               // a switch only blocks, until it is released
    bool inside;                // the error has been inside the window since inside_ms
    uint32_t since_ms;          // start of this step, or of settling
    uint32_t inside_ms;
    uint32_t mark_ms;
    int64_t mark;               // position then
    int64_t place;              // where the zero is to be, before it is rounded to a phase zero
    int32_t home_phase;
} axes[HARDWARE_AXES];

static bool at_work(const struct axis *a)
{
    return a->ended == LINE_CAUSE_RUNNING;
}

static bool pressed(uint32_t state)
{
    return state & (AXIS_STATE_LIMIT_LOW_MASK | AXIS_STATE_LIMIT_HIGH_MASK);
}

static bool home_pressed(unsigned n, uint32_t state)
{
    return state & (parameters_get(n, LINE_PARAMETER_HOME_END) ? AXIS_STATE_LIMIT_HIGH_MASK : AXIS_STATE_LIMIT_LOW_MASK);
}

static int64_t towards_switch(unsigned n, int64_t distance)
{
    return parameters_get(n, LINE_PARAMETER_HOME_END) ? distance : -distance;
}

static void write_control(unsigned n, bool on)
{
    const struct axis *a = &axes[n];
    uint32_t only_blocks = a->homing || a->leaving ? AXIS_CONTROL_HOMING_MASK : 0;
    axis_write(n, AXIS_CONTROL, only_blocks | (on ? AXIS_CONTROL_ENABLE_MASK | AXIS_CONTROL_CLOSED_LOOP_MASK : 0));
}

static void hold_here(unsigned n)
{
    axes[n].plan.next = axes[n].plan.count;
    axis_write(n, AXIS_STROBES, AXIS_STROBES_HOLD_HERE_MASK);
}

static void brake(unsigned n)
{
    axes[n].plan.next = axes[n].plan.count;
    axis_write(n, AXIS_STROBES, AXIS_STROBES_BRAKE_MASK);
}

static void feed(unsigned n)
{
    struct axis *a = &axes[n];
    struct planner_segment piece;
    bool last;
    if (a->plan.next >= a->plan.count) return;
    uint32_t room = FIELD_GET(axis_read(n, AXIS_STATE), AXIS_STATE_QUEUE_FREE);
    while (room-- && planner_take(&a->plan, &piece, &last)) {
        axis_write_wide(n, AXIS_SEGMENT_VELOCITY, (uint64_t)piece.velocity);
        axis_write_wide(n, AXIS_SEGMENT_ACCELERATION, (uint64_t)piece.acceleration);
        axis_write(n, AXIS_SEGMENT_JERK, (uint32_t)piece.jerk);
        axis_write(n, AXIS_SEGMENT_TICKS, piece.ticks | (last ? AXIS_SEGMENT_TICKS_LAST_MASK : 0));
    }
}

// The player must stand. A distance of zero plays nothing.
static bool play(unsigned n, int64_t distance, uint8_t velocity_id)
{
    struct axis *a = &axes[n];
    struct planner_limits limits = parameters_limits(n, velocity_id);
    if (!planner_move(&a->plan, &limits, distance)) return false;
    if (a->plan.count == 0) return true;
    feed(n);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_START_MASK);
    return true;
}

static bool played(const struct axis *a, uint32_t state)
{
    return a->plan.next >= a->plan.count && !(state & AXIS_STATE_MOVING_MASK);
}

static void finish(unsigned n, uint8_t cause)
{
    struct axis *a = &axes[n];
    a->ended = cause;
    a->state = LINE_STATE_HOLDING;
    a->homing = false;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    write_control(n, true);
}

static bool inside_window(unsigned n)
{
    int64_t error = (int32_t)axis_read(n, AXIS_FOLLOWING_ERROR), window = parameters_get(n, LINE_PARAMETER_SETTLE_WINDOW);
    return error <= window && error >= -window;
}

static void settle_begin(struct axis *a)
{
    a->inside = false;
    a->since_ms = clock_ms();
}

// ok, not_settled, or running as long as neither is decided.
static uint8_t settle(unsigned n)
{
    struct axis *a = &axes[n];
    uint32_t now = clock_ms();
    bool inside = inside_window(n);
    if (inside && !a->inside) a->inside_ms = now;
    a->inside = inside;
    if (inside && now - a->inside_ms >= (uint32_t)parameters_get(n, LINE_PARAMETER_SETTLE_TIME)) return LINE_CAUSE_OK;
    if (now - a->since_ms >= (uint32_t)parameters_get(n, LINE_PARAMETER_SETTLE_TIMEOUT)) return LINE_CAUSE_NOT_SETTLED;
    return LINE_CAUSE_RUNNING;
}

static void home_to(struct axis *a, enum home_step step)
{
    a->step = step;
    settle_begin(a);
}

// Each step of homing that drives begins here; a drive that the planner refuses ends the homing.
static void home_drive(unsigned n, enum home_step step, int64_t distance, uint8_t velocity_id)
{
    if (play(n, distance, velocity_id)) home_to(&axes[n], step);
    else finish(n, LINE_CAUSE_OUT_OF_RANGE);
}

static void home_catch(unsigned n)
{
    struct axis *a = &axes[n];
    hold_here(n);
    a->mark = axis_read_position(n, AXIS_POSITION);
    a->mark_ms = clock_ms();
    home_to(a, CATCH);
}

static void home_poll(unsigned n, uint32_t state)
{
    struct axis *a = &axes[n];
    int64_t distance = parameters_get(n, LINE_PARAMETER_HOME_DISTANCE);
    uint8_t settled;

    switch (a->step) {
    case APPROACH:
        if (home_pressed(n, state)) home_catch(n);
        else if (played(a, state)) finish(n, LINE_CAUSE_NO_SWITCH);
        break;
    case CATCH:                                             // no way on: the target follows the axis until it stands
        hold_here(n);
        if (clock_ms() - a->since_ms >= (uint32_t)parameters_get(n, LINE_PARAMETER_SETTLE_TIMEOUT)) finish(n, LINE_CAUSE_NOT_SETTLED);
        else if (clock_ms() - a->mark_ms >= STAND_MS) {
            int64_t position = axis_read_position(n, AXIS_POSITION), moved = position - a->mark;
            a->mark = position;
            a->mark_ms = clock_ms();
            if (moved >= STAND_DISTANCE || moved <= -STAND_DISTANCE) break;
            if (home_pressed(n, state)) home_drive(n, CREEP, -towards_switch(n, distance), LINE_PARAMETER_HOME_CREEP);
            else home_drive(n, APPROACH, towards_switch(n, distance), LINE_PARAMETER_HOME_CREEP);     // bounced off
        }
        break;
    case CREEP:
        if (!home_pressed(n, state)) {
            a->place = axis_read_position(n, AXIS_POSITION) - towards_switch(n, distance);
            brake(n);
            home_to(a, RELEASE);
        } else if (played(a, state)) {
            finish(n, LINE_CAUSE_SWITCH_STUCK);
        }
        break;
    case RELEASE:
        if (played(a, state)) home_drive(n, DEPART, a->place - axis_read_position(n, AXIS_TARGET), LINE_PARAMETER_HOME_VELOCITY);
        break;
    case DEPART:
        if (played(a, state)) home_to(a, FIRST_SETTLE);
        break;
    case FIRST_SETTLE:
        settled = settle(n);
        if (settled == LINE_CAUSE_NOT_SETTLED) finish(n, settled);
        if (settled == LINE_CAUSE_OK) {
            int32_t periods = (int32_t)((a->place + 32768) >> 16);
            a->home_phase = (int32_t)(a->place - (int64_t)periods * 65536);
            axis_write(n, AXIS_SHIFT_ORIGIN, (uint32_t)-periods);
            home_drive(n, ZERO, -axis_read_position(n, AXIS_TARGET), LINE_PARAMETER_HOME_CREEP);
        }
        break;
    case ZERO:
        if (played(a, state)) home_to(a, SECOND_SETTLE);
        break;
    default:
        settled = settle(n);
        if (settled == LINE_CAUSE_RUNNING) break;
        a->homed = settled == LINE_CAUSE_OK;
        finish(n, settled);
        break;
    }
}

static void fault(unsigned n, uint32_t faults)
{
    struct axis *a = &axes[n];
    if (faults & LINE_FAULT_ENCODER) a->homed = false;
    if (a->state == LINE_STATE_FAULTED) return;
    a->state = LINE_STATE_FAULTED;
    a->homing = a->leaving = false;
    if (at_work(a)) a->ended = LINE_CAUSE_ENDED_BY_FAULT;
    write_control(n, false);
    hold_here(n);
}

void axis_poll(unsigned n)
{
    struct axis *a = &axes[n];
    uint32_t faults = axis_read(n, AXIS_FAULTS), state;
    uint8_t settled;

    if (faults) fault(n, faults);
    if (a->state == LINE_STATE_OFF || a->state == LINE_STATE_FAULTED) return;
    state = axis_read(n, AXIS_STATE);
    if (a->leaving && !pressed(state)) {
        a->leaving = false;
        write_control(n, true);
    }
    feed(n);
    switch (a->state) {
    case LINE_STATE_HOMING: home_poll(n, state); break;
    case LINE_STATE_MOVING:
        if (played(a, state)) {
            a->state = LINE_STATE_SETTLING;
            settle_begin(a);
        }
        break;
    case LINE_STATE_SETTLING:
        settled = settle(n);
        if (settled != LINE_CAUSE_RUNNING) finish(n, settled);
        break;
    case LINE_STATE_STOPPING:
        if (played(a, state)) finish(n, LINE_CAUSE_STOPPED);
        break;
    default: break;
    }
}

void axis_start(unsigned n)
{
    axes[n] = (struct axis){.state = LINE_STATE_OFF, .ended = LINE_CAUSE_NEVER};
    axis_write(n, AXIS_CONTROL, 0);
    parameters_start(n);
    axis_write(n, AXIS_ENCODER_EVENTS, AXIS_ENCODER_FAULT_MASK_MASK);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_HOLD_HERE_MASK | AXIS_STROBES_RESET_FAULTS_MASK);
}

uint8_t axis_enable(unsigned n, bool on)
{
    struct axis *a = &axes[n];
    axis_poll(n);
    if (!on) {
        if (at_work(a)) a->ended = LINE_CAUSE_STOPPED;
        if (a->state != LINE_STATE_FAULTED) a->state = LINE_STATE_OFF;
        a->homing = a->leaving = false;
        write_control(n, false);
        hold_here(n);
        return LINE_CAUSE_OK;
    }
    if (a->state == LINE_STATE_FAULTED) return LINE_CAUSE_FAULTED;
    if (a->state != LINE_STATE_OFF) return LINE_CAUSE_OK;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    hold_here(n);
    a->state = LINE_STATE_HOLDING;
    write_control(n, true);
    axis_poll(n);                                           // whether the guard agrees
    return a->state == LINE_STATE_FAULTED ? LINE_CAUSE_FAULTED : LINE_CAUSE_OK;
}

// What every motion asks first.
static uint8_t ready(unsigned n)
{
    const struct axis *a = &axes[n];
    axis_poll(n);
    if (a->state == LINE_STATE_FAULTED) return LINE_CAUSE_FAULTED;
    if (a->state == LINE_STATE_OFF) return LINE_CAUSE_NOT_ENABLED;
    if (at_work(a)) return LINE_CAUSE_BUSY;
    return LINE_CAUSE_OK;
}

uint8_t axis_home(unsigned n)
{
    struct axis *a = &axes[n];
    uint8_t cause = ready(n);
    if (cause != LINE_CAUSE_OK) return cause;

    int64_t search = parameters_get(n, LINE_PARAMETER_HOME_DISTANCE);
    int64_t low = parameters_get(n, LINE_PARAMETER_TRAVEL_LOW), high = parameters_get(n, LINE_PARAMETER_TRAVEL_HIGH);
    if (high > low) search += high - low;
    if (search > LONGEST_SEARCH) search = LONGEST_SEARCH;
    bool on_switch = home_pressed(n, axis_read(n, AXIS_STATE));
    if (!on_switch && !play(n, towards_switch(n, search), LINE_PARAMETER_HOME_VELOCITY)) return LINE_CAUSE_OUT_OF_RANGE;
    a->homed = false;
    a->ended = LINE_CAUSE_RUNNING;
    a->state = LINE_STATE_HOMING;
    a->homing = true;
    write_control(n, true);
    if (on_switch) home_catch(n);
    else home_to(a, APPROACH);
    return LINE_CAUSE_OK;
}

uint8_t axis_move(unsigned n, int64_t target, uint32_t *duration_ticks)
{
    struct axis *a = &axes[n];
    uint8_t cause = ready(n);
    if (cause != LINE_CAUSE_OK) return cause;
    if (!a->homed) return LINE_CAUSE_NOT_HOMED;
    if (target < parameters_get(n, LINE_PARAMETER_TRAVEL_LOW) || target > parameters_get(n, LINE_PARAMETER_TRAVEL_HIGH))
        return LINE_CAUSE_OUT_OF_TRAVEL;
    if (!play(n, target - axis_read_position(n, AXIS_TARGET), LINE_PARAMETER_VELOCITY)) return LINE_CAUSE_OUT_OF_RANGE;
    a->ended = LINE_CAUSE_RUNNING;
    a->state = LINE_STATE_MOVING;
    *duration_ticks = a->plan.ticks;
    return LINE_CAUSE_OK;
}

uint8_t axis_stop(unsigned n)
{
    struct axis *a = &axes[n];
    axis_poll(n);
    if (!at_work(a) || a->state == LINE_STATE_STOPPING) return LINE_CAUSE_OK;
    if (axis_read(n, AXIS_STATE) & AXIS_STATE_MOVING_MASK) {
        brake(n);
        a->state = LINE_STATE_STOPPING;
    } else {
        finish(n, LINE_CAUSE_STOPPED);
    }
    return LINE_CAUSE_OK;
}

uint8_t axis_reset_faults(unsigned n)
{
    struct axis *a = &axes[n];
    axis_poll(n);
    if (axis_read(n, AXIS_FAULTS) & LINE_FAULT_ENCODER) axis_write(n, AXIS_SHIFT_ORIGIN, 0);    // position and count agree from here on
    axis_write(n, AXIS_ENCODER_EVENTS, AXIS_ENCODER_FAULT_MASK_MASK);
    if (a->state != LINE_STATE_FAULTED) return LINE_CAUSE_OK;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    write_control(n, false);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_RESET_FAULTS_MASK);
    if (axis_read(n, AXIS_FAULTS)) return LINE_CAUSE_FAULT_STANDS;
    a->state = LINE_STATE_OFF;
    return LINE_CAUSE_OK;
}

uint8_t axis_set_parameter(unsigned n, uint8_t id, int64_t value)
{
    uint8_t cause = parameters_check(id, value);
    if (cause != LINE_CAUSE_OK) return cause;
    axis_poll(n);
    if (at_work(&axes[n])) return LINE_CAUSE_BUSY;
    parameters_set(n, id, value);
    return LINE_CAUSE_OK;
}

uint8_t axis_state(unsigned n)
{
    return axes[n].state;
}

uint8_t axis_ended(unsigned n)
{
    return axes[n].ended;
}

uint8_t axis_flags(unsigned n)
{
    const struct axis *a = &axes[n];
    uint32_t state = axis_read(n, AXIS_STATE);
    bool on = state & AXIS_STATE_ENABLED_MASK;
    return (uint8_t)((on ? LINE_FLAG_ENABLED : 0) | (a->homed ? LINE_FLAG_HOMED : 0) |
                     (state & AXIS_STATE_LIMIT_LOW_MASK ? LINE_FLAG_LIMIT_LOW : 0) |
                     (state & AXIS_STATE_LIMIT_HIGH_MASK ? LINE_FLAG_LIMIT_HIGH : 0) |
                     (state & AXIS_STATE_ESTOP_MASK ? LINE_FLAG_ESTOP : 0) |
                     (on && inside_window(n) ? LINE_FLAG_SETTLED : 0) |
                     (state & AXIS_STATE_SATURATED_MASK ? LINE_FLAG_SATURATED : 0));
}

int32_t axis_home_phase(unsigned n)
{
    return axes[n].home_phase;
}

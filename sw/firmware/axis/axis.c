// SPDX-License-Identifier: Apache-2.0
// axis -- state machine of an axis.
//
// A limit switch normally is a fault. It only blocks motion into the switch while the axis homes,
// and after `enable` or `reset_faults` on a pressed switch until it is released (leaving).
//
// With a fine stage the motor brings the axis within the reach of the fine stage and then rests. If
// the error leaves the reach, or the fine stage is at the end of its range, the motor takes over
// again until the fine stage is back in the middle of its range. Both changes continue from the
// present command of the motor.
#include "axis/axis.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "axis/homing.h"
#include "made/bus_protocol.h"
#include "axis/motion.h"
#include "axis/parameters.h"

#define FINE_HYSTERESIS 4  // the fine stage releases the axis at this multiple of its reach
#define FINE_MS 10u        // the axis must be within the reach for this time
#define EASE 8             // decrease of the motor command per millisecond in the fine stage

// Longest time between two polls: nothing happens without a request
#define OFF_TICKS 64u     // while the drive is off
#define HOLDING_TICKS 1u  // at standstill: only a fault, which has switched the drive off already

enum drive { BRIDGE, STEPS, DAC_OUTPUT };

static struct axis {
    uint8_t state;  // bus_state
    uint8_t ended;  // bus_cause
    bool homed;
    uint8_t command_count;  // requests to switch off, home, move, prepare or stop; wraps
    bool homing;            // a switch only blocks until this motion has ended
    bool leaving;           // a switch only blocks until it is released
    bool fine;              // the fine stage holds the position
    bool near;              // the error has been within the reach since near_ms
    uint32_t near_ms;
    uint32_t eased_ms;  // time of the last decrease of the motor command
} axes[HARDWARE_AXES];

static uint8_t stop_causes[HARDWARE_AXES];  // bus_cause with which a controlled stop ends

static bool is_busy(const struct axis* a) { return a->ended == BUS_CAUSE_RUNNING; }

static bool pressed(uint32_t state) {
    return state & (AXIS_STATE_LIMIT_LOW_MASK | AXIS_STATE_LIMIT_HIGH_MASK);
}

static void write_control(unsigned n, bool on) {
    const struct axis* a = &axes[n];
    uint32_t only_blocks = a->homing || a->leaving ? AXIS_CONTROL_HOMING_MASK : 0;
    uint32_t loop = a->state == BUS_STATE_EXCITED ? 0
                    : a->fine                     ? AXIS_CONTROL_FINE_MASK
                                                  : AXIS_CONTROL_CLOSED_LOOP_MASK;
    axis_write(n, AXIS_CONTROL, only_blocks | (on ? AXIS_CONTROL_ENABLE_MASK | loop : 0));
}

static void hand_over(unsigned n, bool fine) {
    struct axis* a = &axes[n];
    a->near = fine;
    if (a->fine == fine) return;
    a->fine = fine;
    a->eased_ms = clock_ms();
    if (fine) axis_write(n, AXIS_OPEN_COMMAND, axis_read(n, AXIS_COMMAND));
    write_control(n, true);
}

// A motor whose command drops to 0 springs back. So its command decreases slowly enough for the
// fine stage to follow, until friction alone holds the axis. A stepper keeps its command.
bool axis_ease(unsigned n) {
    struct axis* a = &axes[n];
    uint32_t now = clock_ms();
    int32_t command = (int16_t)axis_read(n, AXIS_OPEN_COMMAND),
            most = EASE * (int32_t)(now - a->eased_ms);
    a->eased_ms = now;
    if (parameters_get(n, BUS_PARAMETER_DRIVE) == STEPS) return true;
    axis_write(n, AXIS_OPEN_COMMAND,
               (uint32_t)(command > most    ? command - most
                          : command < -most ? command + most
                                            : 0));
    return command == 0;
}

// Whether the axis is held for good: the fine stage holds it and the motor is released, or the
// error is out of its reach.
static bool hold(unsigned n) {
    struct axis* a = &axes[n];
    int64_t reach = parameters_get(n, BUS_PARAMETER_FINE_REACH),
            limit = parameters_get(n, BUS_PARAMETER_FINE_LIMIT);
    int16_t command = (int16_t)actuator_read(n, ACTUATOR_FINE_COMMAND);
    bool able = a->fine ? command < limit && command > -limit : command == 0;
    bool inside = reach && limit && motion_inside(n, a->fine ? FINE_HYSTERESIS * reach : reach);
    bool near = inside && able;
    if (near && !a->near) a->near_ms = clock_ms();
    a->near = near;
    if (!near || a->fine || clock_ms() - a->near_ms >= FINE_MS) hand_over(n, near);
    return a->fine ? axis_ease(n) : !inside;
}

// Changes the state of the axis, and ends its search for an index, if there is one.
static void change_state(unsigned n, uint8_t state) {
    if (HARDWARE_DRIVES) homing_disarm(n);
    axes[n].state = state;
}

static void finish(unsigned n, uint8_t cause) {
    struct axis* a = &axes[n];
    a->ended = cause;
    change_state(n, BUS_STATE_HOLDING);
    a->homing = false;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    write_control(n, true);
}

static void switch_off(unsigned n, uint8_t state, uint8_t cause) {
    struct axis* a = &axes[n];
    if (is_busy(a)) a->ended = cause;
    change_state(n, state);
    a->homing = a->leaving = a->fine = a->near = false;
    if (!HARDWARE_DRIVES) return;
    write_control(n, false);
    motion_set_target_to_position(n);
}

static void fault(unsigned n, uint32_t faults) {
    struct axis* a = &axes[n];
    if (faults & BUS_FAULT_ENCODER) a->homed = false;
    if (a->state != BUS_STATE_FAULTED) switch_off(n, BUS_STATE_FAULTED, BUS_CAUSE_ENDED_BY_FAULT);
}

void axis_poll(unsigned n) {
    struct axis* a = &axes[n];
    uint32_t faults = axis_read(n, AXIS_FAULTS), state;
    uint8_t outcome;

    if (faults) fault(n, faults);
    if (!HARDWARE_DRIVES || a->state == BUS_STATE_OFF || a->state == BUS_STATE_FAULTED) return;
    motion_feed(n);
    state = axis_read(n, AXIS_STATE);  // read last, so that homing sees the present state
    if (a->leaving && !pressed(state)) a->leaving = false;
    write_control(n, true);  // in each round, since a bit of it may have flipped
    switch (a->state) {
    case BUS_STATE_HOMING:
        outcome = homing_poll(n, state);
        a->homed = outcome == BUS_CAUSE_OK;
        if (outcome != BUS_CAUSE_RUNNING) finish(n, outcome);
        break;
    case BUS_STATE_MOVING:
        if (motion_played(n)) {
            a->state = BUS_STATE_SETTLING;
            motion_settle_begin(n);
        }
        break;
    case BUS_STATE_PREPARED:
    case BUS_STATE_HOLDING: hold(n); break;
    case BUS_STATE_SETTLING:
        outcome = motion_settle(n, hold(n), parameters_get(n, BUS_PARAMETER_SETTLE_WINDOW));
        // plans are exact: another end means that a bit flipped, in the plan or on its way
        if (outcome == BUS_CAUSE_OK && !motion_complete(n)) outcome = BUS_CAUSE_NOT_SETTLED;
        if (outcome != BUS_CAUSE_RUNNING) finish(n, outcome);
        break;
    case BUS_STATE_STOPPING:
        if (motion_played(n)) finish(n, stop_causes[n]);
        break;
    default: break;
    }
}

uint32_t axis_idle_ticks(unsigned n) {
    const struct axis* a = &axes[n];
    if (a->state == BUS_STATE_OFF || a->state == BUS_STATE_FAULTED) return OFF_TICKS;
    bool rests = a->state == BUS_STATE_HOLDING && !a->leaving && !a->fine;
    return rests && !parameters_get(n, BUS_PARAMETER_FINE_REACH) ? HOLDING_TICKS : 0;
}

void axis_start(unsigned n) {
    axes[n] = (struct axis){.state = BUS_STATE_OFF, .ended = BUS_CAUSE_NO_MOTION_YET};
    axis_write(n, AXIS_CONTROL, 0);
    parameters_start(n);
    axis_write(n, AXIS_ENCODER_EVENTS, AXIS_ENCODER_FAULT_MASK_MASK);
    axis_write(n, AXIS_STROBES,
               AXIS_STROBES_SET_TARGET_TO_POSITION_MASK | AXIS_STROBES_RESET_FAULTS_MASK);
}

uint8_t axis_enable(unsigned n, bool on) {
    struct axis* a = &axes[n];
    a->command_count += !on;
    if (on && !hardware_built(n, AXIS_BUILT_DRIVE_MASK)) return BUS_CAUSE_NOT_BUILT;
    axis_poll(n);
    if (!on) {
        switch_off(n, a->state == BUS_STATE_FAULTED ? BUS_STATE_FAULTED : BUS_STATE_OFF,
                   BUS_CAUSE_STOPPED);
        return BUS_CAUSE_OK;
    }
    if (a->state == BUS_STATE_FAULTED) return BUS_CAUSE_FAULTED;
    if (a->state != BUS_STATE_OFF) return BUS_CAUSE_OK;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    motion_set_target_to_position(n);
    a->state = BUS_STATE_HOLDING;
    write_control(n, true);
    axis_poll(n);  // the interlock may have refused
    return a->state == BUS_STATE_FAULTED ? BUS_CAUSE_FAULTED : BUS_CAUSE_OK;
}

// The checks before any motion.
static uint8_t check_ready(unsigned n) {
    const struct axis* a = &axes[n];
    if (!hardware_built(n, AXIS_BUILT_DRIVE_MASK)) return BUS_CAUSE_NOT_BUILT;
    axis_poll(n);
    if (a->state == BUS_STATE_FAULTED) return BUS_CAUSE_FAULTED;
    if (a->state == BUS_STATE_OFF) return BUS_CAUSE_NOT_ENABLED;
    if (is_busy(a)) return BUS_CAUSE_BUSY;
    return BUS_CAUSE_OK;
}

uint8_t axis_home(unsigned n) {
    struct axis* a = &axes[n];
    a->command_count++;
    uint8_t cause = check_ready(n);
    if (cause != BUS_CAUSE_OK) return cause;

    hand_over(n, false);
    feedback_write(n, FEEDBACK_SEGMENT_USE, 0);  // homing needs phases; the target moves along
    cause = homing_begin(n);
    if (cause != BUS_CAUSE_OK) {
        homing_disarm(n);
        return cause;
    }
    a->homed = false;
    a->ended = BUS_CAUSE_RUNNING;
    a->state = BUS_STATE_HOMING;
    a->homing = true;
    write_control(n, true);
    return BUS_CAUSE_OK;
}

// The checks before a motion to a position. Another motion may begin while the last one settles.
static uint8_t check_move(unsigned n, int64_t target) {
    struct axis* a = &axes[n];
    a->command_count++;
    uint8_t cause = check_ready(n);
    if (cause != BUS_CAUSE_OK && !(cause == BUS_CAUSE_BUSY && (a->state == BUS_STATE_SETTLING ||
                                                               a->state == BUS_STATE_MOVING)))
        return cause;
    if (!a->homed) return BUS_CAUSE_NOT_HOMED;
    if (target < parameters_get(n, BUS_PARAMETER_TRAVEL_LOW) ||
        target > parameters_get(n, BUS_PARAMETER_TRAVEL_HIGH))
        return BUS_CAUSE_OUT_OF_TRAVEL;
    return BUS_CAUSE_OK;
}

uint8_t axis_prepare(unsigned n, int64_t target, uint32_t* duration_ticks) {
    struct axis* a = &axes[n];
    uint8_t cause = check_move(n, target);
    if (cause != BUS_CAUSE_OK) return cause;
    if (a->state == BUS_STATE_MOVING) return BUS_CAUSE_BUSY;
    cause = motion_prepare(n, target - axis_read_position(n, AXIS_TARGET), BUS_PARAMETER_VELOCITY);
    if (cause != BUS_CAUSE_OK) return cause;
    a->ended = BUS_CAUSE_RUNNING;
    a->state = BUS_STATE_PREPARED;
    *duration_ticks = motion_ticks(n);
    return BUS_CAUSE_OK;
}

static void begin_motion(unsigned n) {
    hand_over(n, false);
    axes[n].state = BUS_STATE_MOVING;
}

uint32_t axis_prepared(unsigned count, uint32_t mask) {
    for (unsigned n = 0; n < count; n++)
        if (axes[n].state != BUS_STATE_PREPARED) mask &= ~(1u << n);
    return mask;
}

uint8_t axis_may_start(unsigned count, uint32_t mask) {
    if (mask == 0 || mask >> count) return BUS_CAUSE_OUT_OF_RANGE;
    return axis_prepared(count, mask) == mask ? BUS_CAUSE_OK : BUS_CAUSE_NOT_PREPARED;
}

void axis_started(unsigned count, uint32_t mask) {
    mask = axis_prepared(count, mask);
    for (unsigned n = 0; n < count; n++)
        if (mask >> n & 1u) begin_motion(n);
}

uint8_t axis_start_prepared(unsigned count, uint32_t mask) {
    uint8_t cause = axis_may_start(count, mask);
    if (cause != BUS_CAUSE_OK) return cause;
    axis_started(count, mask);
    node_write(NODE_START_AXES, mask);
    return BUS_CAUSE_OK;
}

uint8_t axis_move(unsigned n, int64_t target, uint32_t* duration_ticks) {
    uint8_t cause;
    axis_poll(n);
    if (axes[n].state == BUS_STATE_MOVING) {
        cause = check_move(n, target);
        if (cause != BUS_CAUSE_OK) return cause;
        *duration_ticks = 0;
        return motion_retarget(n, target, BUS_PARAMETER_VELOCITY);
    }
    cause = axis_prepare(n, target, duration_ticks);
    if (cause != BUS_CAUSE_OK) return cause;
    begin_motion(n);
    motion_start(n);
    return BUS_CAUSE_OK;
}

uint8_t axis_go(unsigned n, int64_t distance, uint8_t velocity_id) {
    uint8_t cause = check_ready(n);
    if (cause != BUS_CAUSE_OK) return cause;
    cause = motion_prepare(n, distance, velocity_id);
    if (cause != BUS_CAUSE_OK) return cause;
    axes[n].ended = BUS_CAUSE_RUNNING;
    begin_motion(n);
    motion_start(n);
    return BUS_CAUSE_OK;
}

void axis_break_off(unsigned n, uint8_t cause) {
    motion_controlled_stop(n);
    change_state(n, BUS_STATE_STOPPING);
    stop_causes[n] = cause;
}

uint8_t axis_stop(unsigned n) {
    struct axis* a = &axes[n];
    a->command_count++;
    axis_poll(n);
    if (!is_busy(a) || a->state == BUS_STATE_STOPPING) return BUS_CAUSE_OK;
    if (axis_read(n, AXIS_STATE) & AXIS_STATE_MOVING_MASK) {
        axis_break_off(n, BUS_CAUSE_STOPPED);
    } else {
        if (a->state == BUS_STATE_PREPARED || a->state == BUS_STATE_EXCITED)
            motion_set_target_to_position(n);
        finish(n, BUS_CAUSE_STOPPED);
    }
    return BUS_CAUSE_OK;
}

uint8_t axis_excite(unsigned n, bool on) {
    struct axis* a = &axes[n];
    if (!HARDWARE_DRIVES) return on ? BUS_CAUSE_NOT_BUILT : BUS_CAUSE_OK;
    if (!on) {
        if (a->state != BUS_STATE_EXCITED) return BUS_CAUSE_OK;
        motion_set_target_to_position(n);
        finish(n, BUS_CAUSE_OK);
        return BUS_CAUSE_OK;
    }
    uint8_t cause = check_ready(n);
    if (cause != BUS_CAUSE_OK) return cause;
    hand_over(n, false);
    axis_write(n, AXIS_OPEN_COMMAND, axis_read(n, AXIS_COMMAND));
    a->eased_ms = clock_ms();
    a->ended = BUS_CAUSE_RUNNING;
    a->state = BUS_STATE_EXCITED;
    write_control(n, true);
    return BUS_CAUSE_OK;
}

uint8_t axis_reset_faults(unsigned n) {
    struct axis* a = &axes[n];
    axis_poll(n);
    if (axis_read(n, AXIS_FAULTS) & BUS_FAULT_ENCODER)
        axis_write(n, AXIS_SHIFT_ORIGIN, 0);  // position and count agree from now on
    axis_write(n, AXIS_ENCODER_EVENTS, AXIS_ENCODER_FAULT_MASK_MASK);
    if (a->state != BUS_STATE_FAULTED) return BUS_CAUSE_OK;
    a->leaving = pressed(axis_read(n, AXIS_STATE));
    write_control(n, false);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_RESET_FAULTS_MASK);
    if (axis_read(n, AXIS_FAULTS)) return BUS_CAUSE_FAULT_PERSISTS;
    a->state = BUS_STATE_OFF;
    return BUS_CAUSE_OK;
}

// Whether a parameter may change now: some may during a motion, some only while the drive is off.
static uint8_t check_parameter(unsigned n, uint8_t id, int64_t value) {
    const struct axis* a = &axes[n];
    bool on = a->state != BUS_STATE_OFF && a->state != BUS_STATE_FAULTED;
    if (id == BUS_PARAMETER_FEED_OVERRIDE && !motion_follows(n)) return BUS_CAUSE_OK;
    if (is_busy(a)) return BUS_CAUSE_BUSY;
    switch (id) {
    case BUS_PARAMETER_DRIVE:
        if (value == DAC_OUTPUT && parameters_get(n, BUS_PARAMETER_FINE_REACH))
            return BUS_CAUSE_OUT_OF_RANGE;
        return on ? BUS_CAUSE_BUSY : BUS_CAUSE_OK;
    case BUS_PARAMETER_POSITION_SOURCE:
    case BUS_PARAMETER_STEP_OUTPUT:
    case BUS_PARAMETER_STEP_INVERT: return on ? BUS_CAUSE_BUSY : BUS_CAUSE_OK;
    case BUS_PARAMETER_SEGMENT_COUNT:
    case BUS_PARAMETER_SEGMENT_LENGTH:
    case BUS_PARAMETER_SEGMENT_FIRST:
        return parameters_get(n, BUS_PARAMETER_SEGMENTS) && value != parameters_get(n, id)
                   ? BUS_CAUSE_SEGMENTS_IN_USE
                   : BUS_CAUSE_OK;
    case BUS_PARAMETER_FINE_REACH:
        return value && parameters_get(n, BUS_PARAMETER_DRIVE) == DAC_OUTPUT
                   ? BUS_CAUSE_OUT_OF_RANGE
                   : BUS_CAUSE_OK;
    default: return BUS_CAUSE_OK;
    }
}

uint8_t axis_set_parameter(unsigned n, uint8_t id, int64_t value) {
    uint8_t cause = parameters_check(n, id, value);
    if (cause != BUS_CAUSE_OK) return cause;
    axis_poll(n);
    cause = check_parameter(n, id, value);
    if (cause != BUS_CAUSE_OK) return cause;
    if ((id == BUS_PARAMETER_DECODER_MODE || id == BUS_PARAMETER_POSITION_SOURCE) &&
        value != parameters_get(n, id))
        axes[n].homed = false;  // the zero was another count
    parameters_set(n, id, value);
    return BUS_CAUSE_OK;
}

uint8_t axis_state(unsigned n) { return axes[n].state; }

uint8_t axis_command_count(unsigned n) { return axes[n].command_count; }

uint8_t axis_ended(unsigned n) { return axes[n].ended; }

bool axis_homed(unsigned n) { return axes[n].homed; }

uint8_t axis_flags(unsigned n) {
    const struct axis* a = &axes[n];
    uint32_t state = axis_read(n, AXIS_STATE);
    bool on = state & AXIS_STATE_ENABLED_MASK;
    return (uint8_t)((on ? BUS_FLAG_ENABLED : 0) | (a->homed ? BUS_FLAG_HOMED : 0) |
                     (state & AXIS_STATE_LIMIT_LOW_MASK ? BUS_FLAG_LIMIT_LOW : 0) |
                     (state & AXIS_STATE_LIMIT_HIGH_MASK ? BUS_FLAG_LIMIT_HIGH : 0) |
                     (state & AXIS_STATE_ESTOP_MASK ? BUS_FLAG_ESTOP : 0) |
                     (HARDWARE_DRIVES && on &&
                              motion_inside(n, parameters_get(n, BUS_PARAMETER_SETTLE_WINDOW))
                          ? BUS_FLAG_SETTLED
                          : 0) |
                     (state & AXIS_STATE_SATURATED_MASK ? BUS_FLAG_SATURATED : 0));
}

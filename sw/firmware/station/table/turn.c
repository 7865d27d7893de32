// SPDX-License-Identifier: Apache-2.0
// turn -- turns the indexing table of axis 0 to an absolute angle of its sensor (S4).
//
//   reading ─► going_below ─► coming_up ─► reading ─► closing_in ─► reading …
//                   ▲                         │           ▲            │
//                   └──── above the target ───┴───────────┴────────────┘
//
// coming_up ends turn_allowance below the target. Each closing_in goes turn_share of what remains.
// It ends when a reading is within turn_tolerance of the target.
//
// The worm always pushes the table up: a distance up that is shorter than turn_take_up begins
// farther below. The long distances are done at the speed of a move of the axis, closing_in at its
// homing_latch_speed. At each reading the steps are compared with the sensor.
#include "station/table/turn.h"

#include "axis/axis.h"
#include "core/clock.h"
#include "core/hardware.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "station/table/sensor.h"
#include "station/settings.h"

#define AXIS 0u
#define TURN ((int64_t)SENSOR_TURN)
#define ABOUT_ZERO (TURN / 360)  // below angle 0 by up to this counts as angle 0
#define FOLLOWED 4               // a table that sticks moves less than a quarter of its steps

enum direction_choice { DIRECT, SHORTER, ALWAYS_UP };

struct position {      // of the table, at rest
    uint32_t angle;    // by the sensor
    int64_t steps;     // by the steps, 2^-16 period
    uint32_t changes;  // sensor_changes then
};

static struct turn {
    uint8_t phase;  // bus_turn_phase
    uint8_t ended;  // bus_cause
    uint8_t tries, overshoots;
    uint8_t command_count;  // of the axis; if it changes, the axis got another command
    bool begun;             // the first reading has been taken
    bool measuring;         // the table has settled
    bool closing;           // from `near` on
    uint32_t target;
    uint32_t since_ms;                 // since when the table is at rest
    int64_t up;                        // distance of coming_up
    struct position first, near, now;  // where turning began, where closing_in began, last reading
} turn;

static int64_t setting(uint8_t id) { return settings_get(id); }

// The shorter distance round, from -TURN/2 up to below TURN/2.
static int64_t wrap_distance(int64_t distance) {
    while (distance >= TURN / 2) distance -= TURN;
    while (distance < -TURN / 2) distance += TURN;
    return distance;
}

static int64_t difference(uint32_t to, uint32_t from) { return wrap_distance((int64_t)to - from); }

static int64_t magnitude(int64_t distance) { return distance < 0 ? -distance : distance; }

static int64_t steps_of(int64_t distance) {
    int64_t part = magnitude(distance) * setting(BUS_SETTING_PERIODS_PER_TURN), whole = part / TURN;
    int64_t steps = (whole << 16) + ((part - whole * TURN) << 16) / TURN;
    return distance < 0 ? -steps : steps;
}

static int64_t distance_of(int64_t steps) {
    int64_t periods = magnitude(steps) >> 16, part = magnitude(steps) & 0xFFFF,
            per_turn = setting(BUS_SETTING_PERIODS_PER_TURN);
    int64_t turns = periods / per_turn,
            distance = turns * TURN +
                       ((periods - turns * per_turn) * TURN + (part * TURN >> 16)) / per_turn;
    return steps < 0 ? -distance : distance;
}

static void finish(uint8_t cause) {
    turn.phase = BUS_TURN_PHASE_IDLE;
    turn.ended = cause;
}

static void read_angle(void) {
    turn.phase = BUS_TURN_PHASE_READING;
    turn.measuring = false;
    turn.since_ms = clock_ms();
}

static void go(uint8_t phase, int64_t distance, uint8_t velocity_id) {
    uint8_t cause = axis_go(AXIS, steps_of(distance), velocity_id);
    if (cause == BUS_CAUSE_OK)
        turn.phase = phase;
    else
        finish(cause);
}

static void come_up(void) { go(BUS_TURN_PHASE_COMING_UP, turn.up, BUS_PARAMETER_VELOCITY); }

// Goes to below the target, which is `distance` away, with the worm pushing up.
static void approach(int64_t distance) {
    int64_t take_up = setting(BUS_SETTING_TURN_TAKE_UP), down;
    turn.closing = false;
    turn.up = distance - setting(BUS_SETTING_TURN_ALLOWANCE);
    down = take_up - turn.up;
    if (down <= 0) {
        come_up();
        return;
    }
    turn.up = take_up;
    go(BUS_TURN_PHASE_GOING_BELOW, -down, BUS_PARAMETER_VELOCITY);
}

static int64_t distance_up(void) {
    int64_t from = turn.now.angle, to = turn.target, distance = to - from;
    switch (setting(BUS_SETTING_TURN_DIRECTION)) {
    case DIRECT: return from > TURN - ABOUT_ZERO ? distance + TURN : distance;
    case SHORTER: return wrap_distance(distance);
    default: return distance < 0 ? distance + TURN : distance;
    }
}

// Why repeated closing_in does not reach the target.
static uint8_t cause_of_failure(void) {
    int64_t distance = distance_of(turn.now.steps - turn.near.steps),
            turned = difference(turn.now.angle, turn.near.angle);
    if (turn.now.changes == turn.near.changes) return BUS_CAUSE_SENSOR_STUCK;
    if (distance < FOLLOWED * setting(BUS_SETTING_TURN_TOLERANCE)) return BUS_CAUSE_NOT_CONVERGED;
    if (turned * FOLLOWED <= -distance) return BUS_CAUSE_WRONG_SIGN;
    return turned * FOLLOWED < distance ? BUS_CAUSE_STICTION : BUS_CAUSE_NOT_CONVERGED;
}

// ok, or what is wrong if the table is not where its steps should have brought it.
static uint8_t compare(void) {
    int64_t limit = setting(BUS_SETTING_TURN_DISAGREEMENT),
            distance = distance_of(turn.now.steps - turn.first.steps);
    int64_t turned = difference(turn.now.angle, turn.first.angle);
    if (magnitude(wrap_distance(turned - distance)) <= limit) return BUS_CAUSE_OK;
    uint8_t cause = turn.closing ? cause_of_failure() : BUS_CAUSE_NOT_CONVERGED;
    if (cause != BUS_CAUSE_NOT_CONVERGED) return cause;
    if (turn.now.changes == turn.first.changes) return BUS_CAUSE_SENSOR_STUCK;
    if (magnitude(turned) <= limit) return BUS_CAUSE_STICTION;
    if (magnitude(wrap_distance(turned + distance)) <= limit) return BUS_CAUSE_WRONG_SIGN;
    return BUS_CAUSE_SENSOR_DISAGREES;
}

static void decide(void) {
    int64_t tolerance = setting(BUS_SETTING_TURN_TOLERANCE), remaining;
    uint8_t cause = BUS_CAUSE_OK;
    turn.now =
        (struct position){sensor_mean(), axis_read_position(AXIS, AXIS_TARGET), sensor_changes()};
    remaining = difference(turn.target, turn.now.angle);
    if (!turn.begun)
        turn.first = turn.now;
    else
        cause = compare();
    if (cause != BUS_CAUSE_OK || magnitude(remaining) <= tolerance) {
        finish(cause);
    } else if (!turn.begun) {
        turn.begun = true;
        approach(distance_up());
    } else if (remaining < 0) {
        if (turn.overshoots == setting(BUS_SETTING_TURN_OVERSHOOTS)) {
            finish(BUS_CAUSE_NOT_CONVERGED);
            return;
        }
        turn.overshoots++;
        approach(remaining);
    } else if (turn.tries == setting(BUS_SETTING_TURN_TRIES)) {
        finish(cause_of_failure());
    } else {
        turn.tries++;
        if (!turn.closing) turn.near = turn.now;
        turn.closing = true;
        remaining = remaining * setting(BUS_SETTING_TURN_SHARE) / 100;
        go(BUS_TURN_PHASE_CLOSING_IN, remaining > 0 ? remaining : 1,
           BUS_PARAMETER_HOMING_LATCH_SPEED);
    }
}

static void reading(void) {
    if (axis_state(AXIS) != BUS_STATE_HOLDING) {
        finish(axis_state(AXIS) == BUS_STATE_FAULTED ? BUS_CAUSE_ENDED_BY_FAULT
                                                     : BUS_CAUSE_STOPPED);
    } else if (!turn.measuring) {
        if (clock_ms() - turn.since_ms < (uint32_t)setting(BUS_SETTING_TURN_SETTLE)) return;
        sensor_measure((uint32_t)setting(BUS_SETTING_TURN_FRAMES));
        turn.measuring = true;
    } else if (sensor_measured()) {
        decide();
    }
}

void turn_start(unsigned axes) {
    (void)axes;
    turn = (struct turn){.phase = BUS_TURN_PHASE_IDLE, .ended = BUS_CAUSE_NO_MOTION_YET};
}

void turn_work(void) {
    uint8_t ended;
    if (turn.phase == BUS_TURN_PHASE_IDLE) return;
    if (turn.command_count != axis_command_count(AXIS)) {
        finish(axis_state(AXIS) == BUS_STATE_FAULTED ? BUS_CAUSE_ENDED_BY_FAULT
                                                     : BUS_CAUSE_STOPPED);
        return;
    }
    if (sensor_timed_out()) {
        axis_stop(AXIS);
        finish(BUS_CAUSE_SENSOR_TIMED_OUT);
        return;
    }
    if (turn.phase == BUS_TURN_PHASE_READING) {
        reading();
        return;
    }
    ended = axis_ended(AXIS);
    if (ended == BUS_CAUSE_RUNNING) return;
    if (ended != BUS_CAUSE_OK)
        finish(ended);
    else if (turn.phase == BUS_TURN_PHASE_GOING_BELOW)
        come_up();
    else
        read_angle();
}

uint8_t turn_to(uint32_t angle) {
    uint8_t cause;
    if (!sensor_built()) return BUS_CAUSE_NOT_BUILT;
    if (angle >= SENSOR_TURN) return BUS_CAUSE_OUT_OF_RANGE;
    if (turn.phase != BUS_TURN_PHASE_IDLE) return BUS_CAUSE_BUSY;
    if (sensor_timed_out()) return BUS_CAUSE_SENSOR_TIMED_OUT;
    cause = axis_enable(AXIS, true);
    if (cause != BUS_CAUSE_OK) return cause;
    if (axis_ended(AXIS) == BUS_CAUSE_RUNNING) return BUS_CAUSE_BUSY;
    turn = (struct turn){
        .ended = BUS_CAUSE_RUNNING, .target = angle, .command_count = axis_command_count(AXIS)};
    read_angle();
    return BUS_CAUSE_OK;
}

uint8_t turn_ended(void) { return turn.ended; }

uint8_t turn_operation(uint8_t operation) {
    if (operation == BUS_OPERATION_TURN_TO)
        return turn_to((uint32_t)bus_request_field(BUS_TURN_TO_REQUEST_ANGLE, 4));
    if (operation != BUS_OPERATION_TURN_STATE) return BUS_CAUSE_NOT_BUILT;
    bus_reply_field(BUS_TURN_STATE_REPLY_PHASE, turn.phase, 1);
    bus_reply_field(BUS_TURN_STATE_REPLY_ENDED, turn.ended, 1);
    bus_reply_field(BUS_TURN_STATE_REPLY_TRIES, turn.tries, 1);
    bus_reply_field(BUS_TURN_STATE_REPLY_OVERSHOOTS, turn.overshoots, 1);
    bus_reply_field(BUS_TURN_STATE_REPLY_TARGET, turn.target, 4);
    bus_reply_field(BUS_TURN_STATE_REPLY_READING, turn.now.angle, 4);
    bus_reply_field(BUS_TURN_STATE_REPLY_LEFT, (uint64_t)difference(turn.target, turn.now.angle),
                    4);
    return BUS_CAUSE_OK;
}

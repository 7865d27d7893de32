// SPDX-License-Identifier: Apache-2.0
// homing -- finds the zero of an axis.
//
// method  zero
//   1, 2  first index after the switch at the low, high end has opened
//  17, 18 position at which the switch at the low, high end opens
//  33, 34 first index in the downward, upward direction
//  35, 37 present position
//  -1     S0: home_distance away from the position at which the switch at home_end opens
//  -2     S3: index within home_distance on either side, always passed in the upward direction
//
// The zero is always a whole phase: with an interpolated scale the nearest phase zero, with a
// counted scale the count itself. All methods but 17, 18, 35 and 37 end at the zero. The zero gets
// the position home_offset.
#include "axis/homing.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "axis/motion.h"
#include "axis/parameters.h"

#define S0_METHOD (-1)
#define S3_METHOD (-2)
#define STANDSTILL_MS 4u          // an axis is at standstill if in this time it
#define STANDSTILL_DISTANCE 8192  // moves by less than an eighth of a period
#define CLEAR_DISTANCE \
    131072  // a search that finds the index sooner may have started on it:
            // a gated one is met again after a period
#define LONGEST_SEARCH (1LL << 46)
#define CAPTURE_INDEX 1u  // bit of capture_sources

enum home_step {
    APPROACH,
    CATCH,
    LEAVE,
    RELEASE,
    DEPART,
    SEEK,
    SEEK_CAUGHT,
    MET,
    RETURN,
    FIRST_SETTLE,
    ZERO,
    SECOND_SETTLE
};

static struct homing {
    uint8_t step;  // home_step
    bool up;       // direction of the search
    bool second;   // S3: the first side had no index
    uint32_t sampled_ms;
    int64_t sampled;        // position at that time, or at the last poll with a pressed switch
    int64_t zero_position;  // position that becomes the zero
    int32_t zero;           // position that the zero gets, in periods
    int32_t phase;          // of the position that was found, relative to the zero
} homings[HARDWARE_AXES];

static int64_t method_of(unsigned n) { return parameters_get(n, BUS_PARAMETER_HOME_METHOD); }

static int64_t distance_of(unsigned n) { return parameters_get(n, BUS_PARAMETER_HOME_DISTANCE); }

static bool at_high_end(unsigned n) {
    int64_t method = method_of(n);
    return method == S0_METHOD ? parameters_get(n, BUS_PARAMETER_HOME_END)
                               : method == 2 || method == 18;
}

static bool home_pressed(unsigned n, uint32_t state) {
    return state & (at_high_end(n) ? AXIS_STATE_LIMIT_HIGH_MASK : AXIS_STATE_LIMIT_LOW_MASK);
}

static int64_t towards_switch(unsigned n, int64_t distance) {
    return at_high_end(n) ? distance : -distance;
}

static uint8_t go(unsigned n, enum home_step step) {
    homings[n].step = step;
    motion_settle_begin(n);
    return BUS_CAUSE_RUNNING;
}

// Homing uses the motor alone. With a fine stage it brings the axis only within its reach.
static int64_t settle_window(unsigned n) {
    int64_t window = parameters_get(n, BUS_PARAMETER_SETTLE_WINDOW),
            reach = parameters_get(n, BUS_PARAMETER_FINE_REACH);
    return reach > window ? reach : window;
}

// Starts a step that moves. If the planner refuses the motion, the homing ends.
static uint8_t drive(unsigned n, enum home_step step, int64_t distance, uint8_t velocity_id) {
    uint8_t cause = motion_play(n, distance, velocity_id);
    return cause == BUS_CAUSE_OK ? go(n, step) : cause;
}

// A switch stops the axis, and the interlock blocks the drive in its direction: the target follows
// the position until the axis is at standstill.
static uint8_t follow_switch_stop(unsigned n, enum home_step step) {
    struct homing* h = &homings[n];
    motion_set_target_to_position(n);
    h->sampled = axis_read_position(n, AXIS_POSITION);
    h->sampled_ms = clock_ms();
    return go(n, step);
}

// running, ok at standstill, or not_settled.
static uint8_t at_standstill(unsigned n) {
    struct homing* h = &homings[n];
    motion_set_target_to_position(n);
    if (motion_overdue(n)) return BUS_CAUSE_NOT_SETTLED;
    if (clock_ms() - h->sampled_ms < STANDSTILL_MS) return BUS_CAUSE_RUNNING;
    int64_t position = axis_read_position(n, AXIS_POSITION), moved = position - h->sampled;
    h->sampled = position;
    h->sampled_ms = clock_ms();
    return moved < STANDSTILL_DISTANCE && moved > -STANDSTILL_DISTANCE ? BUS_CAUSE_OK
                                                                       : BUS_CAUSE_RUNNING;
}

// Selects the directions in which the index is used; the user owns the other fields.
static void take_index(unsigned n, uint32_t directions) {
    uint32_t other =
        feedback_read(n, FEEDBACK_INDEX) & ~(FEEDBACK_INDEX_UP_MASK | FEEDBACK_INDEX_DOWN_MASK);
    feedback_write(n, FEEDBACK_INDEX, other | directions);
}

// Only the direction of the search counts: an axis at rest on the edge of its index may move back
// over it before it starts.
static void arm(unsigned n, bool up) {
    homings[n].up = up;
    homings[n].step = SEEK;
    take_index(n, up ? FEEDBACK_INDEX_UP_MASK : FEEDBACK_INDEX_DOWN_MASK);
    feedback_write(n, FEEDBACK_CAPTURE_SOURCES, CAPTURE_INDEX);
    feedback_write(n, FEEDBACK_STROBES,
                   FEEDBACK_STROBES_CAPTURE_CLEAR_MASK | FEEDBACK_STROBES_ARM_INDEX_MASK);
}

static uint8_t seek(unsigned n, bool up, int64_t distance) {
    homings[n].sampled = axis_read_position(n, AXIS_POSITION);
    arm(n, up);
    return drive(n, SEEK, up ? distance : -distance, BUS_PARAMETER_HOMING_SEARCH_SPEED);
}

void homing_disarm(unsigned n) {
    if (homings[n].step != SEEK && homings[n].step != SEEK_CAUGHT) return;
    homings[n].step = MET;
    feedback_write(n, FEEDBACK_CAPTURE_SOURCES, 0);
    feedback_write(n, FEEDBACK_STROBES, FEEDBACK_STROBES_CAPTURE_CLEAR_MASK);
    take_index(n, FEEDBACK_INDEX_UP_MASK | FEEDBACK_INDEX_DOWN_MASK);
}

static uint8_t not_met(unsigned n) {
    struct homing* h = &homings[n];
    if (method_of(n) != S3_METHOD || h->second) return BUS_CAUSE_NO_INDEX;
    h->second = true;
    return seek(n, false, 2 * distance_of(n));
}

// The axis is at standstill. Its origin moves so that `zero_position` becomes home_offset.
static void zero(unsigned n) {
    struct homing* h = &homings[n];
    int32_t periods = (int32_t)((h->zero_position + 32768) >> 16), quarters = 0;
    if (parameters_get(n, BUS_PARAMETER_POSITION_SOURCE) != 0) {
        int32_t counts = (int32_t)((h->zero_position + 8192) >> 14);
        quarters = counts - 4 * periods;  // -2 .. 2
    }
    h->phase = (int32_t)(h->zero_position - (int64_t)periods * 65536 - quarters * 16384);
    if (quarters) feedback_write(n, FEEDBACK_ALIGN, (uint32_t)-quarters);
    h->zero = (int32_t)parameters_get(n, BUS_PARAMETER_HOME_OFFSET);
    axis_write(n, AXIS_SHIFT_ORIGIN, (uint32_t)(h->zero - periods));
    if (quarters) motion_set_target_to_position(n);
}

uint8_t homing_begin(unsigned n) {
    struct homing* h = &homings[n];
    int64_t method = method_of(n), search = distance_of(n);
    int64_t low = parameters_get(n, BUS_PARAMETER_TRAVEL_LOW),
            high = parameters_get(n, BUS_PARAMETER_TRAVEL_HIGH);
    uint8_t begun;
    h->second = false;
    switch (method) {
    case 35:
    case 37:
        h->zero_position = axis_read_position(n, AXIS_POSITION);
        zero(n);
        begun = go(n, SECOND_SETTLE);
        break;
    case 33:
    case 34:
    case S3_METHOD: begun = seek(n, method != 33, search); break;
    default:
        if (high > low) search += high - low;
        if (search > LONGEST_SEARCH) search = LONGEST_SEARCH;
        begun =
            home_pressed(n, axis_read(n, AXIS_STATE))
                ? follow_switch_stop(n, CATCH)
                : drive(n, APPROACH, towards_switch(n, search), BUS_PARAMETER_HOMING_SEARCH_SPEED);
        break;
    }
    return begun == BUS_CAUSE_RUNNING ? BUS_CAUSE_OK : begun;
}

static uint8_t opened(unsigned n) {
    struct homing* h = &homings[n];
    if (method_of(n) == 1 || method_of(n) == 2) {  // continue, now searching the index
        arm(n, !at_high_end(n));
        return BUS_CAUSE_RUNNING;
    }
    // The switch has opened between two polls: in the middle between their positions, on average.
    h->zero_position = (h->sampled + axis_read_position(n, AXIS_POSITION)) >> 1;
    motion_controlled_stop(n);
    return go(n, RELEASE);
}

static uint8_t released(unsigned n) {
    struct homing* h = &homings[n];
    if (method_of(n) != S0_METHOD) return go(n, FIRST_SETTLE);
    h->zero_position -= towards_switch(n, distance_of(n));
    return drive(n, DEPART, h->zero_position - axis_read_position(n, AXIS_TARGET),
                 BUS_PARAMETER_HOMING_SEARCH_SPEED);
}

static uint8_t seek_poll(unsigned n, uint32_t state) {
    struct homing* h = &homings[n];
    if (FIELD_GET(feedback_read(n, FEEDBACK_CAPTURE_STATE), FEEDBACK_CAPTURE_STATE_PRESENT)) {
        h->zero_position = (int64_t)(feedback_read_wide(n, FEEDBACK_CAPTURED_POSITION) << 16) >> 16;
        homing_disarm(n);
        motion_controlled_stop(n);
        return go(n, MET);
    }
    if (state & (h->up ? AXIS_STATE_LIMIT_HIGH_MASK : AXIS_STATE_LIMIT_LOW_MASK))
        return follow_switch_stop(n, SEEK_CAUGHT);
    return motion_played(n) ? not_met(n) : BUS_CAUSE_RUNNING;
}

uint8_t homing_poll(unsigned n, uint32_t state) {
    struct homing* h = &homings[n];
    int64_t distance = distance_of(n), target = axis_read_position(n, AXIS_TARGET);
    uint8_t caught;

    switch (h->step) {
    case APPROACH:
        if (home_pressed(n, state)) return follow_switch_stop(n, CATCH);
        return motion_played(n) ? BUS_CAUSE_NO_SWITCH : BUS_CAUSE_RUNNING;
    case CATCH:
        caught = at_standstill(n);
        if (caught != BUS_CAUSE_OK) return caught;
        if (home_pressed(n, state))
            return drive(n, LEAVE, -towards_switch(n, distance), BUS_PARAMETER_HOMING_LATCH_SPEED);
        return drive(n, APPROACH, towards_switch(n, distance),
                     BUS_PARAMETER_HOMING_LATCH_SPEED);  // bounced off
    case LEAVE:
        if (!home_pressed(n, state)) return opened(n);
        h->sampled = axis_read_position(n, AXIS_POSITION);
        return motion_played(n) ? BUS_CAUSE_SWITCH_STUCK : BUS_CAUSE_RUNNING;
    case RELEASE: return motion_played(n) ? released(n) : BUS_CAUSE_RUNNING;
    case DEPART: return motion_played(n) ? go(n, FIRST_SETTLE) : BUS_CAUSE_RUNNING;
    case SEEK: return seek_poll(n, state);
    case SEEK_CAUGHT:
        caught = at_standstill(n);
        return caught == BUS_CAUSE_OK ? not_met(n) : caught;
    case MET:
        if (!motion_played(n)) return BUS_CAUSE_RUNNING;
        if (method_of(n) != S3_METHOD || (h->up && h->zero_position - h->sampled >= CLEAR_DISTANCE))
            return go(n, FIRST_SETTLE);
        distance /= 8;
        if (distance < 2 * CLEAR_DISTANCE) distance = 2 * CLEAR_DISTANCE;
        return drive(n, RETURN, h->zero_position - distance - target,
                     BUS_PARAMETER_HOMING_SEARCH_SPEED);
    case RETURN:
        return motion_played(n) ? seek(n, true, 2 * (h->zero_position - target))
                                : BUS_CAUSE_RUNNING;
    case FIRST_SETTLE:
        caught = motion_settle(n, true, settle_window(n));
        if (caught != BUS_CAUSE_OK) return caught;
        zero(n);
        if (method_of(n) == 17 || method_of(n) == 18) return BUS_CAUSE_OK;
        return drive(n, ZERO,
                     parameters_get(n, BUS_PARAMETER_HOME_OFFSET) * 65536 -
                         axis_read_position(n, AXIS_TARGET),
                     BUS_PARAMETER_HOMING_LATCH_SPEED);
    case ZERO: return motion_played(n) ? go(n, SECOND_SETTLE) : BUS_CAUSE_RUNNING;
    default: return motion_settle(n, true, settle_window(n));
    }
}

int32_t homing_phase(unsigned n) { return homings[n].phase; }

int32_t homing_zero(unsigned n) { return homings[n].zero; }

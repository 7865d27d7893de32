// SPDX-License-Identifier: Apache-2.0
// stream -- turns set-points into pieces of constant jerk.
//
// In each tick the player adds: target += v, v += a, a += j. So a piece of T ticks from velocity v
// goes  v T + a pairs(T) + j triples(T)  and ends at the velocity  v + a T + j pairs(T). Two
// equations give a and j. Both are rounded to whole units, j first; a then takes up the error of
// the distance. What remains is known exactly, and the next piece begins there. The player outputs
// the mean of two ticks, which is half a tick ahead: the end of a piece is half a tick behind its
// set-point (docs/stream.md has the formulae).
//
// The last ticks of each set-point are a piece of their own. When the player begins it and nothing
// waits behind it, the next set-point is late: the motion continues at its velocity, a piece of
// that length at a time, until late_limit is used up.
#include "bus/stream.h"

#include <stdbool.h>

#include "axis/axis.h"
#include "axis/motion.h"
#include "axis/parameters.h"
#include "bus/bus.h"
#include "core/arithmetic.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "planner/plan.h"

#define PIECES 2u  // of a set-point
#define FARTHEST \
    ((int64_t)1 << 32)     // 2^-16 period between two set-points: all products fit into 64 bits
#define TAIL_MORE 4u       // ticks of the last piece beyond the longest time without a poll
#define LONGEST_TAIL 200u  // ticks of a piece that can be measured

static struct stream {
    bool open;
    bool complete;             // the last set-point is queued
    uint16_t late_limit;       // ticks
    uint16_t late_ticks;       // extrapolated since the last set-point
    uint32_t tick;             // where the queue ends, since the start
    int64_t base;              // position of the last set-point, 2^-16 period
    struct planner_state end;  // of the queue; `moved` is the distance from base
    uint32_t accepted, late, extrapolated;
} streams[HARDWARE_AXES];

static uint32_t tail_ticks(void) {
    return (uint32_t)least(motion_busy_ticks() + TAIL_MORE, LONGEST_TAIL);
}

static void push(unsigned n, struct planner_progress* at, uint32_t ticks, bool last) {
    const struct planner_segment piece = {at->state.velocity, at->state.acceleration,
                                          (int32_t)at->jerk, ticks};
    motion_stream(n, &piece, last, streams[n].base);
    plan_advance(at, ticks);
}

// A stream ends with the motion of its axis, in whatever way.
static bool is_open(unsigned n) {
    const uint8_t state = axis_state(n);
    if (state != BUS_STATE_PREPARED && state != BUS_STATE_MOVING) streams[n].open = false;
    return streams[n].open;
}

// Continues a stream whose next set-point is late.
static void feed(unsigned n) {
    struct stream* s = &streams[n];
    const uint32_t tail = tail_ticks();
    if (!is_open(n) || s->complete || axis_state(n) == BUS_STATE_PREPARED) return;
    if (motion_room(n) == 0 || motion_queued(n) + TAIL_MORE > tail) return;
    if (s->late_ticks + tail > s->late_limit) {
        s->open = false;
        axis_break_off(n, BUS_CAUSE_SET_POINT_LATE);
        return;
    }
    struct planner_progress at = {.state = s->end};
    at.state.acceleration = 0;
    push(n, &at, tail, false);
    s->end = at.state;
    s->tick += tail;
    s->late_ticks = (uint16_t)(s->late_ticks + tail);
    s->extrapolated += tail;
}

static uint8_t begin_stream(unsigned n) {
    const uint32_t late_limit = (uint32_t)bus_request_field(BUS_BEGIN_STREAM_REQUEST_LATE_LIMIT, 2);
    const int64_t base = axis_read_position(n, AXIS_TARGET);
    uint32_t ticks;
    if (late_limit > BUS_STREAM_LATEST) return BUS_CAUSE_OUT_OF_RANGE;
    const uint8_t cause = axis_prepare(n, base, &ticks);  // a motion of no distance
    if (cause != BUS_CAUSE_OK) return cause;
    streams[n] = (struct stream){.open = true, .late_limit = (uint16_t)late_limit, .base = base};
    return BUS_CAUSE_OK;
}

// Whether a piece keeps inside the limits. Its acceleration is largest at an end, its velocity at
// an end or where the acceleration changes its sign.
static bool within(const struct planner_limits* limits, const struct planner_progress* at,
                   uint32_t ticks) {
    const uint64_t velocity = limits->velocity + (limits->velocity >> BUS_STREAM_TOLERANCE),
                   acceleration =
                       limits->acceleration + (limits->acceleration >> BUS_STREAM_TOLERANCE);
    const int64_t first = at->state.acceleration, last = first + at->jerk * (ticks - 1);
    if (size(first) > acceleration || size(last) > acceleration) return false;
    if ((first < 0) == (last < 0)) return true;
    struct planner_progress peak = *at;
    plan_advance(&peak, (uint32_t)(size(first) / size(at->jerk)) + 1);
    return size(peak.state.velocity) <= velocity;
}

static uint8_t set_point(unsigned n) {
    struct stream* s = &streams[n];
    const uint32_t last = (uint32_t)bus_request_field(BUS_SET_POINT_REQUEST_LAST, 1),
                   tick = (uint32_t)bus_request_field(BUS_SET_POINT_REQUEST_TICK, 4),
                   ticks = tick - s->tick, tail = tail_ticks();
    const int64_t position = (int64_t)bus_request_field(BUS_SET_POINT_REQUEST_POSITION, 8),
                  velocity = (int64_t)bus_request_field(BUS_SET_POINT_REQUEST_VELOCITY, 8);
    axis_poll(n);
    if (!is_open(n) || s->complete) return BUS_CAUSE_NO_STREAM;
    if (last > 1) return BUS_CAUSE_OUT_OF_RANGE;
    if (position < parameters_get(n, BUS_PARAMETER_TRAVEL_LOW) ||
        position > parameters_get(n, BUS_PARAMETER_TRAVEL_HIGH))
        return BUS_CAUSE_OUT_OF_TRAVEL;
    if ((int32_t)ticks < (int32_t)BUS_STREAM_SHORTEST) {
        s->late++;
        return BUS_CAUSE_SET_POINT_LATE;
    }
    if (ticks > BUS_STREAM_LONGEST) return BUS_CAUSE_OUT_OF_RANGE;
    if (motion_room(n) < PIECES) return BUS_CAUSE_QUEUE_FULL;

    const struct planner_limits limits = parameters_limits(n, BUS_PARAMETER_VELOCITY);
    const int64_t gap = position - s->base;
    if ((last && velocity) || size(velocity) > limits.velocity || size(gap) > FARTHEST)
        return BUS_CAUSE_SET_POINT_LIMITS;
    struct planner_progress at = {.state = s->end};
    const int64_t change = velocity - at.state.velocity,
                  more = gap * (1 << 24) - (velocity >> 1) - (int64_t)at.state.moved -
                         at.state.velocity * ticks;  // distance beyond that at constant velocity
    at.jerk = ratio(6 * (change * (ticks - 1) - 2 * more), 0, ticks * (ticks * ticks - 1));
    if ((int32_t)at.jerk != at.jerk) return BUS_CAUSE_SET_POINT_LIMITS;
    at.state.acceleration = ratio(more - at.jerk * (int64_t)triples(ticks), 0, pairs(ticks));
    if (!within(&limits, &at, ticks)) return BUS_CAUSE_SET_POINT_LIMITS;

    s->base = position;
    if (ticks > tail) push(n, &at, ticks - tail, false);
    push(n, &at, ticks > tail ? tail : ticks, last);
    at.state.moved -= (uint64_t)gap << 24;
    s->end = at.state;
    s->tick = tick;
    s->late_ticks = 0;
    s->complete = last;
    s->accepted++;
    bus_reply_field(BUS_SET_POINT_REPLY_ROOM, motion_room(n) / PIECES, 1);
    return BUS_CAUSE_OK;
}

static uint8_t state(unsigned n) {
    const struct stream* s = &streams[n];
    axis_poll(n);
    bus_reply_field(BUS_STREAM_REPLY_OPEN, is_open(n), 1);
    bus_reply_field(BUS_STREAM_REPLY_ROOM, motion_room(n) / PIECES, 1);
    bus_reply_field(BUS_STREAM_REPLY_QUEUED, motion_queued(n), 2);
    bus_reply_field(BUS_STREAM_REPLY_END, s->tick, 4);
    bus_reply_field(BUS_STREAM_REPLY_ACCEPTED, s->accepted, 4);
    bus_reply_field(BUS_STREAM_REPLY_LATE, s->late, 4);
    bus_reply_field(BUS_STREAM_REPLY_EXTRAPOLATED, s->extrapolated, 4);
    return BUS_CAUSE_OK;
}

void stream_start(unsigned axes) {
    for (unsigned n = 0; n < axes; n++) streams[n].open = false;
    motion_set_stream(feed);
}

uint8_t stream_operation(uint8_t operation) {
    unsigned axis = (unsigned)bus_request_field(BUS_REQUEST_HEAD, 1);
    switch (operation) {
    case BUS_OPERATION_BEGIN_STREAM: return begin_stream(axis);
    case BUS_OPERATION_SET_POINT: return set_point(axis);
    case BUS_OPERATION_STREAM: return state(axis);
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

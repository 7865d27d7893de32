// SPDX-License-Identifier: Apache-2.0
// motion -- one motion at a time of an axis.
//
// What is in the queue of the player cannot be taken back when the target changes. So the queue is
// filled only as far as needed: for QUEUED_MS, plus the longest time between two calls of
// motion_feed. Its fill is measured by the duration of the pieces, since pieces may be short.
#include "axis/motion.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"
#include "planner/plan.h"
#include "planner/planner.h"

#define PIECE_TICKS 128u      // longest piece: 32 ms
#define QUEUE 16u             // pieces that the player can queue
#define QUEUED_MS 16u         // least duration of the queue
#define BUSY_KILOCYCLES 150u  // longest time between two calls of motion_feed

// Time to plan another target: the first try, and a second if the first was too short.
static const uint16_t plan_kilocycles[] = {300, 800};

static struct motion {
    struct plan plan;
    int64_t from, to;       // target when the plan began, and at its end
    uint8_t queued[QUEUE];  // ticks of the last pieces that were queued
    uint8_t pieces;         // number of pieces queued so far
    bool follows;           // set_point_player plays it, and its end is not known
    bool inside;            // the error has been inside the window since inside_ms
    uint32_t inside_ms;
    uint32_t since_ms;  // start of settling
} motions[HARDWARE_AXES];

// The plan to another target. It replaces the plan in flight at the tick `join` of that plan.
static struct {
    struct plan plan;
    unsigned axis;
    uint32_t join;  // 0: there is no other plan
    bool ready;     // it has been planned
} next;

static void (*stream_feed)(unsigned n);  // null without a stream in this image

static bool joins(unsigned n) { return next.join && next.axis == n; }

static void discard_plan(unsigned n) {
    motions[n].plan.next = motions[n].plan.count;
    if (joins(n)) next.join = 0;
}

void motion_set_target_to_position(unsigned n) {
    discard_plan(n);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_SET_TARGET_TO_POSITION_MASK);
}

void motion_controlled_stop(unsigned n) {
    discard_plan(n);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_CONTROLLED_STOP_MASK);
}

static uint32_t ticks_of(uint32_t kilocycles) {
    return PLANNER_TICK_HZ * kilocycles / (node_read(NODE_CLK_HZ) / 1000u);
}

static bool at_join(unsigned n) { return joins(n) && motions[n].plan.at.tick == next.join; }

static void queue(unsigned n, const struct planner_segment* piece, bool last) {
    struct motion* m = &motions[n];
    m->queued[m->pieces++ % QUEUE] = (uint8_t)piece->ticks;
    axis_write_wide(n, AXIS_SEGMENT_VELOCITY, (uint64_t)piece->velocity);
    axis_write_wide(n, AXIS_SEGMENT_ACCELERATION, (uint64_t)piece->acceleration);
    axis_write(n, AXIS_SEGMENT_JERK, (uint32_t)piece->jerk);
    axis_write(n, AXIS_SEGMENT_TICKS, piece->ticks | (last ? AXIS_SEGMENT_TICKS_LAST_MASK : 0));
}

// Queues the next piece of the plan; the queue must have room. Returns its ticks, or 0 when nothing
// is left.
static uint32_t push(unsigned n) {
    struct motion* m = &motions[n];
    struct planner_segment piece;
    bool last;
    uint32_t longest = PIECE_TICKS;
    if (at_join(n)) {
        if (next.ready) m->plan = next.plan;
        next.join = 0;
    }
    if (joins(n) && next.join - m->plan.at.tick < longest) longest = next.join - m->plan.at.tick;
    if (!planner_take_up_to(&m->plan, &piece, &last, longest)) return 0;
    queue(n, &piece, last);
    return piece.ticks;
}

uint32_t motion_room(unsigned n) {
    return FIELD_GET(axis_read(n, AXIS_STATE), AXIS_STATE_QUEUE_FREE);
}

static uint32_t queued_ticks(const struct motion* m, uint32_t pieces) {
    uint32_t ticks = 0;
    for (uint32_t piece_back = 1; piece_back <= pieces; piece_back++)
        ticks += m->queued[(m->pieces - piece_back) % QUEUE];
    return ticks;
}

uint32_t motion_queued(unsigned n) { return queued_ticks(&motions[n], QUEUE - motion_room(n)); }

uint32_t motion_busy_ticks(void) { return ticks_of(BUSY_KILOCYCLES); }

void motion_set_stream(void (*feed)(unsigned n)) { stream_feed = feed; }

void motion_stream(unsigned n, const struct planner_segment* piece, bool last, int64_t to) {
    motions[n].to = to;
    queue(n, piece, last);
}

void motion_feed(unsigned n) {
    struct motion* m = &motions[n];
    if (m->plan.next >= m->plan.count) {
        if (stream_feed) stream_feed(n);
        return;
    }
    uint32_t pieces = QUEUE - motion_room(n), ticks = queued_ticks(m, pieces);
    uint32_t most = PLANNER_TICK_HZ / 1000u * QUEUED_MS + motion_busy_ticks();
    for (uint32_t more = 1; more && pieces < QUEUE; pieces++) {
        if (!joins(n) && ticks >= most) break;
        // Near the join, wait for the new plan while half of the queue is left.
        if (at_join(n) && !next.ready && ticks >= most / 2) break;
        ticks += more = push(n);
    }
}

static void feed_all(void) {
    for (unsigned n = 0; n < HARDWARE_AXES; n++) motion_feed(n);
}

static uint8_t refusal(const struct plan* plan) {
    switch (plan->cause) {
    case PLANNER_TOO_LONG: return BUS_CAUSE_TOO_LONG;
    case PLANNER_BORDERS:
    case PLANNER_TOO_MANY_LEVELS: return BUS_CAUSE_STEPPED_PROFILE_INVALID;
    case PLANNER_STEPPED: return BUS_CAUSE_BUSY;
    default: return BUS_CAUSE_OUT_OF_RANGE;
    }
}

uint8_t motion_prepare(unsigned n, int64_t distance, uint8_t velocity_id) {
    struct plan* plan = &motions[n].plan;
    bool planned;
    motions[n].follows = false;
    motions[n].from = axis_read_position(n, AXIS_TARGET);
    motions[n].to = motions[n].from + distance;
    if (parameters_get(n, BUS_PARAMETER_PROFILE) == STEPPED) {
        struct planner_stepped_profile stepped = parameters_stepped_profile(n, velocity_id);
        planned = planner_stepped_move(plan, &stepped, distance);
    } else {
        struct planner_limits limits = parameters_limits(n, velocity_id);
        planned = planner_move(plan, &limits, distance);
    }
    if (!planned) return refusal(plan);
    motion_feed(n);
    return BUS_CAUSE_OK;
}

// The new plan joins the old one so far ahead that the old one can be fed while the new one is
// planned. If the planning took longer, it is tried again with more time.
uint8_t motion_retarget(unsigned n, int64_t target, uint8_t velocity_id) {
    const struct plan* old = &motions[n].plan;
    const struct planner_limits limits = parameters_limits(n, velocity_id);
    if (next.join) return BUS_CAUSE_BUSY;
    for (unsigned trial = 0; trial < sizeof plan_kilocycles / sizeof plan_kilocycles[0]; trial++) {
        const uint32_t ticks = ticks_of(plan_kilocycles[trial]), join = old->at.tick + ticks;
        if (old->stepped || old->next >= old->count || join >= old->ticks) break;
        next.axis = n;
        next.join = join;
        next.ready = false;
        if (!planner_retarget(&next.plan, old, ticks, &limits, target - motions[n].from,
                              feed_all)) {
            next.join = 0;
            return refusal(&next.plan);
        }
        if (next.join == 0) continue;  // the old plan was fed beyond the join
        next.ready = true;
        motions[n].to = target;
        motion_feed(n);
        return BUS_CAUSE_OK;
    }
    return BUS_CAUSE_BUSY;
}

void motion_start(unsigned n) { axis_write(n, AXIS_STROBES, AXIS_STROBES_START_MASK); }

uint8_t motion_play(unsigned n, int64_t distance, uint8_t velocity_id) {
    uint8_t cause = motion_prepare(n, distance, velocity_id);
    if (cause == BUS_CAUSE_OK) motion_start(n);
    return cause;
}

bool motion_played(unsigned n) {
    const struct plan* plan = &motions[n].plan;
    return plan->next >= plan->count && !(axis_read(n, AXIS_STATE) & AXIS_STATE_MOVING_MASK);
}

uint32_t motion_ticks(unsigned n) { return motions[n].plan.ticks; }

bool motion_inside(unsigned n, int64_t window) {
    int64_t error = (int32_t)axis_read(n, AXIS_FOLLOWING_ERROR);
    return error <= window && error >= -window;
}

void motion_follow(unsigned n) { motions[n].follows = true; }

bool motion_follows(unsigned n) { return motions[n].follows; }

bool motion_complete(unsigned n) {
    return motions[n].follows || axis_read_position(n, AXIS_TARGET) == motions[n].to;
}

void motion_settle_begin(unsigned n) {
    motions[n].inside = false;
    motions[n].since_ms = clock_ms();
}

bool motion_overdue(unsigned n) {
    return clock_ms() - motions[n].since_ms >=
           (uint32_t)parameters_get(n, BUS_PARAMETER_SETTLE_TIMEOUT);
}

uint8_t motion_settle(unsigned n, bool held, int64_t window) {
    struct motion* m = &motions[n];
    uint32_t now = clock_ms();
    bool inside = held && motion_inside(n, window);
    if (inside && !m->inside) m->inside_ms = now;
    m->inside = inside;
    if (inside && now - m->inside_ms >= (uint32_t)parameters_get(n, BUS_PARAMETER_SETTLE_TIME))
        return BUS_CAUSE_OK;
    return motion_overdue(n) ? BUS_CAUSE_NOT_SETTLED : BUS_CAUSE_RUNNING;
}

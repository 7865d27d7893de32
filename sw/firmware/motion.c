// SPDX-License-Identifier: Apache-2.0
// motion -- one motion at a time of an axis.
#include "motion.h"

#include "clock.h"
#include "hardware.h"
#include "line_protocol.h"
#include "parameters.h"
#include "planner.h"

#define PIECE_TICKS 128u        // 32 ms
#define QUEUE 16u
#define QUEUED_MS 16u           // What is queued cannot be taken back when the target changes, so it is kept short: this, and what
#define BUSY_KCLK 900u          // the firmware may be busy with before it looks here again. Pieces are short too where a move begins:
                                // it is time that counts.

static struct motion {
    struct plan plan;
    int64_t from;               // target when the plan began
    uint8_t queued[QUEUE];      // ticks of the pieces queued last
    uint8_t pieces;             // queued so far
    bool inside;                // the error has been inside the window since inside_ms
    uint32_t inside_ms;
    uint32_t since_ms;          // start of settling
} motions[HARDWARE_AXES];

static void forget(struct plan *plan)
{
    plan->next = plan->count;
}

void motion_hold_here(unsigned n)
{
    forget(&motions[n].plan);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_HOLD_HERE_MASK);
}

void motion_brake(unsigned n)
{
    forget(&motions[n].plan);
    axis_write(n, AXIS_STROBES, AXIS_STROBES_BRAKE_MASK);
}

static uint32_t queued_ticks(void)
{
    return PLANNER_TICK_HZ / 1000u * (QUEUED_MS + BUSY_KCLK * 1000u / (node_read(NODE_CLK_HZ) / 1000u));
}

void motion_feed(unsigned n)
{
    struct motion *m = &motions[n];
    struct planner_segment piece;
    bool last;
    if (m->plan.next >= m->plan.count) return;
    uint32_t waiting = QUEUE - FIELD_GET(axis_read(n, AXIS_STATE), AXIS_STATE_QUEUE_FREE), ticks = 0, most = queued_ticks();
    for (uint32_t piece_back = 1; piece_back <= waiting; piece_back++) ticks += m->queued[(m->pieces - piece_back) % QUEUE];
    while (waiting++ < QUEUE && ticks < most && planner_take_up_to(&m->plan, &piece, &last, PIECE_TICKS)) {
        m->queued[m->pieces++ % QUEUE] = (uint8_t)piece.ticks;
        ticks += piece.ticks;
        axis_write_wide(n, AXIS_SEGMENT_VELOCITY, (uint64_t)piece.velocity);
        axis_write_wide(n, AXIS_SEGMENT_ACCELERATION, (uint64_t)piece.acceleration);
        axis_write(n, AXIS_SEGMENT_JERK, (uint32_t)piece.jerk);
        axis_write(n, AXIS_SEGMENT_TICKS, piece.ticks | (last ? AXIS_SEGMENT_TICKS_LAST_MASK : 0));
    }
}

static uint8_t refusal(const struct plan *plan)
{
    switch (plan->cause) {
    case PLANNER_TOO_LONG: return LINE_CAUSE_TOO_LONG;
    case PLANNER_BORDERS:
    case PLANNER_TOO_MANY_STAIRS: return LINE_CAUSE_NO_STAIRS;
    case PLANNER_ON_STAIRS: return LINE_CAUSE_BUSY;
    default: return LINE_CAUSE_OUT_OF_RANGE;
    }
}

uint8_t motion_prepare(unsigned n, int64_t distance, uint8_t velocity_id)
{
    struct plan *plan = &motions[n].plan;
    bool planned;
    motions[n].from = axis_read_position(n, AXIS_TARGET);
    if (parameters_get(n, LINE_PARAMETER_PROFILE) == STAIRS) {
        struct planner_stairs stairs = parameters_stairs(n, velocity_id);
        planned = planner_climb(plan, &stairs, distance);
    } else {
        struct planner_limits limits = parameters_limits(n, velocity_id);
        planned = planner_move(plan, &limits, distance);
    }
    if (!planned) return refusal(plan);
    motion_feed(n);
    return LINE_CAUSE_OK;
}

uint8_t motion_retarget(unsigned n, int64_t target, uint8_t velocity_id)
{
    struct motion *m = &motions[n];
    struct planner_limits limits = parameters_limits(n, velocity_id);
    if (m->plan.next >= m->plan.count) return LINE_CAUSE_BUSY;
    return planner_retarget(&m->plan, &limits, target - m->from) ? LINE_CAUSE_OK : refusal(&m->plan);
}

void motion_start(unsigned n)
{
    axis_write(n, AXIS_STROBES, AXIS_STROBES_START_MASK);
}

uint8_t motion_play(unsigned n, int64_t distance, uint8_t velocity_id)
{
    uint8_t cause = motion_prepare(n, distance, velocity_id);
    if (cause == LINE_CAUSE_OK) motion_start(n);
    return cause;
}

bool motion_played(unsigned n)
{
    const struct plan *plan = &motions[n].plan;
    return plan->next >= plan->count && !(axis_read(n, AXIS_STATE) & AXIS_STATE_MOVING_MASK);
}

uint32_t motion_ticks(unsigned n)
{
    return motions[n].plan.ticks;
}

bool motion_inside(unsigned n, int64_t window)
{
    int64_t error = (int32_t)axis_read(n, AXIS_FOLLOWING_ERROR);
    return error <= window && error >= -window;
}

void motion_settle_begin(unsigned n)
{
    motions[n].inside = false;
    motions[n].since_ms = clock_ms();
}

bool motion_overdue(unsigned n)
{
    return clock_ms() - motions[n].since_ms >= (uint32_t)parameters_get(n, LINE_PARAMETER_SETTLE_TIMEOUT);
}

uint8_t motion_settle(unsigned n, int64_t window)
{
    struct motion *m = &motions[n];
    uint32_t now = clock_ms();
    bool inside = motion_inside(n, window);
    if (inside && !m->inside) m->inside_ms = now;
    m->inside = inside;
    if (inside && now - m->inside_ms >= (uint32_t)parameters_get(n, LINE_PARAMETER_SETTLE_TIME)) return LINE_CAUSE_OK;
    return motion_overdue(n) ? LINE_CAUSE_NOT_SETTLED : LINE_CAUSE_RUNNING;
}

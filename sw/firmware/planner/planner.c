// SPDX-License-Identifier: Apache-2.0
// planner -- limits, motions from rest to rest, stepped profiles.
//
// The derivation is in docs/planner.md. In short: a motion is a pulse of jerk, its negative
// `acceleration` ticks later, and the negative of both `velocity` ticks later. Its distance is the
// product of the sum of the pulse and these two durations. The durations are chosen first; what the
// divisions leave over is added in single units, so that nothing is rounded.
#include "planner/planner.h"

#include "core/arithmetic.h"
#include "planner/plan.h"

#define ROOM 8u        // units of acceleration and jerk that are kept free for a retarget
#define ROOM_SHIFT 13  // 2^-13 of the velocity is kept free for it too
#define ROOM_JERK 1u   // unit that the remainder of a pulse adds to its jerk
#define LONGEST_RAMP 0x10000000u  // ticks
#define LONGEST_CRUISE_BITS 30    // of its ticks
#define MOST_LEVELS 4096u         // steps in a section of a stepped profile
#define OVERRIDE_PART 4u          // the override adds at most 1/4 of acceleration and jerk
#define LEAD 2u                   // ticks until a change of jerk is complete
#define LEFT_OUT 1u               // ticks at the start in which nothing moves

struct durations {          // ticks
    uint32_t jerk;          // of a pulse of jerk; >= 1
    uint32_t acceleration;  // from a pulse to its negative; >= jerk
    uint32_t velocity;      // from the first ramp to the second; >= jerk + acceleration
};

uint64_t planner_velocity(uint64_t velocity) {
    return (velocity << 19) / 125u;  // 2^24 / 4000   = 2^19 / 5^3
}

struct planner_limits planner_limits(uint32_t velocity, uint32_t acceleration, uint32_t jerk) {
    struct planner_limits limits;
    uint64_t wide_jerk = ((uint64_t)jerk << 25) / 1953125u;  // 2^40 / 4000^3 = 2^25 / 5^9
    limits.velocity = planner_velocity((uint64_t)velocity << 16);
    limits.acceleration = ((uint64_t)acceleration << 30) / 15625u;  // 2^40 / 4000^2 = 2^30 / 5^6
    limits.jerk = wide_jerk > INT32_MAX ? INT32_MAX : (uint32_t)wide_jerk;
    return limits;
}

void planner_feed_override(const struct planner_limits* limits, uint32_t* slope, uint32_t* curve) {
    // velocity slope <= acceleration / 4, and 3 acceleration slope + velocity curve <= jerk / 4, of
    // which each term gets half
    uint64_t steep = (uint64_t)ratio((int64_t)(limits->acceleration / OVERRIDE_PART), 32,
                                     limits->velocity | 1),
             bend = 0;
    if (limits->jerk != PLANNER_ANY_JERK) {
        const int64_t half = limits->jerk / (2 * OVERRIDE_PART);
        steep = least(steep, (uint64_t)ratio(half, 32, 3 * limits->acceleration | 1));
        bend = most((uint64_t)ratio(half, 32, limits->velocity | 1), 1);
    }
    *slope = (uint32_t)least(most(steep, 1), UINT32_MAX);
    *curve = (uint32_t)least(bend, UINT32_MAX);
}

// Saturates at UINT64_MAX.
static uint64_t saturated_product(uint64_t wide, uint32_t narrow) {
    uint64_t high = (wide >> 32) * narrow, low = (uint64_t)(uint32_t)wide * narrow,
             sum = (high << 32) + low;
    return high >> 32 || sum < low ? UINT64_MAX : sum;
}

// The largest velocity that ramps of these durations reach inside the limits.
static uint64_t peak_velocity(const struct planner_limits* limits, uint32_t jerk_ticks,
                              uint32_t acceleration_ticks) {
    uint64_t peak = saturated_product(limits->acceleration, acceleration_ticks);
    uint64_t by_jerk =
        saturated_product(saturated_product(limits->jerk, jerk_ticks), acceleration_ticks);
    if (limits->jerk != PLANNER_ANY_JERK && by_jerk < peak) peak = by_jerk;
    return limits->velocity < peak ? limits->velocity : peak;
}

// Whether a motion of these durations reaches `distance` inside the limits.
static bool reaches(const struct planner_limits* limits, const struct durations* d,
                    uint64_t distance) {
    uint64_t peak = peak_velocity(limits, d->jerk, d->acceleration);
    uint64_t high = (peak >> 32) * d->velocity, low = (uint64_t)(uint32_t)peak * d->velocity;
    return (high << 8) + (low >> 24) >= distance;  // 2^-40 to 2^-16 period
}

static void ramps_of(struct durations* d, uint32_t acceleration_ticks, uint32_t longest_jerk) {
    d->acceleration = acceleration_ticks;
    d->jerk = acceleration_ticks < longest_jerk ? acceleration_ticks : longest_jerk;
    d->velocity = d->acceleration + d->jerk;
}

// The shortest ramps to the limit of velocity.
static struct durations ramps_to_top(const struct planner_limits* limits) {
    struct durations d = {0, 0, 0};
    bool trapezoid = limits->jerk == PLANNER_ANY_JERK;
    uint64_t jerk = trapezoid ? 1 : ceiling(limits->acceleration, limits->jerk);
    uint64_t acceleration = ceiling(limits->velocity, limits->acceleration);
    if (acceleration < jerk) {  // it is reached before the limit of acceleration
        jerk = acceleration = root(ceiling(limits->velocity, limits->jerk) - 1) + 1ull;
    }
    ramps_of(&d, (uint32_t)least(acceleration, LONGEST_RAMP), (uint32_t)least(jerk, LONGEST_RAMP));
    return d;
}

// Takes single ticks away while the distance is still reached.
static void tighten(const struct planner_limits* limits, struct durations* d, uint64_t distance) {
    bool shorter = true;
    while (shorter) {
        shorter = false;
        for (int which = 0; which < 3; which++) {
            struct durations less = *d;
            if (which == 0) less.jerk--;
            if (which == 1) less.acceleration--;
            if (which == 2) less.velocity--;
            if (less.jerk == 0 || less.acceleration < less.jerk ||
                less.velocity < less.acceleration + less.jerk)
                continue;
            if (!reaches(limits, &less, distance)) continue;
            *d = less;
            shorter = true;
        }
    }
}

// Chooses the durations; false: the cruise is too long.
static bool choose_durations(const struct planner_limits* limits, struct durations* d,
                             uint64_t distance) {
    *d = ramps_to_top(limits);
    uint64_t top = peak_velocity(limits, d->jerk, d->acceleration);
    uint32_t shift = 24;  // so that dividend and divisor fit into 64 bits
    uint64_t divisor = top;
    while (divisor >> 32) divisor >>= 1, shift--;
    if (distance >> (LONGEST_CRUISE_BITS + 32 - shift)) return false;
    uint64_t cruise = (distance << shift) / divisor + 1;
    if (cruise >> LONGEST_CRUISE_BITS) return false;

    if (cruise >= (uint64_t)d->acceleration + d->jerk) {
        d->velocity = (uint32_t)cruise;
    } else {  // too short to reach the limit of velocity
        uint32_t low = 0, high = d->acceleration, longest_jerk = d->jerk;
        while (high - low > 1) {
            uint32_t middle = low + (high - low) / 2;
            ramps_of(d, middle, longest_jerk);
            if (reaches(limits, d, distance))
                high = middle;
            else
                low = middle;
        }
        ramps_of(d, high, longest_jerk);
    }
    tighten(limits, d, distance);
    return true;
}

// Whether the limits allow a motion.
static enum planner_cause check_limits(const struct planner_limits* limits) {
    if (limits->velocity == 0) return PLANNER_NO_VELOCITY;
    if (limits->acceleration == 0) return PLANNER_NO_ACCELERATION;
    if (limits->jerk <= ROOM_JERK) return PLANNER_NO_JERK;
    return PLANNER_OK;
}

// Adds an event of a change of jerk that begins at `instant`.
static void add_change(struct plan* plan, uint32_t instant, uint8_t slot, int64_t jerk) {
    if (jerk) plan_add(plan, instant + slot, (struct planner_event){.jerk = jerk, .slot = slot});
}

// Adds a pulse of jerk with this sum. Its edges are the steps 1/6, 4/6, 1/6 of a cubic B-spline.
static void pulse(struct plan* plan, uint32_t instant, int64_t sum, uint32_t ticks) {
    const int64_t sign = sum < 0 ? -1 : 1, jerk = sum / ticks, more = sum - jerk * ticks;
    const int64_t outer = sign * (int64_t)((size(jerk) + 5) / 6), inner = jerk - 2 * outer;
    if (ticks == 1) {
        const int64_t kick[] = {outer, inner - outer, outer - inner, -outer};
        for (uint8_t n = 0; n < 4; n++) add_change(plan, instant, n, kick[n]);
        return;
    }
    const int64_t steps[] = {outer, inner, outer};
    for (uint8_t n = 0; n < 3; n++) {
        add_change(plan, instant, n, steps[n]);
        add_change(plan, instant + ticks, n, -steps[n]);
    }
    if (more == 0) return;
    plan_add(plan, instant + LEAD, (struct planner_event){.jerk = sign, .slot = PLANNER_LANDING});
    plan_add(plan, instant + LEAD + (uint32_t)size(more),
             (struct planner_event){.jerk = -sign, .slot = PLANNER_LANDING});
}

// Adds single units of acceleration or velocity for a number of ticks.
static void units(struct plan* plan, uint32_t instant, int8_t acceleration, int8_t velocity,
                  uint32_t ticks) {
    if (ticks == 0) return;
    plan_add(plan, instant,
             (struct planner_event){
                 .acceleration = acceleration, .velocity = velocity, .slot = PLANNER_LANDING});
    plan_add(plan, instant + ticks,
             (struct planner_event){.acceleration = (int8_t)-acceleration,
                                    .velocity = (int8_t)-velocity,
                                    .slot = PLANNER_LANDING});
}

// Removes the first ticks of a plan, in which nothing moves.
static void remove_start(struct plan* plan, uint32_t ticks) {
    struct planner_segment piece;
    bool last;
    while (plan->at.tick < ticks) planner_take_up_to(plan, &piece, &last, ticks - plan->at.tick);
    for (uint32_t n = plan->next; n < plan->count; n++) plan->event[n].tick -= ticks;
    plan->ticks -= ticks;
    plan->at.tick = 0;
}

// Units that are kept free for a retarget; none of a small limit.
static uint64_t room(uint64_t limit) { return least(limit >> 20, ROOM); }

bool planner_move(struct plan* plan, const struct planner_limits* limits, int64_t distance) {
    struct planner_limits inner = {limits->velocity - (limits->velocity >> ROOM_SHIFT),
                                   limits->acceleration - room(limits->acceleration), limits->jerk};
    struct durations d;
    const int8_t sign = distance < 0 ? -1 : 1;
    const uint64_t length = size(distance);
    const enum planner_cause cause = check_limits(limits);

    plan_clear(plan);
    if (cause) return plan_refuse(plan, cause);
    if (length == 0) return true;
    if (inner.jerk != PLANNER_ANY_JERK) inner.jerk -= ROOM_JERK + (uint32_t)room(limits->jerk);
    if (!choose_durations(&inner, &d, length)) return plan_refuse(plan, PLANNER_TOO_LONG);

    // length 2^24 = velocity d.velocity + more_velocity, velocity = acceleration d.acceleration +
    // more_acceleration, and pulse() does the same with the jerk
    const uint64_t whole = length / d.velocity, remainder = (length - whole * d.velocity) << 24,
                   part = remainder / d.velocity;
    const uint64_t velocity = (whole << 24) + part;
    const uint32_t more_velocity = (uint32_t)(remainder - part * d.velocity);
    const uint64_t acceleration = velocity / d.acceleration;
    const uint32_t more_acceleration = (uint32_t)(velocity - acceleration * d.acceleration);
    const int64_t sum = sign * (int64_t)acceleration;
    plan->ticks = d.velocity + d.acceleration + d.jerk + LEAD;
    pulse(plan, 0, sum, d.jerk);
    pulse(plan, d.acceleration, -sum, d.jerk);
    pulse(plan, d.velocity, -sum, d.jerk);
    pulse(plan, d.velocity + d.acceleration, sum, d.jerk);
    units(plan, LEAD, sign, 0, more_acceleration);
    units(plan, LEAD + d.velocity, (int8_t)-sign, 0, more_acceleration);
    units(plan, LEAD, 0, sign, more_velocity);
    plan_add(plan, plan->ticks, (struct planner_event){.slot = PLANNER_LANDING});
    remove_start(plan, LEFT_OUT);
    return true;
}

void planner_stepped_borders(struct planner_stepped_profile* stepped, uint32_t second,
                             uint32_t third) {
    const int64_t climb = (int64_t)(stepped->top - stepped->first);
    stepped->border[0] = stepped->first + (uint64_t)product(climb, second, 16);
    stepped->border[1] = stepped->first + (uint64_t)product(climb, third, 16);
}

bool planner_stepped_move(struct plan* plan, const struct planner_stepped_profile* stepped,
                          int64_t distance) {
    int64_t sign = distance < 0 ? -1 : 1;
    uint64_t left = size(distance), velocity = stepped->first;
    struct planner_segment up[3];
    int sections = 0;

    plan_clear(plan);
    plan->stepped = true;
    if (stepped->first == 0 || stepped->ticks == 0) return plan_refuse(plan, PLANNER_NO_VELOCITY);
    if (stepped->top < stepped->first || stepped->border[0] < stepped->first ||
        stepped->border[1] < stepped->border[0] || stepped->top < stepped->border[1] ||
        !stepped->rise[0] || !stepped->rise[1] || !stepped->rise[2])
        return plan_refuse(plan, PLANNER_BORDERS);
    if (left == 0) return true;
    if (left >> 38) return plan_refuse(plan, PLANNER_TOO_LONG);
    left <<= 24;
    uint64_t ramp =
        left / 2 / stepped->ticks;  // sum of velocities that fits into half the distance

    // steps up, while the mirrored steps down fit too
    for (; sections < 3; sections++) {
        uint64_t border = sections < 2 ? stepped->border[sections] : stepped->top,
                 rise = stepped->rise[sections];
        up[sections] = (struct planner_segment){
            .velocity = (int64_t)velocity, .acceleration = (int64_t)rise, .ticks = stepped->ticks};
        uint32_t steps = 0;
        while (velocity + rise <= border && ramp >= velocity &&
               left - 2 * velocity * stepped->ticks > velocity + rise) {
            if (++steps > MOST_LEVELS) return plan_refuse(plan, PLANNER_TOO_MANY_LEVELS);
            left -= 2 * velocity * stepped->ticks;
            ramp -= velocity;
            velocity += rise;
        }
        up[sections].jerk = (int32_t)steps;
    }

    // the remainder at the velocity that was reached or less: `more` ticks are one unit faster
    uint64_t ticks = ceiling(left, velocity);
    if (ticks >> LONGEST_CRUISE_BITS) return plan_refuse(plan, PLANNER_TOO_LONG);
    uint64_t slow = left / ticks;
    uint32_t more = (uint32_t)(left - slow * ticks);
    // a tick at rest first: each step of the player is the mean of two steps of the plan
    plan->section[plan->count++] = (struct planner_segment){.ticks = 1};
    for (int n = 0; n < 3; n++)
        if (up[n].jerk) {
            up[n].jerk--;
            plan->section[plan->count++] = up[n];
        }
    if (more)
        plan->section[plan->count++] =
            (struct planner_segment){.velocity = (int64_t)slow + 1, .ticks = more};
    plan->section[plan->count++] =
        (struct planner_segment){.velocity = (int64_t)slow, .ticks = (uint32_t)ticks - more};
    int top = plan->count;
    for (int n = top - 1 - (more != 0); n-- > 1;) {
        struct planner_segment down = plan->section[n];
        down.velocity += down.acceleration * down.jerk;
        down.acceleration = -down.acceleration;
        plan->section[plan->count++] = down;
    }
    for (uint32_t n = 0; n < plan->count; n++) {
        plan->section[n].velocity *= sign;
        plan->section[n].acceleration *= sign;
        plan->ticks += plan->section[n].ticks * ((uint32_t)plan->section[n].jerk + 1);
    }
    return true;
}

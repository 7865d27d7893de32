// SPDX-License-Identifier: Apache-2.0
// planner -- limits, moves from remainder to remainder, stepped.
//
// The player adds each tick: target += v, v += a, a += j. So a move is three nested sums over its
// third difference: a pulse of jerk (sum `peak_acceleration` over `jerk_ticks`), its negative
// `acceleration_ticks` later, and the negative of both `velocity_ticks` later. Sums multiply: the
// distance is peak_acceleration x acceleration_ticks x velocity_ticks, whatever the shape of the
// pulse. The three durations are chosen first. Three divisions then leave three remainders, each
// smaller than the duration it was divided by, and each goes in as one more unit of 2^-40 during
// just that many ticks: of velocity, of acceleration, of jerk. Nothing is rounded, so nothing is
// left over at the end.
//
// The pulse is that of a continuous motion whose jerk changes at a tick, its positions taken at the
// ticks: the third difference follows in three steps, 1:4:1, which is the cubic B-spline
// (Schoenberg, Quart. Appl. Math. 4 (1946) 45). So a retarget finds a motion that it can go on with
// (retarget.c). A pulse of one tick is a kick, whose third difference stays below its sum.
#include "planner/planner.h"

#include "core/arithmetic.h"
#include "planner/plan.h"

#define ROOM 8u        // kept free for a retarget, of larger limits of jerk and acceleration
#define ROOM_SHIFT 13  // and a 2^-13th of the velocity
#define ROOM_JERK \
    1u  // what those units may add to a peak; those of velocity and acceleration are rounded up
        // already
#define LONGEST_RAMP 0x10000000u
#define LONGEST_CRUISE_BITS 30
#define MOST_LEVELS 4096u
#define OVERRIDE_PART 4u  // of the acceleration and the jerk
#define LEAD 2u           // ticks until a third difference is a step ...
#define LEFT_OUT 1u       // ... of which the player needs one

struct durations {
    uint32_t jerk;          // >= 1
    uint32_t acceleration;  // >= jerk
    uint32_t velocity;      // >= jerk + acceleration
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
    // |velocity| slope <= acceleration / 4;  3 |acceleration| slope + |velocity| curve <= jerk / 4,
    // half for each
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

static uint64_t held_product(uint64_t wide, uint32_t narrow)  // all ones if it does not fit
{
    uint64_t high = (wide >> 32) * narrow, low = (uint64_t)(uint32_t)wide * narrow,
             sum = (high << 32) + low;
    return high >> 32 || sum < low ? UINT64_MAX : sum;
}

// The velocity reached with such ramps inside the limits.
static uint64_t peak_velocity(const struct planner_limits* limits, uint32_t jerk_ticks,
                              uint32_t acceleration_ticks) {
    uint64_t peak = held_product(limits->acceleration, acceleration_ticks);
    uint64_t by_jerk = held_product(held_product(limits->jerk, jerk_ticks), acceleration_ticks);
    if (limits->jerk != PLANNER_ANY_JERK && by_jerk < peak) peak = by_jerk;
    return limits->velocity < peak ? limits->velocity : peak;
}

// Whether `distance` can be gone in these durations inside the limits.
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

// The shortest ramps to the velocity limit.
static struct durations ramps_to_top(const struct planner_limits* limits) {
    struct durations d = {0, 0, 0};
    bool trapezoid = limits->jerk == PLANNER_ANY_JERK;
    uint64_t jerk = trapezoid ? 1 : ceiling(limits->acceleration, limits->jerk);
    uint64_t acceleration = ceiling(limits->velocity, limits->acceleration);
    if (acceleration < jerk) {  // top speed comes before full acceleration
        jerk = acceleration = root(ceiling(limits->velocity, limits->jerk) - 1) + 1ull;
    }
    ramps_of(&d, (uint32_t)least(acceleration, LONGEST_RAMP), (uint32_t)least(jerk, LONGEST_RAMP));
    return d;
}

// Take single ticks away while the distance is still reached.
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

static bool choose(const struct planner_limits* limits, struct durations* d, uint64_t distance) {
    *d = ramps_to_top(limits);
    uint64_t top = peak_velocity(limits, d->jerk, d->acceleration);
    uint32_t shift = 24;  // both of the division fit 64 bits
    uint64_t divisor = top;
    while (divisor >> 32) divisor >>= 1, shift--;
    if (distance >> (LONGEST_CRUISE_BITS + 32 - shift)) return false;
    uint64_t cruise = (distance << shift) / divisor + 1;
    if (cruise >> LONGEST_CRUISE_BITS) return false;

    if (cruise >= (uint64_t)d->acceleration + d->jerk) {
        d->velocity = (uint32_t)cruise;
    } else {  // too short for the top speed
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

// Whether the limits are possible.
static enum planner_cause judge(const struct planner_limits* limits) {
    if (limits->velocity == 0) return PLANNER_NO_VELOCITY;
    if (limits->acceleration == 0) return PLANNER_NO_ACCELERATION;
    if (limits->jerk <= ROOM_JERK) return PLANNER_NO_JERK;
    return PLANNER_OK;
}

// Events of one change of jerk, from `instant` on.
static void change(struct plan* plan, uint32_t instant, uint8_t slot, int64_t jerk) {
    if (jerk) plan_add(plan, instant + slot, (struct planner_event){.jerk = jerk, .slot = slot});
}

// A pulse of jerk of this sum.
static void pulse(struct plan* plan, uint32_t instant, int64_t sum, uint32_t ticks) {
    const int64_t sign = sum < 0 ? -1 : 1, jerk = sum / ticks, more = sum - jerk * ticks;
    const int64_t outer = sign * (int64_t)((size(jerk) + 5) / 6), inner = jerk - 2 * outer;
    if (ticks == 1) {
        const int64_t kick[] = {outer, inner - outer, outer - inner, -outer};
        for (uint8_t n = 0; n < 4; n++) change(plan, instant, n, kick[n]);
        return;
    }
    const int64_t steps[] = {outer, inner, outer};
    for (uint8_t n = 0; n < 3; n++) {
        change(plan, instant, n, steps[n]);
        change(plan, instant + ticks, n, -steps[n]);
    }
    if (more == 0) return;
    plan_add(plan, instant + LEAD, (struct planner_event){.jerk = sign, .slot = PLANNER_LANDING});
    plan_add(plan, instant + LEAD + (uint32_t)size(more),
             (struct planner_event){.jerk = -sign, .slot = PLANNER_LANDING});
}

// Single units of acceleration or velocity for so many ticks.
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

// Begin so many ticks later; their steps are zero.
static void skip(struct plan* plan, uint32_t ticks) {
    struct planner_segment piece;
    bool last;
    while (plan->at.tick < ticks) planner_take_up_to(plan, &piece, &last, ticks - plan->at.tick);
    for (uint32_t n = plan->next; n < plan->count; n++) plan->event[n].tick -= ticks;
    plan->ticks -= ticks;
    plan->at.tick = 0;
}

static uint64_t room(uint64_t limit) { return least(limit >> 20, ROOM); }

bool planner_move(struct plan* plan, const struct planner_limits* limits, int64_t distance) {
    struct planner_limits inner = {limits->velocity - (limits->velocity >> ROOM_SHIFT),
                                   limits->acceleration - room(limits->acceleration), limits->jerk};
    struct durations d;
    const int8_t sign = distance < 0 ? -1 : 1;
    const uint64_t length = size(distance);
    const enum planner_cause cause = judge(limits);

    plan_clear(plan);
    if (cause) return plan_refuse(plan, cause);
    if (length == 0) return true;
    if (inner.jerk != PLANNER_ANY_JERK) inner.jerk -= ROOM_JERK + (uint32_t)room(limits->jerk);
    if (!choose(&inner, &d, length)) return plan_refuse(plan, PLANNER_TOO_LONG);

    // length x 2^24 = velocity x d.velocity + more_velocity, and so on down
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
    skip(plan, LEFT_OUT);
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
        left / 2 / stepped->ticks;  // sum of the velocities that still fits into half of the way

    // up, as long as the mirrored way down still fits
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

    // the remainder at the velocity that was reached, or just below it: more_velocity ticks are one
    // unit faster
    uint64_t ticks = ceiling(left, velocity);
    if (ticks >> LONGEST_CRUISE_BITS) return plan_refuse(plan, PLANNER_TOO_LONG);
    uint64_t slow = left / ticks;
    uint32_t more = (uint32_t)(left - slow * ticks);
    plan->section[plan->count++] = (struct planner_segment){
        .ticks = 1};  // the player adds half of the first step to the second
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

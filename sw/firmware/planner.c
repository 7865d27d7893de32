// SPDX-License-Identifier: Apache-2.0
// planner -- a move as segments of constant jerk.
//
// The player adds each tick: target += v, v += a, a += j. So a move is three nested sums over its third difference: a pulse
// of jerk (sum `peak_acceleration` over `jerk_ticks`), its negative `acceleration_ticks` later, and the negative of both
// `velocity_ticks` later. Sums multiply: the distance is peak_acceleration x acceleration_ticks x velocity_ticks, whatever
// the shape of the pulse. The three durations are chosen first. Three divisions then leave three remainders, each smaller
// than the duration it was divided by, and each goes in as one more unit of 2^-40 during just that many ticks: of velocity, of
// acceleration, of jerk. Nothing is rounded, so nothing is left over at the end.
#include "planner.h"

#define ROOM_JERK 1u            // what those units may add to a peak; those of velocity and acceleration are rounded up already
#define LONGEST_RAMP 0x10000000u
#define LONGEST_CRUISE_BITS 30

struct durations {
    uint32_t jerk;
    uint32_t acceleration;      // >= jerk
    uint32_t velocity;          // >= jerk + acceleration
};

uint64_t planner_velocity(uint32_t velocity)
{
    return ((uint64_t)velocity << 35) / 125u;                                // 2^40 / 4000   = 2^35 / 5^3
}

struct planner_limits planner_limits(uint32_t velocity, uint32_t acceleration, uint32_t jerk)
{
    struct planner_limits limits;
    uint64_t wide_jerk = ((uint64_t)jerk << 25) / 1953125u;                  // 2^40 / 4000^3 = 2^25 / 5^9
    limits.velocity = planner_velocity(velocity);
    limits.acceleration = ((uint64_t)acceleration << 30) / 15625u;           // 2^40 / 4000^2 = 2^30 / 5^6
    limits.jerk = wide_jerk > INT32_MAX ? INT32_MAX : (uint32_t)wide_jerk;
    return limits;
}

static uint64_t product(uint64_t wide, uint32_t narrow)                     // all ones if it does not fit
{
    uint64_t high = (wide >> 32) * narrow, low = (uint64_t)(uint32_t)wide * narrow, sum = (high << 32) + low;
    return high >> 32 || sum < low ? UINT64_MAX : sum;
}

static uint64_t ceiling(uint64_t dividend, uint64_t divisor)
{
    return dividend == 0 ? 0 : (dividend - 1) / divisor + 1;
}

// The velocity reached with such ramps inside the limits.
static uint64_t peak_velocity(const struct planner_limits *limits, uint32_t jerk_ticks, uint32_t acceleration_ticks)
{
    uint64_t peak = product(limits->acceleration, acceleration_ticks);
    uint64_t by_jerk = product(product(limits->jerk, jerk_ticks), acceleration_ticks);
    if (by_jerk < peak) peak = by_jerk;
    return limits->velocity < peak ? limits->velocity : peak;
}

// Whether `distance` can be gone in these durations inside the limits.
static bool reaches(const struct planner_limits *limits, const struct durations *d, uint64_t distance)
{
    uint64_t peak = peak_velocity(limits, d->jerk, d->acceleration);
    uint64_t high = (peak >> 32) * d->velocity, low = (uint64_t)(uint32_t)peak * d->velocity;
    return (high << 8) + (low >> 24) >= distance;                            // 2^-40 to 2^-16 period
}

// The shortest ramps to the velocity limit.
static struct durations ramps_to_top(const struct planner_limits *limits)
{
    struct durations d = {0, 0, 0};
    uint64_t jerk = ceiling(limits->acceleration, limits->jerk), acceleration = ceiling(limits->velocity, limits->acceleration);
    if (acceleration < jerk) {                                               // top speed comes before full acceleration
        uint64_t square = ceiling(limits->velocity, limits->jerk);
        uint32_t root = 0;
        for (uint32_t bit = 1u << 24; bit; bit >>= 1)
            if ((uint64_t)(root + bit - 1) * (root + bit - 1) < square) root += bit;
        jerk = acceleration = root;
    }
    d.acceleration = acceleration > LONGEST_RAMP ? LONGEST_RAMP : (uint32_t)acceleration;
    d.jerk = jerk > d.acceleration ? d.acceleration : (uint32_t)jerk;
    return d;
}

static void ramps_of(struct durations *d, uint32_t acceleration_ticks, uint32_t longest_jerk)
{
    d->acceleration = acceleration_ticks;
    d->jerk = acceleration_ticks < longest_jerk ? acceleration_ticks : longest_jerk;
    d->velocity = d->acceleration + d->jerk;
}

// Take single ticks away while the distance is still reached.
static void tighten(const struct planner_limits *limits, struct durations *d, uint64_t distance)
{
    bool shorter = true;
    while (shorter) {
        shorter = false;
        for (int which = 0; which < 3; which++) {
            struct durations less = *d;
            if (which == 0) less.jerk--;
            if (which == 1) less.acceleration--;
            if (which == 2) less.velocity--;
            if (less.jerk == 0 || less.acceleration < less.jerk || less.velocity < less.acceleration + less.jerk) continue;
            if (!reaches(limits, &less, distance)) continue;
            *d = less;
            shorter = true;
        }
    }
}

static bool choose(const struct planner_limits *limits, struct durations *d, uint64_t distance)
{
    *d = ramps_to_top(limits);
    uint64_t top = peak_velocity(limits, d->jerk, d->acceleration);
    uint32_t shift = 24;                                                     // both of the division fit 64 bits
    uint64_t divisor = top;
    while (divisor >> 32) divisor >>= 1, shift--;
    if (distance >> (LONGEST_CRUISE_BITS + 32 - shift)) return false;
    uint64_t cruise = (distance << shift) / divisor + 1;
    if (cruise >> LONGEST_CRUISE_BITS) return false;

    if (cruise >= (uint64_t)d->acceleration + d->jerk) {
        d->velocity = (uint32_t)cruise;
    } else {                                                                 // too short for the top speed
        uint32_t low = 0, high = d->acceleration, longest_jerk = d->jerk;
        while (high - low > 1) {
            uint32_t middle = low + (high - low) / 2;
            ramps_of(d, middle, longest_jerk);
            if (reaches(limits, d, distance)) high = middle;
            else low = middle;
        }
        ramps_of(d, high, longest_jerk);
    }
    tighten(limits, d, distance);
    return true;
}

// While a plan is made, a segment holds what is added at one instant, and `ticks` is that instant.
static void add(struct plan *plan, uint32_t instant, int64_t velocity, int64_t acceleration, int32_t jerk)
{
    uint32_t at = plan->count;
    while (at && plan->segment[at - 1].ticks > instant) at--;
    if (at && plan->segment[at - 1].ticks == instant) {
        at--;
    } else {
        for (uint32_t n = plan->count; n > at; n--) plan->segment[n] = plan->segment[n - 1];
        plan->segment[at] = (struct planner_segment){0, 0, 0, instant};
        plan->count++;
    }
    plan->segment[at].velocity += velocity;
    plan->segment[at].acceleration += acceleration;
    plan->segment[at].jerk = (int32_t)((uint32_t)plan->segment[at].jerk + (uint32_t)jerk);
}

static void pulse(struct plan *plan, uint32_t instant, int32_t sign, uint32_t jerk, uint32_t more, uint32_t ticks)
{
    add(plan, instant, 0, 0, more ? sign * (int32_t)(jerk + 1) : sign * (int32_t)jerk);
    if (more) add(plan, instant + more, 0, 0, -sign);
    add(plan, instant + ticks, 0, 0, -sign * (int32_t)jerk);
}

static void advance(struct planner_segment *state, uint32_t ticks)
{
    uint64_t pairs = (uint64_t)ticks * (ticks - 1) / 2;
    state->velocity += state->acceleration * ticks + state->jerk * (int64_t)pairs;
    state->acceleration += (int64_t)state->jerk * ticks;
}

// From what is added at each instant to the values at the start of each segment.
static void integrate(struct plan *plan)
{
    struct planner_segment state = {0, 0, 0, 0};
    for (uint32_t n = 0; n + 1 < plan->count; n++) {
        struct planner_segment *segment = &plan->segment[n];
        uint32_t ticks = plan->segment[n + 1].ticks - segment->ticks;
        state.velocity += segment->velocity;
        state.acceleration += segment->acceleration;
        state.jerk = (int32_t)((uint32_t)state.jerk + (uint32_t)segment->jerk);
        *segment = (struct planner_segment){state.velocity, state.acceleration, state.jerk, ticks};
        advance(&state, ticks);
    }
    plan->count--;                                                           // at the last instant all is zero again
}

bool planner_move(struct plan *plan, const struct planner_limits *limits, int64_t distance)
{
    struct planner_limits inner = {limits->velocity, limits->acceleration, limits->jerk - ROOM_JERK};
    struct durations d;
    int32_t sign = distance < 0 ? -1 : 1;
    uint64_t length = distance < 0 ? -(uint64_t)distance : (uint64_t)distance;

    plan->ticks = 0;
    plan->count = 0;
    plan->next = 0;
    if (length == 0) return true;
    if (!choose(&inner, &d, length)) return false;

    // length x 2^24 = velocity x d.velocity + more_velocity, and so on down
    uint64_t whole = length / d.velocity, rest = (length - whole * d.velocity) << 24, part = rest / d.velocity;
    uint64_t velocity = (whole << 24) + part;
    uint32_t more_velocity = (uint32_t)(rest - part * d.velocity);
    uint64_t acceleration = velocity / d.acceleration;
    uint32_t more_acceleration = (uint32_t)(velocity - acceleration * d.acceleration);
    uint32_t jerk = (uint32_t)(acceleration / d.jerk);
    uint32_t more_jerk = (uint32_t)(acceleration - (uint64_t)jerk * d.jerk);

    pulse(plan, 0, sign, jerk, more_jerk, d.jerk);
    pulse(plan, d.acceleration, -sign, jerk, more_jerk, d.jerk);
    pulse(plan, d.velocity, -sign, jerk, more_jerk, d.jerk);
    pulse(plan, d.velocity + d.acceleration, sign, jerk, more_jerk, d.jerk);
    if (more_acceleration) {
        add(plan, 0, 0, sign, 0);
        add(plan, more_acceleration, 0, -sign, 0);
        add(plan, d.velocity, 0, -sign, 0);
        add(plan, d.velocity + more_acceleration, 0, sign, 0);
    }
    if (more_velocity) {
        add(plan, 0, sign, 0, 0);
        add(plan, more_velocity, -sign, 0, 0);
    }
    plan->ticks = d.velocity + d.acceleration + d.jerk;
    integrate(plan);
    return true;
}

bool planner_take(struct plan *plan, struct planner_segment *piece, bool *last)
{
    if (plan->next >= plan->count) return false;
    struct planner_segment *segment = &plan->segment[plan->next];
    *piece = *segment;
    if (segment->ticks > PLANNER_LONGEST_PIECE) {
        piece->ticks = PLANNER_LONGEST_PIECE;
        segment->ticks -= PLANNER_LONGEST_PIECE;
        advance(segment, PLANNER_LONGEST_PIECE);
    } else {
        plan->next++;
    }
    *last = plan->next >= plan->count;
    return true;
}

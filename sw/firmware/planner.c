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
#define LEAST_LIMIT 16u         // for retargeting, which leaves units over

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
    if (limits->jerk != PLANNER_ANY_JERK && by_jerk < peak) peak = by_jerk;
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
    bool trapezoid = limits->jerk == PLANNER_ANY_JERK;
    uint64_t jerk = trapezoid ? 0 : ceiling(limits->acceleration, limits->jerk);
    uint64_t acceleration = ceiling(limits->velocity, limits->acceleration);
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
            if (which == 0 && less.jerk + 1 <= 1) continue;
            if (less.acceleration == 0 || less.acceleration < less.jerk || less.velocity < less.acceleration + less.jerk) continue;
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
        plan->segment[at] = (struct planner_segment){.ticks = instant};
        plan->count++;
    }
    plan->segment[at].velocity += velocity;
    plan->segment[at].acceleration += acceleration;
    plan->segment[at].jerk = (int32_t)((uint32_t)plan->segment[at].jerk + (uint32_t)jerk);
}

static bool refuse(struct plan *plan, enum planner_cause cause)
{
    plan->cause = cause;
    return false;
}

// Whether the limits are possible.
static enum planner_cause judge(const struct planner_limits *limits)
{
    if (limits->velocity == 0) return PLANNER_NO_VELOCITY;
    if (limits->acceleration == 0) return PLANNER_NO_ACCELERATION;
    if (limits->jerk <= ROOM_JERK) return PLANNER_NO_JERK;
    return PLANNER_OK;
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
    struct planner_segment state = {0};
    for (uint32_t n = 0; n + 1 < plan->count; n++) {
        struct planner_segment *segment = &plan->segment[n];
        uint32_t ticks = plan->segment[n + 1].ticks - segment->ticks;
        state.velocity += segment->velocity;
        state.acceleration += segment->acceleration;
        state.jerk = (int32_t)((uint32_t)state.jerk + (uint32_t)segment->jerk);
        *segment = (struct planner_segment){.velocity = state.velocity, .acceleration = state.acceleration, .jerk = state.jerk, .ticks = ticks};
        advance(&state, ticks);
    }
    plan->count--;                                                           // at the last instant all is zero again
}

bool planner_move(struct plan *plan, const struct planner_limits *limits, int64_t distance)
{
    struct planner_limits inner = *limits;
    struct durations d;
    int32_t sign = distance < 0 ? -1 : 1;
    uint64_t length = distance < 0 ? -(uint64_t)distance : (uint64_t)distance;

    *plan = (struct plan){.cause = (uint8_t)judge(limits)};
    if (plan->cause) return false;
    if (length == 0) return true;
    if (inner.jerk != PLANNER_ANY_JERK) inner.jerk -= ROOM_JERK;
    if (!choose(&inner, &d, length)) return refuse(plan, PLANNER_TOO_LONG);

    // length x 2^24 = velocity x d.velocity + more_velocity, and so on down
    uint64_t whole = length / d.velocity, rest = (length - whole * d.velocity) << 24, part = rest / d.velocity;
    uint64_t velocity = (whole << 24) + part;
    uint32_t more_velocity = (uint32_t)(rest - part * d.velocity);
    uint64_t acceleration = velocity / d.acceleration;
    uint32_t more_acceleration = (uint32_t)(velocity - acceleration * d.acceleration);
    uint32_t instants[] = {0, d.acceleration, d.velocity, d.velocity + d.acceleration};
    for (int n = 0; n < 4; n++) {
        int32_t way = n == 0 || n == 3 ? sign : -sign;
        if (d.jerk == 0) {
            add(plan, instants[n], 0, way * (int64_t)acceleration, 0);
            continue;
        }
        uint32_t jerk = (uint32_t)(acceleration / d.jerk);
        pulse(plan, instants[n], way, jerk, (uint32_t)(acceleration - (uint64_t)jerk * d.jerk), d.jerk);
    }
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

void planner_borders(struct planner_stairs *stairs, bool as_printed)
{
    uint64_t climb = stairs->top - stairs->first;
    stairs->border[0] = stairs->first + climb / 6;
    stairs->border[1] = stairs->first + (as_printed ? climb / 3 : climb / 2);
}

bool planner_climb(struct plan *plan, const struct planner_stairs *stairs, int64_t distance)
{
    int64_t sign = distance < 0 ? -1 : 1;
    uint64_t left = distance < 0 ? -(uint64_t)distance : (uint64_t)distance, velocity = stairs->first;
    struct planner_segment up[3];
    int sections = 0;

    *plan = (struct plan){.stairs = true};
    if (stairs->first == 0 || stairs->ticks == 0) return refuse(plan, PLANNER_NO_VELOCITY);
    if (stairs->top < stairs->first || stairs->border[0] < stairs->first || stairs->border[1] < stairs->border[0] ||
        stairs->top < stairs->border[1] || stairs->top >> 44 || !stairs->rise[0] || !stairs->rise[1] || !stairs->rise[2])
        return refuse(plan, PLANNER_BORDERS);
    if (left == 0) return true;
    if (left >> 38) return refuse(plan, PLANNER_TOO_LONG);
    left <<= 24;

    // up, as long as the mirrored way down still fits
    for (; sections < 3; sections++) {
        uint64_t border = sections < 2 ? stairs->border[sections] : stairs->top, rise = stairs->rise[sections];
        up[sections] = (struct planner_segment){.velocity = (int64_t)velocity, .acceleration = (int64_t)rise, .ticks = stairs->ticks};
        uint32_t steps = 0;
        while (velocity + rise <= border && left / 2 / stairs->ticks >= velocity && left - 2 * velocity * stairs->ticks > velocity + rise) {
            if (++steps >> 16) return refuse(plan, PLANNER_TOO_MANY_STAIRS);
            left -= 2 * velocity * stairs->ticks;
            velocity += rise;
        }
        up[sections].jerk = (int32_t)steps;
    }

    // the rest at the velocity that was reached, or just below it: more_velocity ticks are one unit faster
    uint64_t ticks = ceiling(left, velocity);
    if (ticks >> LONGEST_CRUISE_BITS) return refuse(plan, PLANNER_TOO_LONG);
    uint64_t slow = left / ticks;
    uint32_t more = (uint32_t)(left - slow * ticks);
    for (int n = 0; n < 3; n++)
        if (up[n].jerk) {
            up[n].jerk--;
            plan->segment[plan->count++] = up[n];
        }
    if (more) plan->segment[plan->count++] = (struct planner_segment){.velocity = (int64_t)slow + 1, .ticks = more};
    plan->segment[plan->count++] = (struct planner_segment){.velocity = (int64_t)slow, .ticks = (uint32_t)ticks - more};
    int top = plan->count;
    for (int n = top - 1 - (more != 0); n-- > 0;) {
        struct planner_segment down = plan->segment[n];
        down.velocity += down.acceleration * down.jerk;
        down.acceleration = -down.acceleration;
        plan->segment[plan->count++] = down;
    }
    for (uint32_t n = 0; n < plan->count; n++) {
        plan->segment[n].velocity *= sign;
        plan->segment[n].acceleration *= sign;
        plan->ticks += plan->segment[n].ticks * ((uint32_t)plan->segment[n].jerk + 1);
    }
    return true;
}

// n (n-1) (n-2) / 6 modulo 2^64
static uint64_t triples(uint32_t n)
{
    uint64_t a = n, b = n - 1ull, c = n - 2ull;
    if (n < 3) return 0;
    if (a % 2 == 0) a /= 2;
    else b /= 2;
    if (a % 3 == 0) a /= 3;
    else if (b % 3 == 0) b /= 3;
    else c /= 3;
    return a * b * c;
}

// How far `ticks` of a segment go, modulo 2^64.
static uint64_t path(const struct planner_segment *segment, uint32_t ticks)
{
    return (uint64_t)segment->velocity * ticks + (uint64_t)segment->acceleration * ((uint64_t)ticks * (ticks - 1ull) / 2) +
           (uint64_t)(int64_t)segment->jerk * triples(ticks);
}

// ------------------------------------------------------------------ retargeting
//
// From (v, a) to a velocity `knee` with a = 0, some ticks of it, and from there to rest; or, where it decelerates already and
// stops too soon, to an acceleration `knee` nearer to zero, and from there to rest. A change of velocity is three parts: the
// acceleration goes to a peak, stays, goes to zero. Their ticks are chosen for limits and knee; then the knee and the peaks
// follow exactly from the distance, all being linear once the ticks stand. What integers leave over goes in as units of
// acceleration and velocity, a few at a time, for which a thousandth of the limits is kept free.
struct change {
    int64_t velocity, acceleration;     // at its start
    uint32_t rise, stay, fall;
};

struct shape {
    struct change to_knee, to_rest;
    uint32_t cruise;
    bool relieves;                      // the knee is an acceleration
};

static uint32_t ticks_of(const struct change *c)
{
    return c->rise + c->stay + c->fall;
}

static uint64_t size(int64_t x)
{
    return x < 0 ? -(uint64_t)x : (uint64_t)x;
}

static int64_t floor_divide(int64_t dividend, int64_t divisor)              // divisor > 0
{
    int64_t quotient = dividend / divisor;
    return quotient * divisor > dividend ? quotient - 1 : quotient;
}

// The velocity gained while the acceleration goes from `from` by `delta` in `ticks`, its remainder first.
static int64_t gained(int64_t from, int64_t delta, uint32_t ticks)
{
    if (ticks == 0) return 0;
    int64_t n = ticks, jerk = floor_divide(delta, n), more = delta - jerk * n;
    return from * n + jerk * (n * (n - 1) / 2) + more * (more + 1) / 2 + (n - 1 - more) * more;
}

static int64_t peak_of(const struct change *c, int64_t gain)
{
    int64_t weight = (int64_t)c->rise + 2 * (int64_t)c->stay + c->fall;
    return weight ? floor_divide(2 * gain - c->acceleration * ((int64_t)c->rise + (c->rise != 0)), weight) : 0;
}

// The fewest ticks of a change by `gain`.
static struct change shortest_change(const struct planner_limits *limits, int64_t velocity, int64_t acceleration, int64_t gain)
{
    struct change c = {.velocity = velocity, .acceleration = acceleration};
    int64_t limit = (int64_t)limits->acceleration, jerk = limits->jerk, from = acceleration;
    if (limits->jerk == PLANNER_ANY_JERK) {
        c.stay = (uint32_t)ceiling(size(gain), limits->acceleration);
        return c;
    }
    uint32_t straight = (uint32_t)ceiling(size(from), limits->jerk);
    if (gain < gained(from, -from, straight)) from = -from, gain = -gain;    // now the peak lies above
    uint32_t most = (uint32_t)ceiling(limits->acceleration, limits->jerk), low = 0, high = most;
    while (low < high) {                                                     // ticks from the peak to zero
        uint32_t middle = low + (high - low) / 2;
        int64_t peak = middle == most ? limit : jerk * middle, up = peak - from;
        uint32_t rise = (uint32_t)ceiling(size(up), limits->jerk);
        if (gained(from, up, rise) + gained(peak, -peak, middle) >= gain) high = middle;
        else low = middle + 1;
    }
    int64_t peak = low == most ? limit : jerk * low;
    c.fall = low;
    c.rise = (uint32_t)ceiling(size(peak - from), limits->jerk);
    int64_t rest = gain - gained(from, peak - from, c.rise) - gained(peak, -peak, low);
    c.stay = rest > 0 ? (uint32_t)ceiling((uint64_t)rest, limits->acceleration) : 0;
    return c;
}

static void spread(struct plan *plan, uint32_t instant, int64_t delta, uint32_t ticks)
{
    if (ticks == 0) {
        add(plan, instant, 0, delta, 0);
        return;
    }
    int64_t jerk = floor_divide(delta, ticks);
    uint32_t more = (uint32_t)(delta - jerk * ticks);
    add(plan, instant, 0, 0, (int32_t)(jerk + (more != 0)));
    if (more) add(plan, instant + more, 0, 0, -1);
    add(plan, instant + ticks, 0, 0, (int32_t)-jerk);
}

// Units of acceleration, or of velocity, that sum up to `delta` in `ticks`.
static void make_up(struct plan *plan, uint32_t instant, int64_t delta, uint32_t ticks, bool of_velocity)
{
    if (delta == 0 || ticks == 0) return;
    int64_t units = floor_divide(delta, ticks);
    uint32_t more = (uint32_t)(delta - units * ticks);
    add(plan, instant, of_velocity ? units : 0, of_velocity ? 0 : units, 0);
    if (more) {
        add(plan, instant, of_velocity, !of_velocity, 0);
        add(plan, instant + more, -(int64_t)of_velocity, -(int64_t)!of_velocity, 0);
    }
    add(plan, instant + ticks, of_velocity ? -units : 0, of_velocity ? 0 : -units, 0);
}

static void put_change(struct plan *plan, uint32_t instant, const struct change *c, int64_t gain)
{
    int64_t peak = peak_of(c, gain), start = c->rise ? c->acceleration : peak;
    int64_t got = gained(start, peak - start, c->rise) + peak * c->stay + gained(peak, -peak, c->fall);
    if (c->rise) spread(plan, instant, peak - start, c->rise);
    else add(plan, instant, 0, peak - c->acceleration, 0);
    spread(plan, instant + c->rise + c->stay, -peak, c->fall);
    make_up(plan, instant, gain - got, ticks_of(c), false);
}

// The plan of a shape for one knee; returns how far it goes, modulo 2^64.
static uint64_t build(struct plan *plan, const struct shape *shape, int64_t knee, int64_t more_path)
{
    struct change to_rest = shape->to_rest;
    uint32_t second = ticks_of(&shape->to_knee) + shape->cruise;
    uint64_t gone = 0;
    plan->count = plan->next = 0;
    plan->into = 0;
    plan->ticks = second + ticks_of(&shape->to_rest);
    add(plan, 0, shape->to_knee.velocity, shape->to_knee.acceleration, 0);
    if (shape->relieves) {
        int64_t delta = knee - shape->to_knee.acceleration;
        spread(plan, 0, delta, shape->to_knee.rise);
        to_rest.velocity = shape->to_knee.velocity + gained(shape->to_knee.acceleration, delta, shape->to_knee.rise);
        to_rest.acceleration = knee;
    } else {
        put_change(plan, 0, &shape->to_knee, knee - shape->to_knee.velocity);
        to_rest.velocity = knee;
    }
    put_change(plan, second, &to_rest, -to_rest.velocity);
    make_up(plan, 0, more_path, plan->ticks, true);
    add(plan, plan->ticks, 0, 0, 0);
    integrate(plan);
    for (uint32_t n = 0; n < plan->count; n++) gone += path(&plan->segment[n], plan->segment[n].ticks);
    return gone;
}

static int64_t velocity_at(const struct planner_segment *s, uint32_t tick)
{
    return s->velocity + s->acceleration * tick + s->jerk * (int64_t)((uint64_t)tick * (tick - 1ull) / 2);
}

// Whether every step and its differences are inside the limits; what the start itself exceeds may not grow.
static bool inside(const struct plan *plan, const struct planner_limits *limits, const struct planner_state *from, int64_t room)
{
    uint64_t top = limits->velocity, steepest = limits->acceleration;
    int64_t before = from->velocity - from->acceleration, slope = from->acceleration;
    bool first = true;
    if (limits->jerk != PLANNER_ANY_JERK) {                                  // the velocity that cannot be avoided
        uint32_t ticks = (uint32_t)ceiling(size(from->acceleration), limits->jerk - (uint64_t)room);
        uint64_t least = size(from->velocity + gained(from->acceleration, -from->acceleration, ticks)) + (uint64_t)room * (ticks + 1);
        if (least > top && size(from->acceleration)) top = least;
    }
    if (size(from->velocity) > top) top = size(from->velocity) + (uint64_t)room;
    if (size(from->acceleration) > steepest) steepest = size(from->acceleration) + (uint64_t)room;
    for (uint32_t n = 0; n <= plan->count; n++) {
        struct planner_segment rest = {.ticks = 2}, s = n < plan->count ? plan->segment[n] : rest;
        int64_t enters = s.velocity - before, leaves = s.acceleration + s.jerk * ((int64_t)s.ticks - 1);
        if (!first && limits->jerk != PLANNER_ANY_JERK && size(enters - slope) > limits->jerk) return false;
        if (first && (size(enters - slope) > (uint64_t)room || size(s.velocity - from->velocity) > (uint64_t)room)) return false;
        if (size(enters) > steepest || size(s.velocity) > top) return false;
        slope = enters;
        first = false;
        if (s.ticks > 1) {
            int64_t last_slope = leaves - s.jerk;
            if (limits->jerk != PLANNER_ANY_JERK && (size(s.acceleration - slope) > limits->jerk || size(s.jerk) > limits->jerk)) return false;
            if (size(s.acceleration) > steepest || size(last_slope) > steepest || size(velocity_at(&s, s.ticks - 1)) > top) return false;
            if (s.jerk && (s.acceleration < 0) != (last_slope < 0)) {
                uint32_t turn = (uint32_t)(size(s.acceleration) / size(s.jerk));
                if (size(velocity_at(&s, turn)) > top || size(velocity_at(&s, turn + 1)) > top) return false;
            }
            slope = last_slope;
        }
        before = velocity_at(&s, s.ticks - 1);
    }
    return true;
}

static void lengthen(struct change *c, uint32_t ticks)
{
    if (ticks_of(c) == c->stay) c->stay += ticks;
    else if (c->fall == 0) c->rise += ticks;
    else c->rise += ticks, c->fall += ticks;
}

// The shape of fewest ticks for a knee; returns how far it goes.
static int64_t shape_for(struct plan *trial, struct shape *shape, const struct planner_limits *inner, const struct planner_state *from, int64_t knee)
{
    shape->cruise = 0;
    if (shape->relieves) {
        int64_t delta = knee - from->acceleration;
        uint32_t rise = (uint32_t)ceiling(size(delta), inner->jerk);
        int64_t velocity = from->velocity + gained(from->acceleration, delta, rise);
        shape->to_knee = (struct change){.velocity = from->velocity, .acceleration = from->acceleration, .rise = rise};
        shape->to_rest = shortest_change(inner, velocity, knee, -velocity);
    } else {
        shape->to_knee = shortest_change(inner, from->velocity, from->acceleration, knee - from->velocity);
        shape->to_rest = shortest_change(inner, knee, 0, -knee);
    }
    return (int64_t)build(trial, shape, knee, 0);
}

// Find the knee that lands at `distance`, and whether all stays inside the limits. Where it does not, once more with the ticks
// that this knee needs.
static bool lands(struct plan *plan, const struct shape *wanted, const struct planner_limits *limits, const struct planner_limits *inner,
                  const struct planner_state *from, int64_t knee, int64_t distance, int64_t room)
{
    const int64_t step = 1 << 24;
    struct shape shape = *wanted;
    for (int round = 0; round < 4; round++) {
        int64_t miss = distance - (int64_t)build(plan, &shape, knee, 0);
        for (int n = 0; n < 8 && size(miss) > plan->ticks; n++) {
            int64_t slope = (distance - miss - (int64_t)build(plan, &shape, knee - step, 0)) / step;
            if (slope <= 0) return false;
            if (miss / slope == 0) break;
            knee += miss / slope;
            if (!shape.relieves && size(knee) > limits->velocity) return false;
            if (shape.relieves && size(knee) > 2 * limits->acceleration) return false;
            miss = distance - (int64_t)build(plan, &shape, knee, 0);
        }
        if (build(plan, &shape, knee, miss) == (uint64_t)distance && inside(plan, limits, from, room)) return true;
        int64_t left = distance - shape_for(plan, &shape, inner, from, knee);
        if (wanted->cruise) {
            if (knee == 0 || left / knee < 0 || left / knee >> LONGEST_CRUISE_BITS) return false;
            shape.cruise = (uint32_t)(left / knee) + (uint32_t)(round & 1);
        }
    }
    return false;
}

static uint64_t least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

// The shortest way to rest that keeps `room` of the limits free and uses so many quarters of the jerk, into `best` unless
// that is shorter.
static void find(struct plan *best, const struct planner_limits *limits, struct planner_state from, int64_t remaining, int64_t room,
                 uint32_t quarters)
{
    bool trapezoid = limits->jerk == PLANNER_ANY_JERK, found = false;
    struct planner_limits inner = {limits->velocity - (uint64_t)room, limits->acceleration - (uint64_t)room,
                                   trapezoid ? limits->jerk : (limits->jerk - (uint32_t)room) / 4 * quarters};
    struct shape shape = {.relieves = false}, other;
    struct plan trial = {.count = 0};

    // the velocity that is left when the acceleration is taken to zero at once; mirrored so that it is positive
    int64_t straight = from.velocity;
    if (!trapezoid) straight += gained(from.acceleration, -from.acceleration, (uint32_t)ceiling(size(from.acceleration), inner.jerk));
    int64_t sign = straight < 0 ? -1 : 1, top = (int64_t)inner.velocity, low, high;
    remaining *= sign;
    straight *= sign;
    from.velocity *= sign;
    from.acceleration *= sign;
    if (straight > top && (uint64_t)straight <= limits->velocity) top = straight;

    if (remaining < shape_for(&trial, &shape, &inner, &from, 0)) {           // it stops too late, and has to come back
        low = -top;
        high = 0;
    } else if (straight <= top && remaining >= shape_for(&trial, &shape, &inner, &from, straight)) {
        low = straight;
        high = top;
    } else if (!trapezoid && from.acceleration < 0) {
        shape.relieves = true;
        low = from.acceleration;
        high = 0;
    } else {
        low = 0;
        high = straight < top ? straight : top;
    }
    int64_t reach = shape_for(&trial, &shape, &inner, &from, high), back = shape_for(&trial, &shape, &inner, &from, low);
    if (high == top && remaining >= reach) low = high;
    if (low == -top && remaining <= back) high = low;
    other = shape;
    if (low == high) {
        reach = shape_for(&trial, &shape, &inner, &from, low);
        uint64_t cruise = size(remaining - reach) / inner.velocity + 1;
        if (cruise >> LONGEST_CRUISE_BITS) return;
        shape.cruise = (uint32_t)cruise;
        other = shape;
    } else {
        for (int n = 0; n < 24; n++) {
            int64_t middle = low + (high - low) / 2;
            if (shape_for(&trial, &shape, &inner, &from, middle) >= remaining) high = middle;
            else low = middle;
        }
        shape_for(&trial, &shape, &inner, &from, high);
        shape_for(&trial, &other, &inner, &from, low);
    }
    for (uint32_t longer = 0; longer < 32 && !found; longer++) {
        uint32_t more = longer < 8 ? 1 : 1 + (ticks_of(&shape.to_knee) + ticks_of(&shape.to_rest) + 64) / 512 * (longer >> 3);
        for (int which = 0; which < 2; which++) {
            struct shape tried = which ? other : shape;
            if (longer & 1) lengthen(&tried.to_rest, more);
            if (longer & 2) lengthen(&tried.to_knee, more);
            if (longer & 4) tried.cruise += tried.relieves ? 0 : more;
            if (!lands(&trial, &tried, limits, &inner, &from, which ? low : high, remaining, room)) continue;
            found = true;
            if (best->count && best->ticks <= trial.ticks) continue;
            *best = trial;
            for (uint32_t n = 0; n < best->count; n++) {
                best->segment[n].velocity *= sign;
                best->segment[n].acceleration *= sign;
                best->segment[n].jerk *= (int32_t)sign;
            }
        }
    }
}

bool planner_retarget(struct plan *plan, const struct planner_limits *limits, int64_t distance)
{
    struct planner_state from = planner_state_after(plan, 0);
    struct plan best = {.count = 0};
    bool trapezoid = limits->jerk == PLANNER_ANY_JERK;
    uint64_t smallest = least(limits->velocity, limits->acceleration);
    enum planner_cause cause = judge(limits);

    if (!trapezoid) smallest = least(smallest, limits->jerk);
    if (cause) return refuse(plan, cause);
    if (smallest < LEAST_LIMIT)
        return refuse(plan, limits->jerk < LEAST_LIMIT ? PLANNER_NO_JERK : limits->acceleration < LEAST_LIMIT ? PLANNER_NO_ACCELERATION : PLANNER_NO_VELOCITY);
    if (size(distance) >> 38) return refuse(plan, PLANNER_TOO_LONG);
    uint64_t fastest = size(from.velocity) + limits->velocity, ramp = ceiling(fastest, limits->acceleration);
    if (!trapezoid) ramp += ceiling(size(from.acceleration) + limits->acceleration, limits->jerk);
    if (ramp >> 26 || product(fastest, (uint32_t)ramp) >> 61) return refuse(plan, PLANNER_TOO_LONG);

    int64_t remaining = (int64_t)(((uint64_t)distance << 24) - plan->gone);
    find(&best, limits, from, remaining, 4 + (int64_t)(smallest >> 18), 4);
    for (uint32_t quarters = 4; quarters; quarters--)                        // where ticks are few, less jerk makes more of them
        if (quarters == 4 || best.count == 0) find(&best, limits, from, remaining, 4 + (int64_t)(smallest >> 10), quarters);
    if (best.count == 0) return refuse(plan, PLANNER_NO_PLAN);
    best.gone = plan->gone;
    *plan = best;
    return true;
}

bool planner_take_up_to(struct plan *plan, struct planner_segment *piece, bool *last, uint32_t longest)
{
    if (plan->next >= plan->count) return false;
    struct planner_segment *segment = &plan->segment[plan->next];
    *piece = *segment;
    if (plan->stairs) piece->acceleration = piece->jerk = 0;
    if (plan->into) advance(piece, plan->into);
    uint32_t left = segment->ticks - plan->into;
    piece->ticks = left < longest ? left : longest;
    plan->gone += path(piece, piece->ticks);
    plan->into += piece->ticks;
    if (piece->ticks == left) {
        plan->into = 0;
        if (plan->stairs && segment->jerk) segment->jerk--, segment->velocity += segment->acceleration;
        else plan->next++;
    }
    *last = plan->next >= plan->count;
    return true;
}

bool planner_take(struct plan *plan, struct planner_segment *piece, bool *last)
{
    return planner_take_up_to(plan, piece, last, PLANNER_LONGEST_PIECE);
}

struct planner_state planner_state_after(const struct plan *plan, uint32_t ticks)
{
    struct plan rest = *plan;
    struct planner_segment piece;
    bool last;
    while (ticks && planner_take_up_to(&rest, &piece, &last, ticks)) ticks -= piece.ticks;
    struct planner_state state = {.gone = rest.gone};
    if (rest.next < rest.count) {
        piece = rest.segment[rest.next];
        if (rest.stairs) piece.acceleration = piece.jerk = 0;
        if (rest.into) advance(&piece, rest.into);
        state.velocity = piece.velocity;
        state.acceleration = piece.acceleration;
    }
    return state;
}

// SPDX-License-Identifier: Apache-2.0
// retarget -- changes the target of a motion in flight.
//
// The derivation is in docs/planner.md. In short:
// 1. Find the fastest continuous motion from the present velocity and acceleration to rest at the
//    target. Its distance grows with one number, the knee, which is searched.
// 2. Take its positions at the ticks. A change of jerk becomes four steps of the third difference,
//    weighted by the cubic B-spline, so that no difference exceeds the limit of its derivative. The
//    new motion joins the old one JOIN ticks after the retarget.
// 3. Correct the end exactly: what is missing in acceleration, velocity and position is added as
//    pulses of jerk and as single units of 2^-40. A part of the limits is kept free for this.
// Finally the whole plan is checked. A plan that exceeds the limits is never returned: it is made
// again with a larger part kept free.
#include "planner/planner.h"

#include "core/arithmetic.h"
#include "planner/plan.h"

#define ROOM 8u               // units kept free: half for units of jerk, half for the other ones
#define UNIT 2u               // most units of acceleration or velocity at one tick
#define ROOM_SHIFT 12         // 2^-12 of the velocity is free: a retarget may come during a landing
#define TIME_BITS 29          // a motion without its cruise is shorter than 2^29 steps of time
#define LONGEST_RAMP_BITS 27  // of its ticks
#define LONGEST_CRUISE_BITS 30         // of its ticks
#define LONGEST_DISTANCE (1ull << 38)  // 2^-16 period
#define JOIN 2u                        // ticks from a retarget to the first change of jerk

// ------------------------------------------------------------------ the fastest continuous motion
//
// Units: the jerk limit is 1; a step of time is 2^-scale tick; acceleration is in steps, velocity
// in steps^2, position in 2^24 steps^3.
struct phase {
    int sign;  // of the jerk
    uint32_t time;
};

struct motion {
    int64_t velocity, acceleration, position;  // at the end of the phases so far
    int count, cruise;  // number of phases, and the phase before which a cruise may be inserted
    struct phase phase[8];
};

struct problem {
    int64_t velocity, acceleration;  // at the start
    int64_t distance;
    int64_t top_velocity;           // limit
    uint32_t largest_acceleration;  // limit
    bool knee_is_acceleration;      // otherwise it is a velocity
    void (*meanwhile)(void);
};

// Adds a phase of constant jerk: x += v t + a t^2 / 2 + s t^3 / 6, and so on.
static void add_phase(struct motion* m, int sign, uint32_t time) {
    int64_t t = time, sixth = (int64_t)((uint64_t)time * 715827883u >> 32);
    m->phase[m->count++] = (struct phase){sign, time};
    m->position += product(m->velocity + m->acceleration * t / 2 + sign * t * sixth, time, 24);
    m->velocity += m->acceleration * t + sign * (t * t / 2);
    m->acceleration += sign * t;
}

// Adds the phases that reach a velocity at acceleration 0 in the shortest time.
static void change_velocity(struct motion* m, const struct problem* p, int64_t velocity) {
    int64_t gain = velocity - m->velocity, from = m->acceleration, square = from * from / 2,
            hold = 0;
    int direction = gain < (from < 0 ? -square : square) ? -1 : 1;
    uint32_t peak = root((uint64_t)(direction * gain + square));
    if (peak > p->largest_acceleration) {
        peak = p->largest_acceleration;
        hold = 1;
    }
    int64_t rise = peak - direction * from;
    add_phase(m, rise < 0 ? -direction : direction, (uint32_t)size(rise));
    if (hold) {
        hold = direction * (velocity - m->velocity) - (int64_t)((uint64_t)peak * peak / 2);
        add_phase(m, 0, hold > 0 ? (uint32_t)((uint64_t)hold / peak) : 0);
    }
    add_phase(m, -direction, peak);
    m->velocity = velocity;
}

// Makes the motion of a knee, without a cruise, and returns its distance.
static int64_t motion_of_knee(struct motion* m, const struct problem* p, int64_t knee) {
    *m = (struct motion){.velocity = p->velocity, .acceleration = p->acceleration};
    if (p->knee_is_acceleration) {
        add_phase(m, 1, (uint32_t)(knee - p->acceleration));
    } else {
        change_velocity(m, p, knee);
    }
    m->cruise = m->count;
    change_velocity(m, p, 0);
    return m->position;
}

// The error of distance that the landing can correct: with 2^-21 of jerk and acceleration, or half
// of the distance that one step of time makes.
static uint64_t tolerance(const struct motion* m, const struct problem* p) {
    uint64_t time = 0;
    for (int n = 0; n < m->count; n++) time += m->phase[n].time;
    const uint64_t step = (time >> 12) * (least(time, p->largest_acceleration) >> 12);
    time >>= 16;
    return most(step, least(time * time * time / 4, time * time * p->largest_acceleration >> 18));
}

// Searches the knee between two knees, of which `low` is short of the distance by `under` and
// `high` exceeds it by `over`. The method is false position, in which an end that stays for a
// second time weighs less (Anderson and Bjorck, BIT 13 (1973) 253). When that does not help, it
// bisects.
static void search_knee(struct motion* m, const struct problem* p, int64_t low, int64_t high,
                        int64_t under, int64_t over) {
    for (int kept = 0; high - low > 1;) {  // how often low stayed in a row; negative: high
        const uint64_t both = (uint64_t)under + (uint64_t)over;
        int64_t knee = low + (high - low) / 2;
        if (kept > -3 && kept < 3 && under > 0 && over > 0)
            knee = under < over ? low + share(high - low, (uint64_t)under, both)
                                : high - share(high - low, (uint64_t)over, both);
        if (p->meanwhile) p->meanwhile();
        if (knee <= low) knee = low + 1;
        if (knee >= high) knee = high - 1;
        const int64_t miss = motion_of_knee(m, p, knee) - p->distance;
        if (size(miss) <= tolerance(m, p)) return;
        if (miss > 0) {
            kept = kept > 0 ? kept + 1 : 1;
            if (kept > 1)
                under =
                    over > miss ? share(under, (uint64_t)(over - miss), (uint64_t)over) : under / 2;
            high = knee;
            over = miss;
        } else {
            kept = kept < 0 ? kept - 1 : -1;
            if (kept < -1)
                over = under > -miss ? share(over, (uint64_t)(under + miss), (uint64_t)under)
                                     : over / 2;
            low = knee;
            under = -miss;
        }
    }
    motion_of_knee(m, p, low);
}

// Finds the knee, and leaves its phases in *m. Returns the velocity of the cruise; 0: no cruise.
static int64_t find_knee(struct motion* m, struct problem* p) {
    // the velocity that is left when the acceleration is taken to 0 at once
    int64_t level_velocity = p->velocity + p->acceleration * (int64_t)size(p->acceleration) / 2;
    int64_t low = 0, high = level_velocity;
    if (level_velocity > p->top_velocity &&
        level_velocity - p->top_velocity <= p->top_velocity >> (ROOM_SHIFT + 1))
        p->top_velocity = level_velocity;         // rounding of a plan with the same limits
    if (p->distance < motion_of_knee(m, p, 0)) {  // it passes the target and comes back
        low = -p->top_velocity;
        high = 0;
    } else if (level_velocity > p->top_velocity) {
        high = p->top_velocity;
    } else if (p->distance >= motion_of_knee(m, p, level_velocity)) {
        low = level_velocity;
        high = p->top_velocity;
    } else if (p->acceleration < 0) {
        p->knee_is_acceleration = true;
        low = p->acceleration;
        high = 0;
    }
    if (!p->knee_is_acceleration &&
        (high == p->top_velocity ? p->distance >= motion_of_knee(m, p, high)
                                 : p->distance <= motion_of_knee(m, p, low))) {
        if (high == p->top_velocity) motion_of_knee(m, p, high);
        return high == p->top_velocity ? high : low;
    }
    int64_t under = p->distance - motion_of_knee(m, p, low),
            over = motion_of_knee(m, p, high) - p->distance;
    if (!p->knee_is_acceleration && (low < 0 || high == p->top_velocity)) {
        // the bracket is wide: try the velocity of a motion from rest over the missing distance
        const int64_t near = low < 0 ? high : low, miss = low < 0 ? over : under;
        const int64_t power = 1ll << (2 * bits((uint64_t)miss) + 48) / 3,
                      knee = low < 0 ? near - power : near + power;
        if (knee > low && knee < high) {
            const int64_t beyond = motion_of_knee(m, p, knee) - p->distance;
            if (beyond > 0)
                high = knee, over = beyond;
            else
                low = knee, under = -beyond;
        }
    }
    search_knee(m, p, low, high, under, over);
    return 0;
}

// ------------------------------------------------------------------ its positions at the ticks
//
// What is missing at the end of the plan as it is made.
struct landing {
    int64_t position, velocity, acceleration;
};

static void add(struct plan* plan, struct landing* missing, uint32_t tick,
                struct planner_event event) {
    const uint64_t jerk = (uint64_t)event.jerk, acceleration = (uint64_t)event.acceleration,
                   velocity = (uint64_t)event.velocity;
    const uint32_t left = plan->ticks - tick;
    plan_add(plan, tick, event);
    missing->acceleration = (int64_t)((uint64_t)missing->acceleration - jerk * left);
    missing->velocity =
        (int64_t)((uint64_t)missing->velocity - (jerk * pairs(left) + acceleration * left));
    missing->position =
        (int64_t)((uint64_t)missing->position -
                  (jerk * triples(left) + acceleration * pairs(left) + velocity * left));
}

// Changes the jerk at a time in 2^-scale tick, as four events weighted by the cubic B-spline.
static void change_jerk(struct plan* plan, struct landing* missing, uint64_t time, int scale,
                        int64_t jerk) {
    const uint64_t one = 1u << 30, after = (time << (30 - scale)) & (one - 1),
                   before = one - after;         // 2^-30 tick
    uint32_t first = (uint32_t)(time >> scale);  // two ticks earlier, since it counts from the join
    const uint64_t before2 = before * before >> 30, before3 = before2 * before >> 30;
    const uint64_t after3 = (after * after >> 30) * after >> 30;
    uint64_t weight[3] = {before3 / 6, (one + 3 * (before + before2 - before3)) / 6};
    weight[2] = one - weight[0] - weight[1] - after3 / 6;
    int64_t remainder = jerk;
    for (uint8_t n = 0; n < 4; n++) {
        const int64_t step = n < 3 ? product(jerk, (uint32_t)weight[n], 30) : remainder;
        remainder -= step;
        if (step) add(plan, missing, first + n, (struct planner_event){.jerk = step, .slot = n});
    }
}

// ------------------------------------------------------------------ the landing
static void pulse(struct plan* plan, struct landing* missing, uint32_t tick, int64_t sum,
                  uint32_t ticks) {
    const int64_t jerk = sum / ticks, more = sum - jerk * ticks;
    const int sign = (more > 0) - (more < 0);
    struct planner_event event = {.jerk = jerk + sign, .slot = PLANNER_LANDING};
    if (event.jerk) add(plan, missing, tick, event);
    event.jerk = -sign;
    if (sign) add(plan, missing, tick + (uint32_t)size(more), event);
    event.jerk = -jerk;
    if (jerk) add(plan, missing, tick + ticks, event);
}

static void units(struct plan* plan, struct landing* missing, uint32_t tick, int64_t sum,
                  bool of_velocity) {
    const int8_t sign = (int8_t)((sum > 0) - (sum < 0));
    struct planner_event event = {.velocity = of_velocity ? sign : 0,
                                  .acceleration = of_velocity ? 0 : sign,
                                  .slot = PLANNER_LANDING};
    if (sum == 0) return;
    add(plan, missing, tick, event);
    event.velocity = (int8_t)-event.velocity;
    event.acceleration = (int8_t)-event.acceleration;
    add(plan, missing, tick + (uint32_t)size(sum), event);
}

// Adds what is missing at the end. The acceleration is corrected from tick `late` on, after the
// cruise, since over a long cruise it would become a velocity.
static void land(struct plan* plan, struct landing* missing, uint32_t late) {
    const uint32_t quarter = plan->ticks / 4, half = 2 * quarter;
    pulse(plan, missing, late, missing->acceleration, plan->ticks - late);

    int64_t peak = missing->velocity / half, more = missing->velocity - peak * half;
    pulse(plan, missing, 0, peak, half);
    pulse(plan, missing, half, -peak, half);
    units(plan, missing, 0, more, false);

    const int64_t velocity = missing->position / half;
    units(plan, missing, 0, missing->position - velocity * half, true);
    peak = velocity / quarter;
    more = velocity - peak * quarter;
    units(plan, missing, 0, more, false);
    units(plan, missing, half, -more, false);
    pulse(plan, missing, 0, peak, quarter);
    pulse(plan, missing, quarter, -peak, quarter);
    pulse(plan, missing, half, -peak, quarter);
    pulse(plan, missing, half + quarter, peak, quarter);
    add(plan, missing, plan->ticks, (struct planner_event){.slot = PLANNER_LANDING});
}

// ------------------------------------------------------------------ the whole
static enum planner_cause check_limits(const struct planner_limits* limits) {
    if (limits->velocity < PLANNER_LEAST_LIMIT) return PLANNER_NO_VELOCITY;
    if (limits->acceleration < PLANNER_LEAST_LIMIT) return PLANNER_NO_ACCELERATION;
    if (limits->jerk < PLANNER_LEAST_LIMIT) return PLANNER_NO_JERK;
    return PLANNER_OK;
}

// Bits of a square root (of = 2) or a cube root (of = 3) of a number of n bits.
static int part_of_bits(int n, int of) { return n <= 0 ? 0 : (n + of - 1) / of; }

// Whether this event belongs to a change of jerk before the join.
static bool stays(const struct planner_event* event, uint32_t now) {
    return event->slot != PLANNER_LANDING && event->tick < now + event->slot;
}

struct bounds {
    uint64_t velocity, acceleration, jerk;
};

// Where the new motion joins the old one, which continues up to there.
struct join {
    struct planner_progress start, end;
    int64_t begun_jerk[JOIN + 1];    // steps at each tick of changes of jerk that began earlier
    int64_t velocity, acceleration;  // derivatives at the end; the player has differences
};

// The unit of time is 2^-scale tick, the unit of jerk mantissa 2^exponent.
struct scaling {
    int scale, exponent;
    uint32_t mantissa;
};

static void find_join(const struct plan* plan, const struct planner_progress* from, uint8_t event,
                      struct join* join) {
    join->start = *from;
    join->start.jerk += join->start.landing;
    join->start.landing = 0;
    join->end = join->start;
    for (uint32_t tick = 0; tick <= JOIN; tick++) {
        join->begun_jerk[tick] = -join->end.jerk;
        for (; event < plan->count && plan->event[event].tick <= join->start.tick + tick; event++)
            if (stays(&plan->event[event], join->start.tick))
                join->end.jerk += plan->event[event].jerk;
        join->begun_jerk[tick] += join->end.jerk;
        if (tick < JOIN) plan_advance(&join->end, 1);
    }
    join->acceleration = join->end.state.acceleration - join->end.jerk;
    join->velocity =
        join->end.state.velocity - join->end.state.acceleration / 2 + join->end.jerk / 3;
}

// An upper bound of the duration of a motion without its cruise, in bits of its ticks: from the
// bits of the velocity, of the time to stop, of the distance that is left then, and of the time for
// it.
static int duration_bits(const struct join* join, const struct planner_limits* limits,
                         uint64_t jerk, int distance) {
    const int of_jerk = bits(jerk) - 1, of_acceleration = bits(limits->acceleration) - 1,
              bent = bits(size(join->acceleration));
    const int fastest = larger(bits(size(join->velocity)), 2 * bent - of_jerk) + 1,
              turned = larger(fastest, bits(limits->velocity)) + 1;
    const int stop =
        2 + larger(larger(part_of_bits(fastest - of_jerk, 2), fastest - of_acceleration),
                   bent - of_jerk);
    const int length = 1 + larger(distance, fastest + stop);
    const int by_length =
        2 + larger(part_of_bits(length - of_jerk, 3), part_of_bits(length - of_acceleration, 2));
    const int by_speed = 2 + larger(part_of_bits(turned - of_jerk, 2), turned - of_acceleration);
    return 1 + larger(stop, by_length < by_speed ? by_length : by_speed);
}

// Makes the events of a motion with a cruise of this duration.
static void lay_out(struct plan* plan, const struct join* join, const struct motion* motion,
                    uint64_t cruise, const struct scaling* in, int direction, int64_t acceleration,
                    int64_t distance, void (*meanwhile)(void)) {
    const int64_t jerk = (int64_t)((uint64_t)in->mantissa << in->exponent);
    struct planner_progress end = join->start;
    uint64_t time = cruise;
    for (int n = 0; n < motion->count; n++) time += motion->phase[n].time;
    end.tick = 0;
    plan_clear(plan);
    plan->at = end;
    plan->ticks = larger((int)(time >> in->scale) + (int)JOIN + 1, 4);
    plan_advance(&end, plan->ticks);
    struct landing missing = {(int64_t)(((uint64_t)distance << 24) - end.state.moved),
                              -end.state.velocity, -end.state.acceleration};
    for (uint32_t tick = 0; tick <= JOIN; tick++)
        if (join->begun_jerk[tick])
            add(plan, &missing, tick,
                (struct planner_event){.jerk = join->begun_jerk[tick], .slot = 3});
    // the acceleration at the join was rounded: the difference is spread over a few ticks
    const uint32_t soft = in->scale < 11 ? 1u << (11 - in->scale) : 1;
    pulse(plan, &missing, 0, acceleration - join->acceleration,
          soft < plan->ticks ? soft : plan->ticks);

    uint32_t late = 0;
    int64_t before = join->end.jerk;
    time = 0;
    for (int n = 0; n <= motion->count; n++) {
        if (meanwhile) meanwhile();
        const int64_t after = n == motion->count ? 0 : direction * motion->phase[n].sign * jerk;
        if (n == motion->cruise && cruise) {
            change_jerk(plan, &missing, time, in->scale, -before);
            before = 0;
            if (cruise >> in->scale > 8)
                pulse(plan, &missing, (uint32_t)(time >> in->scale) + 4, missing.acceleration, 1);
            time += cruise;
            late = (uint32_t)(time >> in->scale);
        }
        if (n < motion->count && motion->phase[n].time == 0) continue;
        if (after != before) change_jerk(plan, &missing, time, in->scale, after - before);
        before = after;
        if (n < motion->count) time += motion->phase[n].time;
    }
    if (plan->count == 0 && missing.position == 0)
        plan->ticks = 0;  // it is at rest at the target
    else
        land(plan, &missing, late);
}

// The bounds of a plan: its limits, or its state at the start if that exceeds them because they
// were lowered during the motion.
static struct bounds bounds_of(const struct planner_limits* limits, const struct join* join,
                               uint64_t level_velocity) {
    const uint64_t unavoidable = most(size(join->start.state.velocity), level_velocity);
    const uint64_t excess = unavoidable > limits->velocity ? unavoidable - limits->velocity : 0;
    struct bounds bounds = {
        .velocity = limits->velocity + excess + least(excess, unavoidable >> 10),
        .acceleration =
            most(limits->acceleration - UNIT, size(join->start.state.acceleration) + UNIT),
        .jerk = most(limits->jerk == PLANNER_ANY_JERK ? INT64_MAX : limits->jerk - ROOM / 2,
                     size(join->start.jerk) + UNIT)};
    return bounds;
}

// Makes the plan that keeps 2^-share_free of the limits free.
static enum planner_cause make_plan(struct plan* made, const struct join* join,
                                    const struct planner_limits* limits, int64_t distance,
                                    int share_free, struct bounds* bounds,
                                    void (*meanwhile)(void)) {
    const bool any_jerk = limits->jerk == PLANNER_ANY_JERK;
    const int64_t remaining = (int64_t)(((uint64_t)distance << 24) - join->end.state.moved);

    struct planner_limits inner = *limits;
    inner.velocity -=
        ROOM + (inner.velocity >> (share_free < ROOM_SHIFT ? share_free : ROOM_SHIFT));
    inner.acceleration -= ROOM + (inner.acceleration >> share_free);
    inner.jerk -= ROOM + (inner.jerk >> (share_free + 2));
    uint64_t jerk =
        least(any_jerk ? UINT64_MAX : inner.jerk, 4 * least(inner.acceleration, inner.velocity));
    const int duration = duration_bits(join, &inner, jerk, bits(size(remaining)));
    if (duration > LONGEST_RAMP_BITS) return PLANNER_TOO_LONG;

    const uint64_t rise =
        (uint64_t)ratio((int64_t)inner.acceleration, TIME_BITS - duration, jerk) + 1;
    if (rise >> TIME_BITS == 0)
        jerk = (uint64_t)ratio((int64_t)inner.acceleration, TIME_BITS - duration,
                               rise);  // whole steps of time
    struct scaling in = {.scale = TIME_BITS - duration, .exponent = larger(bits(jerk) - 31, 0)};
    in.mantissa = (uint32_t)(jerk >> in.exponent);
    const int of_acceleration = in.scale - in.exponent, of_velocity = of_acceleration + in.scale;
    const int of_distance = of_velocity + in.scale - 24;

    // mirrored so that level_velocity is not negative
    struct problem problem = {.velocity = ratio(join->velocity, of_velocity, in.mantissa),
                              .meanwhile = meanwhile};
    problem.acceleration = ratio(join->acceleration, of_acceleration,
                                 in.mantissa);  // rounded towards 0: never above the limit
    const int64_t level_velocity =
        problem.velocity + problem.acceleration * (int64_t)size(problem.acceleration) / 2;
    const int direction = level_velocity < 0 ? -1 : 1;
    problem.velocity *= direction;
    problem.acceleration *= direction;
    problem.distance = direction * ratio(remaining, of_distance, in.mantissa);
    problem.largest_acceleration =
        (uint32_t)least((uint64_t)ratio((int64_t)inner.acceleration, of_acceleration, in.mantissa),
                        1u << TIME_BITS);
    problem.top_velocity =
        (int64_t)least((uint64_t)ratio((int64_t)inner.velocity, of_velocity, in.mantissa),
                       least((uint64_t)problem.largest_acceleration << TIME_BITS, 1ull << 56));
    struct motion motion;
    const int64_t top_velocity = find_knee(&motion, &problem),
                  speed = product(top_velocity, in.mantissa, of_velocity);
    uint64_t cruise = 0;
    if (speed) {
        const int64_t remainder =
            direction * remaining - product(motion.position, in.mantissa, of_distance);
        cruise = (uint64_t)ratio(top_velocity < 0 ? -remainder : remainder, in.scale, size(speed));
        if (cruise >> in.scale >> LONGEST_CRUISE_BITS) return PLANNER_TOO_LONG;
    }

    *bounds = bounds_of(limits, join, size(product(level_velocity, in.mantissa, of_velocity)));
    lay_out(made, join, &motion, cruise, &in, direction,
            product(direction * problem.acceleration, in.mantissa, of_acceleration), distance,
            meanwhile);
    return PLANNER_OK;
}

// The largest velocity in a segment.
static uint64_t fastest_of(const struct planner_segment* piece, const struct planner_state* end) {
    uint64_t fastest = most(size(piece->velocity), size(end->velocity));
    if (piece->jerk && (piece->acceleration < 0) != (end->acceleration < 0)) {
        // the acceleration passes through 0 after `zero` ticks; what it adds to the velocity till
        // then
        const uint64_t zero = size(piece->acceleration) / size(piece->jerk);
        const uint64_t gain =
            size(piece->acceleration) * (zero + 1) - size(piece->jerk) * pairs((uint32_t)zero + 1);
        fastest = most(fastest, size(piece->velocity +
                                     (piece->acceleration < 0 ? -(int64_t)gain : (int64_t)gain)));
    }
    return fastest;
}

// Whether the plan ends at `distance` and never leaves the bounds.
static bool inside(const struct plan* plan, const struct bounds* bounds, int64_t distance,
                   void (*meanwhile)(void)) {
    struct planner_progress at = plan->at;
    struct planner_segment piece;
    uint8_t next = plan->next;
    bool last;
    while (plan_walk(plan, &at, &next, &piece, &last, PLANNER_LONGEST_PIECE)) {
        if (meanwhile && next % 8 == 0) meanwhile();
        if (size(at.jerk + at.landing) > bounds->jerk) return false;
        if (most(size(piece.acceleration), size(at.state.acceleration)) > bounds->acceleration)
            return false;
        if (fastest_of(&piece, &at.state) > bounds->velocity) return false;
    }
    return at.state.moved == (uint64_t)distance << 24;
}

bool planner_retarget(struct plan* made, const struct plan* plan, uint32_t ticks,
                      const struct planner_limits* limits, int64_t distance,
                      void (*meanwhile)(void)) {
    static const uint8_t shares_free[] = {19, 15, 11, 7, 3};
    struct planner_progress from = plan->at;
    struct planner_segment piece;
    struct bounds bounds;
    struct join join;
    uint8_t next = plan->next;
    bool last;
    enum planner_cause cause = plan->stepped                        ? PLANNER_STEPPED
                               : size(distance) >= LONGEST_DISTANCE ? PLANNER_TOO_LONG
                                                                    : check_limits(limits);
    if (cause) return plan_refuse(made, cause);
    for (; ticks && plan_walk(plan, &from, &next, &piece, &last, ticks); ticks -= piece.ticks) {}
    find_join(plan, &from, next, &join);
    for (unsigned n = 0; n < sizeof shares_free && !cause; n++) {
        cause = make_plan(made, &join, limits, distance, shares_free[n], &bounds, meanwhile);
        if (!cause && inside(made, &bounds, distance, meanwhile)) return true;
    }
    return plan_refuse(made, cause ? cause : PLANNER_NO_PLAN);
}

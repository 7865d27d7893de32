// SPDX-License-Identifier: Apache-2.0
// retarget -- another target for a move in flight.
//
// 1. The fastest continuous motion: from (v, a) to a velocity `knee` with a = 0, a cruise if the
// knee is a limit, and from there
//    to remainder; or, where it decelerates already and would stop too soon, to an acceleration
//    nearer to zero, and from there to remainder. How far it goes grows with the knee, which is
//    searched for. Velocities are in units of the jerk limit, so that a change of acceleration is a
//    time, and times are fixed-point with a step that fits the move.
// 2. Its positions at the ticks. Their third difference is the mean of the jerk over three ticks
// with a quadratic B-spline as
//    weight, so no difference passes the limit of its derivative, and a jump of the jerk at any
//    time is four steps of the third difference at four ticks, weighed by the cubic B-spline
//    (Schoenberg, Quart. Appl. Math. 4 (1946) 45). The last positions before a retarget belong to
//    the motion before, so the motions join two ticks after it.
// 3. The landing: what is missing at the end in acceleration, velocity and position goes in as
// pulses of jerk, and as single
//    units of 2^-40, whose sums are exact. For these the limits keep a part and a few units free.
// Then the whole plan is checked; one that leaves the limits is made again with more of them kept
// free, and never handed out.
#include "planner/planner.h"

#include "core/arithmetic.h"
#include "planner/plan.h"

#define ROOM 8u  // what is kept free for those units: half of it for units in the third difference,
#define UNIT 2u  // half for those in the second and the first, of which so many meet at one tick
#define ROOM_SHIFT \
    12  // 2^-12 of the velocity is free: what a landing adds stays when a retarget comes in the
        // middle of it
#define TIME_BITS 29            // a motion without its cruise is shorter than 2^29 steps of time
#define LONGEST_RAMP_BITS 27    // ticks
#define LONGEST_CRUISE_BITS 30  // ticks
#define LONGEST_DISTANCE (1ull << 38)  // 2^-16 period
#define JOIN 2u                        // ticks from a retarget to the first change of jerk

// ------------------------------------------------------------------ the fastest continuous motion
//
// Time in 2^-scale tick, acceleration in that time, velocity in its square, position in 2^24 of its
// cube.
struct phase {
    int sign;  // of the jerk
    uint32_t time;
};

struct motion {
    int64_t velocity, acceleration, position;  // at its end as far as it is made
    int count, cruise;                         // phases, and which of them may become a cruise
    struct phase phase[8];
};

struct problem {
    int64_t velocity, acceleration;  // at the start
    int64_t distance;
    int64_t top;        // limit of velocity
    uint32_t steepest;  // limit of acceleration
    bool relieves;      // the knee is an acceleration
    void (*meanwhile)(void);
};

static void glide(struct motion* m, int sign, uint32_t time) {
    int64_t t = time, sixth = (int64_t)((uint64_t)time * 715827883u >> 32);
    m->phase[m->count++] = (struct phase){sign, time};
    m->position += product(m->velocity + m->acceleration * t / 2 + sign * t * sixth, time, 24);
    m->velocity += m->acceleration * t + sign * (t * t / 2);
    m->acceleration += sign * t;
}

// To a velocity, acceleration zero, in the shortest time.
static void change(struct motion* m, const struct problem* p, int64_t velocity) {
    int64_t gain = velocity - m->velocity, from = m->acceleration, square = from * from / 2,
            hold = 0;
    int direction = gain < (from < 0 ? -square : square) ? -1 : 1;
    uint32_t peak = root((uint64_t)(direction * gain + square));
    if (peak > p->steepest) {
        peak = p->steepest;
        hold = 1;
    }
    int64_t rise = peak - direction * from;
    glide(m, rise < 0 ? -direction : direction, (uint32_t)size(rise));
    if (hold) {
        hold = direction * (velocity - m->velocity) - (int64_t)((uint64_t)peak * peak / 2);
        glide(m, 0, hold > 0 ? (uint32_t)((uint64_t)hold / peak) : 0);
    }
    glide(m, -direction, peak);
    m->velocity = velocity;
}

// The whole motion for a knee, without a cruise. How far it goes.
static int64_t whole(struct motion* m, const struct problem* p, int64_t knee) {
    *m = (struct motion){.velocity = p->velocity, .acceleration = p->acceleration};
    if (p->relieves) {
        glide(m, 1, (uint32_t)(knee - p->acceleration));
    } else {
        change(m, p, knee);
    }
    m->cruise = m->count;
    change(m, p, 0);
    return m->position;
}

// How far from the wanted distance the landing may be left to make up: a 2^-21st of jerk and
// acceleration does it, or half of what one step of time makes.
static uint64_t tolerance(const struct motion* m, const struct problem* p) {
    uint64_t time = 0;
    for (int n = 0; n < m->count; n++) time += m->phase[n].time;
    const uint64_t step = (time >> 12) * (least(time, p->steepest) >> 12);
    time >>= 16;
    return most(step, least(time * time * time / 4, time * time * p->steepest >> 18));
}

// Between two knees, `under` short of the distance and `over` beyond it. False position; an end
// that stays for a second time weighs less (Anderson and Bjorck, BIT 13 (1973) 253), and where that
// does not help the middle is taken.
static void search(struct motion* m, const struct problem* p, int64_t low, int64_t high,
                   int64_t under, int64_t over) {
    for (int kept = 0; high - low > 1;) {  // how often in a row low stayed; negative: high
        const uint64_t both = (uint64_t)under + (uint64_t)over;
        int64_t knee = low + (high - low) / 2;
        if (kept > -3 && kept < 3 && under > 0 && over > 0)
            knee = under < over ? low + share(high - low, (uint64_t)under, both)
                                : high - share(high - low, (uint64_t)over, both);
        if (p->meanwhile) p->meanwhile();
        if (knee <= low) knee = low + 1;
        if (knee >= high) knee = high - 1;
        const int64_t miss = whole(m, p, knee) - p->distance;
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
    whole(m, p, low);
}

// Find the knee, and leave its phases in *m. The velocity of the cruise, or zero without one.
static int64_t solve(struct motion* m, struct problem* p) {
    int64_t straight = p->velocity + p->acceleration * (int64_t)size(p->acceleration) /
                                         2;  // left when a is taken to zero at once
    int64_t low = 0, high = straight;
    if (straight > p->top && straight - p->top <= p->top >> (ROOM_SHIFT + 1))
        p->top = straight;               // from a plan with these limits
    if (p->distance < whole(m, p, 0)) {  // it stops too late, and has to come back
        low = -p->top;
        high = 0;
    } else if (straight > p->top) {
        high = p->top;
    } else if (p->distance >= whole(m, p, straight)) {
        low = straight;
        high = p->top;
    } else if (p->acceleration < 0) {
        p->relieves = true;
        low = p->acceleration;
        high = 0;
    }
    if (!p->relieves &&
        (high == p->top ? p->distance >= whole(m, p, high) : p->distance <= whole(m, p, low))) {
        if (high == p->top) whole(m, p, high);
        return high == p->top ? high : low;
    }
    int64_t under = p->distance - whole(m, p, low), over = whole(m, p, high) - p->distance;
    if (!p->relieves &&
        (low < 0 ||
         high == p->top)) {  // the bracket is wide: try what would go so far from remainder
        const int64_t near = low < 0 ? high : low, miss = low < 0 ? over : under;
        const int64_t power = 1ll << (2 * bits((uint64_t)miss) + 48) / 3,
                      knee = low < 0 ? near - power : near + power;
        if (knee > low && knee < high) {
            const int64_t beyond = whole(m, p, knee) - p->distance;
            if (beyond > 0)
                high = knee, over = beyond;
            else
                low = knee, under = -beyond;
        }
    }
    search(m, p, low, high, under, over);
    return 0;
}

// ------------------------------------------------------------------ its positions at the ticks
//
// While a plan is made: what the end lacks.
struct landing {
    int64_t position, velocity, acceleration;
};

static void add(struct plan* plan, struct landing* lacks, uint32_t tick,
                struct planner_event event) {
    const uint64_t jerk = (uint64_t)event.jerk, acceleration = (uint64_t)event.acceleration,
                   velocity = (uint64_t)event.velocity;
    const uint32_t left = plan->ticks - tick;
    plan_add(plan, tick, event);
    lacks->acceleration = (int64_t)((uint64_t)lacks->acceleration - jerk * left);
    lacks->velocity =
        (int64_t)((uint64_t)lacks->velocity - (jerk * pairs(left) + acceleration * left));
    lacks->position =
        (int64_t)((uint64_t)lacks->position -
                  (jerk * triples(left) + acceleration * pairs(left) + velocity * left));
}

// The jerk changes at a time of 2^-scale tick.
static void turn(struct plan* plan, struct landing* lacks, uint64_t time, int scale, int64_t jerk) {
    const uint64_t one = 1u << 30, after = (time << (30 - scale)) & (one - 1),
                   before = one - after;         // 2^-30 tick
    uint32_t first = (uint32_t)(time >> scale);  // two ticks before, being counted from the join
    const uint64_t before2 = before * before >> 30, before3 = before2 * before >> 30;
    const uint64_t after3 = (after * after >> 30) * after >> 30;
    uint64_t weight[3] = {before3 / 6, (one + 3 * (before + before2 - before3)) / 6};
    weight[2] = one - weight[0] - weight[1] - after3 / 6;
    int64_t remainder = jerk;
    for (uint8_t n = 0; n < 4; n++) {
        int64_t part = n < 3 ? product(jerk, (uint32_t)weight[n], 30) : remainder;
        remainder -= part;
        if (part) add(plan, lacks, first + n, (struct planner_event){.jerk = part, .slot = n});
    }
}

// ------------------------------------------------------------------ the landing
static void pulse(struct plan* plan, struct landing* lacks, uint32_t tick, int64_t sum,
                  uint32_t ticks) {
    const int64_t jerk = sum / ticks,
                  more = sum -
                         jerk * ticks;  // towards zero: what is left over is as small as it can be
    const int sign = (more > 0) - (more < 0);
    struct planner_event event = {.jerk = jerk + sign, .slot = PLANNER_LANDING};
    if (event.jerk) add(plan, lacks, tick, event);
    event.jerk = -sign;
    if (sign) add(plan, lacks, tick + (uint32_t)size(more), event);
    event.jerk = -jerk;
    if (jerk) add(plan, lacks, tick + ticks, event);
}

static void units(struct plan* plan, struct landing* lacks, uint32_t tick, int64_t sum,
                  bool of_velocity) {
    const int8_t sign = (int8_t)((sum > 0) - (sum < 0));
    struct planner_event event = {.velocity = of_velocity ? sign : 0,
                                  .acceleration = of_velocity ? 0 : sign,
                                  .slot = PLANNER_LANDING};
    if (sum == 0) return;
    add(plan, lacks, tick, event);
    event.velocity = (int8_t)-event.velocity;
    event.acceleration = (int8_t)-event.acceleration;
    add(plan, lacks, tick + (uint32_t)size(sum), event);
}

// Pulses and their remainders: the sum of a pulse counts as often as it is apart from its negative.
// The acceleration is set right where it is lost, from `late` on: left alone over a long cruise it
// would be a velocity.
static void land(struct plan* plan, struct landing* lacks, uint32_t late) {
    const uint32_t quarter = plan->ticks / 4, half = 2 * quarter;
    pulse(plan, lacks, late, lacks->acceleration, plan->ticks - late);

    int64_t peak = lacks->velocity / half, more = lacks->velocity - peak * half;
    pulse(plan, lacks, 0, peak, half);
    pulse(plan, lacks, half, -peak, half);
    units(plan, lacks, 0, more, false);

    const int64_t velocity = lacks->position / half;
    units(plan, lacks, 0, lacks->position - velocity * half, true);
    peak = velocity / quarter;
    more = velocity - peak * quarter;
    units(plan, lacks, 0, more, false);
    units(plan, lacks, half, -more, false);
    pulse(plan, lacks, 0, peak, quarter);
    pulse(plan, lacks, quarter, -peak, quarter);
    pulse(plan, lacks, half, -peak, quarter);
    pulse(plan, lacks, half + quarter, peak, quarter);
    add(plan, lacks, plan->ticks, (struct planner_event){.slot = PLANNER_LANDING});
}

// ------------------------------------------------------------------ the whole
static enum planner_cause judge(const struct planner_limits* limits) {
    if (limits->velocity < PLANNER_LEAST_LIMIT) return PLANNER_NO_VELOCITY;
    if (limits->acceleration < PLANNER_LEAST_LIMIT) return PLANNER_NO_ACCELERATION;
    if (limits->jerk < PLANNER_LEAST_LIMIT) return PLANNER_NO_JERK;
    return PLANNER_OK;
}

// Half of the bits, or a third of them, of a square or a cube.
static int part(int n, int of) { return n <= 0 ? 0 : (n + of - 1) / of; }

// Whether this event belongs to a change of jerk before the join.
static bool stays(const struct planner_event* event, uint32_t now) {
    return event->slot != PLANNER_LANDING && event->tick < now + event->slot;
}

struct bounds {
    uint64_t velocity, acceleration, jerk;
};

// A retarget: the motion before goes on to the join.
struct join {
    struct planner_progress start, end;
    int64_t begun[JOIN + 1];         // still to come of earlier changes of jerk, at each tick
    int64_t velocity, acceleration;  // at the end: derivatives, where the player has differences
};

// Units of time 2^-scale tick and of jerk mantissa 2^exponent.
struct measure {
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
        join->begun[tick] = -join->end.jerk;
        for (; event < plan->count && plan->event[event].tick <= join->start.tick + tick; event++)
            if (stays(&plan->event[event], join->start.tick))
                join->end.jerk += plan->event[event].jerk;
        join->begun[tick] += join->end.jerk;
        if (tick < JOIN) plan_advance(&join->end, 1);
    }
    join->acceleration = join->end.state.acceleration - join->end.jerk;
    join->velocity =
        join->end.state.velocity - join->end.state.acceleration / 2 + join->end.jerk / 3;
}

// Bits of the ticks of a motion without its cruise, from those of the velocity, the time to lose
// it, the distance then left, the time for that.
static int duration_bits(const struct join* join, const struct planner_limits* limits,
                         uint64_t jerk, int distance) {
    const int of_jerk = bits(jerk) - 1, of_acceleration = bits(limits->acceleration) - 1,
              bent = bits(size(join->acceleration));
    const int fastest = larger(bits(size(join->velocity)), 2 * bent - of_jerk) + 1,
              turned = larger(fastest, bits(limits->velocity)) + 1;
    const int stop =
        2 + larger(larger(part(fastest - of_jerk, 2), fastest - of_acceleration), bent - of_jerk);
    const int length = 1 + larger(distance, fastest + stop);
    const int by_length = 2 + larger(part(length - of_jerk, 3), part(length - of_acceleration, 2));
    const int by_speed = 2 + larger(part(turned - of_jerk, 2), turned - of_acceleration);
    return 1 + larger(stop, by_length < by_speed ? by_length : by_speed);
}

// The events of a motion whose middle cruises.
static void lay_out(struct plan* plan, const struct join* join, const struct motion* motion,
                    uint64_t cruise, const struct measure* in, int direction, int64_t acceleration,
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
    struct landing lacks = {(int64_t)(((uint64_t)distance << 24) - end.state.gone),
                            -end.state.velocity, -end.state.acceleration};
    for (uint32_t tick = 0; tick <= JOIN; tick++)
        if (join->begun[tick])
            add(plan, &lacks, tick, (struct planner_event){.jerk = join->begun[tick], .slot = 3});
    const uint32_t soft =
        in->scale < 11 ? 1u << (11 - in->scale) : 1;  // the acceleration at the join was rounded
    pulse(plan, &lacks, 0, acceleration - join->acceleration,
          soft < plan->ticks ? soft : plan->ticks);

    uint32_t late = 0;
    int64_t before = join->end.jerk;
    time = 0;
    for (int n = 0; n <= motion->count; n++) {
        if (meanwhile) meanwhile();
        const int64_t after = n == motion->count ? 0 : direction * motion->phase[n].sign * jerk;
        if (n == motion->cruise && cruise) {
            turn(plan, &lacks, time, in->scale, -before);
            before = 0;
            if (cruise >> in->scale > 8)
                pulse(plan, &lacks, (uint32_t)(time >> in->scale) + 4, lacks.acceleration, 1);
            time += cruise;
            late = (uint32_t)(time >> in->scale);
        }
        if (n < motion->count && motion->phase[n].time == 0) continue;
        if (after != before) turn(plan, &lacks, time, in->scale, after - before);
        before = after;
        if (n < motion->count) time += motion->phase[n].time;
    }
    if (plan->count == 0 && lacks.position == 0)
        plan->ticks = 0;  // it stands where it shall
    else
        land(plan, &lacks, late);
}

// What a plan must not exceed: its limits, or what its start exceeds after limits were lowered in
// motion.
static struct bounds bounds_of(const struct planner_limits* limits, const struct join* join,
                               uint64_t straight) {
    const uint64_t unavoidable = most(size(join->start.state.velocity), straight);
    const uint64_t excess = unavoidable > limits->velocity ? unavoidable - limits->velocity : 0;
    struct bounds bounds = {
        .velocity = limits->velocity + excess + least(excess, unavoidable >> 10),
        .acceleration =
            most(limits->acceleration - UNIT, size(join->start.state.acceleration) + UNIT),
        .jerk = most(limits->jerk == PLANNER_ANY_JERK ? INT64_MAX : limits->jerk - ROOM / 2,
                     size(join->start.jerk) + UNIT)};
    return bounds;
}

// The plan that keeps 2^-part_free of the limits free.
static enum planner_cause make(struct plan* made, const struct join* join,
                               const struct planner_limits* limits, int64_t distance, int part_free,
                               struct bounds* bounds, void (*meanwhile)(void)) {
    const bool any_jerk = limits->jerk == PLANNER_ANY_JERK;
    const int64_t remaining = (int64_t)(((uint64_t)distance << 24) - join->end.state.gone);

    struct planner_limits inner = *limits;
    inner.velocity -= ROOM + (inner.velocity >> (part_free < ROOM_SHIFT ? part_free : ROOM_SHIFT));
    inner.acceleration -= ROOM + (inner.acceleration >> part_free);
    inner.jerk -= ROOM + (inner.jerk >> (part_free + 2));
    uint64_t jerk =
        least(any_jerk ? UINT64_MAX : inner.jerk, 4 * least(inner.acceleration, inner.velocity));
    const int duration = duration_bits(join, &inner, jerk, bits(size(remaining)));
    if (duration > LONGEST_RAMP_BITS) return PLANNER_TOO_LONG;

    const uint64_t rise =
        (uint64_t)ratio((int64_t)inner.acceleration, TIME_BITS - duration, jerk) + 1;
    if (rise >> TIME_BITS == 0)
        jerk = (uint64_t)ratio((int64_t)inner.acceleration, TIME_BITS - duration,
                               rise);  // in whole steps
    struct measure in = {.scale = TIME_BITS - duration, .exponent = larger(bits(jerk) - 31, 0)};
    in.mantissa = (uint32_t)(jerk >> in.exponent);
    const int of_acceleration = in.scale - in.exponent, of_velocity = of_acceleration + in.scale;
    const int of_distance = of_velocity + in.scale - 24;

    // mirrored so that it goes forward when the acceleration is taken to zero
    struct problem problem = {.velocity = ratio(join->velocity, of_velocity, in.mantissa),
                              .meanwhile = meanwhile};
    problem.acceleration = ratio(join->acceleration, of_acceleration,
                                 in.mantissa);  // towards zero: never above the limit
    const int64_t straight =
        problem.velocity + problem.acceleration * (int64_t)size(problem.acceleration) / 2;
    const int direction = straight < 0 ? -1 : 1;
    problem.velocity *= direction;
    problem.acceleration *= direction;
    problem.distance = direction * ratio(remaining, of_distance, in.mantissa);
    problem.steepest =
        (uint32_t)least((uint64_t)ratio((int64_t)inner.acceleration, of_acceleration, in.mantissa),
                        1u << TIME_BITS);
    problem.top = (int64_t)least((uint64_t)ratio((int64_t)inner.velocity, of_velocity, in.mantissa),
                                 least((uint64_t)problem.steepest << TIME_BITS, 1ull << 56));
    struct motion motion;
    const int64_t top = solve(&motion, &problem), speed = product(top, in.mantissa, of_velocity);
    uint64_t cruise = 0;
    if (speed) {
        const int64_t remainder =
            direction * remaining - product(motion.position, in.mantissa, of_distance);
        cruise = (uint64_t)ratio(top < 0 ? -remainder : remainder, in.scale, size(speed));
        if (cruise >> in.scale >> LONGEST_CRUISE_BITS) return PLANNER_TOO_LONG;
    }

    *bounds = bounds_of(limits, join, size(product(straight, in.mantissa, of_velocity)));
    lay_out(made, join, &motion, cruise, &in, direction,
            product(direction * problem.acceleration, in.mantissa, of_acceleration), distance,
            meanwhile);
    return PLANNER_OK;
}

// The largest velocity, inside the piece too.
static uint64_t fastest_of(const struct planner_segment* piece, const struct planner_state* end) {
    uint64_t fastest = most(size(piece->velocity), size(end->velocity));
    if (piece->jerk && (piece->acceleration < 0) != (end->acceleration < 0)) {
        const uint64_t turn = size(piece->acceleration) /
                              size(piece->jerk);  // all of it goes to the velocity in so many ticks
        const uint64_t gain =
            size(piece->acceleration) * (turn + 1) - size(piece->jerk) * pairs((uint32_t)turn + 1);
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
    return at.state.gone == (uint64_t)distance << 24;
}

bool planner_retarget(struct plan* made, const struct plan* plan, uint32_t ticks,
                      const struct planner_limits* limits, int64_t distance,
                      void (*meanwhile)(void)) {
    static const uint8_t parts_free[] = {19, 15, 11, 7, 3};
    struct planner_progress from = plan->at;
    struct planner_segment piece;
    struct bounds bounds;
    struct join join;
    uint8_t next = plan->next;
    bool last;
    enum planner_cause cause = plan->stepped                        ? PLANNER_STEPPED
                               : size(distance) >= LONGEST_DISTANCE ? PLANNER_TOO_LONG
                                                                    : judge(limits);
    if (cause) return plan_refuse(made, cause);
    for (; ticks && plan_walk(plan, &from, &next, &piece, &last, ticks); ticks -= piece.ticks) {}
    find_join(plan, &from, next, &join);
    for (unsigned n = 0; n < sizeof parts_free && !cause; n++) {
        cause = make(made, &join, limits, distance, parts_free[n], &bounds, meanwhile);
        if (!cause && inside(made, &bounds, distance, meanwhile)) return true;
    }
    return plan_refuse(made, cause ? cause : PLANNER_NO_PLAN);
}

// SPDX-License-Identifier: Apache-2.0
// plan -- a motion as a list of changes at instants.
//
// In each tick the player adds: target += v, v += a, a += j. The sums over several ticks are in
// docs/planner.md.
#include "planner/plan.h"

#include "core/arithmetic.h"

void plan_clear(struct plan* plan) {
    plan->ticks = 0;
    plan->count = plan->next = 0;
    plan->cause = PLANNER_OK;
    plan->stepped = false;
    plan->at = (struct planner_progress){.tick = 0};
}

bool plan_refuse(struct plan* plan, enum planner_cause cause) {
    plan->cause = (uint8_t)cause;
    return false;
}

void plan_add(struct plan* plan, uint32_t tick, struct planner_event event) {
    uint32_t at = plan->count;
    struct planner_event* const list = plan->event;
    while (at && (list[at - 1].tick > tick ||
                  (list[at - 1].tick == tick && list[at - 1].slot > event.slot)))
        at--;
    if (at && list[at - 1].tick == tick && list[at - 1].slot == event.slot) {
        list[at - 1].velocity = (int8_t)(list[at - 1].velocity + event.velocity);
        list[at - 1].acceleration = (int8_t)(list[at - 1].acceleration + event.acceleration);
        list[at - 1].jerk += event.jerk;
    } else {
        for (uint32_t n = plan->count++; n > at; n--) list[n] = list[n - 1];
        list[at] = event;
        list[at].tick = tick;
    }
}

void plan_advance(struct planner_progress* at, uint32_t ticks) {
    struct planner_state* s = &at->state;
    int64_t jerk = at->jerk + at->landing;
    at->tick += ticks;
    if (ticks == 1) {  // most pieces of a short motion: without the products
        s->moved += (uint64_t)s->velocity;
        s->velocity += s->acceleration;
        s->acceleration += jerk;
        return;
    }
    s->moved += (uint64_t)s->velocity * ticks + (uint64_t)s->acceleration * pairs(ticks) +
                (uint64_t)jerk * triples(ticks);
    s->velocity += (int64_t)((uint64_t)s->acceleration * ticks + (uint64_t)jerk * pairs(ticks));
    s->acceleration += jerk * ticks;
}

// Adds the events of the instant at which `at` is; `at` may be a copy of the progress of the plan.
static void plan_settle(const struct plan* plan, struct planner_progress* at, uint8_t* next) {
    if (plan->stepped) {
        const struct planner_segment* section = &plan->section[*next];
        at->state.velocity =
            *next < plan->count
                ? section->velocity + section->acceleration * (at->tick / section->ticks)
                : 0;
        return;
    }
    for (const struct planner_event* event = &plan->event[*next];
         *next < plan->count && event->tick == at->tick; event++, ++*next) {
        at->state.velocity += event->velocity;
        at->state.acceleration += event->acceleration;
        *(event->slot == PLANNER_LANDING ? &at->landing : &at->jerk) += event->jerk;
    }
}

bool plan_walk(const struct plan* plan, struct planner_progress* at, uint8_t* next,
               struct planner_segment* piece, bool* last, uint32_t longest) {
    if (*next >= plan->count) return false;
    plan_settle(plan, at, next);
    uint32_t end = plan->ticks, until;
    if (plan->stepped) {
        const struct planner_segment* section = &plan->section[*next];
        end = section->ticks * ((uint32_t)section->jerk + 1);
        until = section->ticks - at->tick % section->ticks;
    } else {
        until = plan->event[*next].tick - at->tick;
    }
    const int64_t jerk = at->jerk + at->landing;
    const bool fits = (int32_t)jerk ==
                      jerk;  // a jerk above 32 bits is left out: it has no effect within one tick
    if (until > longest) until = longest;
    if (!fits) until = 1;
    *piece = (struct planner_segment){at->state.velocity, at->state.acceleration,
                                      fits ? (int32_t)jerk : 0, until};
    plan_advance(at, until);
    if (at->tick == end) {
        *next = plan->stepped ? (uint8_t)(*next + 1) : plan->count;
        if (plan->stepped) at->tick = 0;
    }
    *last = *next >= plan->count;
    return true;
}

// The velocity of the tick that follows a progress.
static int64_t velocity_at(const struct plan* plan, const struct planner_progress* at,
                           uint8_t next) {
    int64_t velocity = at->state.velocity;
    for (; next < plan->count && plan->event[next].tick == at->tick; next++)
        velocity += plan->event[next].velocity;
    return velocity;
}

// Joins the next tick to a segment of one tick, if the jerk fits into 32 bits.
static void join(struct plan* plan, struct planner_segment* piece, bool* last) {
    struct planner_progress at = plan->at;
    uint8_t next = plan->next;
    struct planner_segment tick;
    bool ends;
    plan_walk(plan, &at, &next, &tick, &ends, 1);
    const int64_t acceleration = tick.velocity - piece->velocity,
                  after = ends ? tick.acceleration : velocity_at(plan, &at, next) - tick.velocity,
                  jerk = after - acceleration;
    if ((int32_t)jerk != jerk) return;
    *piece = (struct planner_segment){piece->velocity, acceleration, (int32_t)jerk, 2};
    plan->at = at;
    plan->next = next;
    *last = ends;
}

bool planner_take_up_to(struct plan* plan, struct planner_segment* piece, bool* last,
                        uint32_t longest) {
    if (!plan_walk(plan, &plan->at, &plan->next, piece, last, longest)) return false;
    if (!plan->stepped && !*last && piece->ticks == 1 && longest > 1) join(plan, piece, last);
    return true;
}

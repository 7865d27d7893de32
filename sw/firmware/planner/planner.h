// SPDX-License-Identifier: Apache-2.0
// planner -- a move as segments of constant jerk for profile_player, landing exactly. No hardware,
// no state, no floating point.
//
// Limits and moves: planner.c. Another target in flight: retarget.c. What a plan is, and taking it
// piece by piece: plan.c.
#ifndef MOIRE_PLANNER_H
#define MOIRE_PLANNER_H

#include <stdbool.h>
#include <stdint.h>

#include "planner/plan_types.h"

#define PLANNER_TICK_HZ 4000u
#define PLANNER_ANY_JERK \
    UINT32_MAX  // limits.jerk: trapezoid, the acceleration changes within three ticks
#define PLANNER_LEAST_LIMIT \
    64u  // smaller limits leave a retarget no room for the units that make it exact

struct planner_limits {  // 2^-40 period per tick, tick^2, tick^3
    uint64_t velocity;
    uint64_t acceleration;
    uint32_t jerk;
};

struct planner_stepped_profile {  // S4: velocity in steps of constant duration, three sections up
                                  // and three down
    uint64_t first, top;          // 2^-40 period/tick
    uint64_t rise[3];             // of a step in sections 1, 2, 3
    uint64_t border[2];           // velocity at which section 2 and 3 begin
    uint32_t ticks;               // of a step
};

// In units of the player from 2^-16 period/s; rounded down.
uint64_t planner_velocity(uint64_t velocity);

// The limits from period/s, period/s^2, period/s^3; rounded down, and jerk held to 31 bits.
struct planner_limits planner_limits(uint32_t velocity, uint32_t acceleration, uint32_t jerk);

// How fast an override may change while a plan is played, so that this adds a quarter of
// acceleration and jerk at most: 2^-32 per tick, and per tick^2 (0: not limited).
void planner_feed_override(const struct planner_limits* limits, uint32_t* slope, uint32_t* curve);

// From rest to rest over `distance` (2^-16 period). false: refused, plan->cause says why.
bool planner_move(struct plan* plan, const struct planner_limits* limits, int64_t distance);

// The same with S4's seven sections.
bool planner_stepped_move(struct plan* plan, const struct planner_stepped_profile* stepped,
                          int64_t distance);

// Where sections 2 and 3 begin, 2^-16 of the way from first to top. S4: 1/6 and 1/2, which is
// 1:2:3; 1/6 and 1/3 as its paper prints it.
void planner_stepped_borders(struct planner_stepped_profile* stepped, uint32_t second,
                             uint32_t third);

// The plan that goes on from where `plan` is when `ticks` more than those taken have been played,
// which must not be its end, to rest at `distance` (2^-16 period) from where `plan` began. false:
// refused, made->cause says why. It takes its time, so it calls `meanwhile` now and then, if that
// is not null; this may take pieces of `plan`.
bool planner_retarget(struct plan* made, const struct plan* plan, uint32_t ticks,
                      const struct planner_limits* limits, int64_t distance,
                      void (*meanwhile)(void));

#endif

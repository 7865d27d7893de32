// SPDX-License-Identifier: Apache-2.0
// planner -- plans a motion as segments of constant jerk for the motion engine. It ends exactly at
// the target and stays inside its limits.
//
// The functions use no hardware, no state and no floating point. planner.c has the limits and the
// motions from rest to rest, retarget.c the change of target in flight, plan.c the list of events.
// Units: distance 2^-16 period; velocity, acceleration and jerk 2^-40 period per tick, per tick^2
// and per tick^3. docs/planner.md has the formulae.
#ifndef MOIRE_PLANNER_H
#define MOIRE_PLANNER_H

#include <stdbool.h>
#include <stdint.h>

#include "planner/plan_types.h"

#define PLANNER_TICK_HZ 4000u
#define PLANNER_ANY_JERK UINT32_MAX  // trapezoid: the acceleration changes within three ticks
#define PLANNER_LEAST_LIMIT 64u      // least limit for a retarget, which needs units to spare

struct planner_limits {
    uint64_t velocity;
    uint64_t acceleration;
    uint32_t jerk;
};

// S4: velocity in steps of constant duration, in three sections up and three down.
struct planner_stepped_profile {
    uint64_t first, top;  // velocity of the first and of the last step
    uint64_t rise[3];     // increment of a step in sections 1, 2, 3
    uint64_t border[2];   // velocity at which sections 2 and 3 begin
    uint32_t ticks;       // duration of a step
};

// Velocity in units of the player, from 2^-16 period/s; rounded down.
uint64_t planner_velocity(uint64_t velocity);

// Limits from period/s, period/s^2 and period/s^3; rounded down, the jerk saturates at 31 bits.
struct planner_limits planner_limits(uint32_t velocity, uint32_t acceleration, uint32_t jerk);

// How fast the feed override may change while a plan is played, so that this adds at most a quarter
// of the limits of acceleration and jerk: in 2^-32 per tick, and per tick^2 (0: not limited).
void planner_feed_override(const struct planner_limits* limits, uint32_t* slope, uint32_t* curve);

// Plans a motion from rest to rest over `distance`. Returns false if it is refused: plan->cause
// says why.
bool planner_move(struct plan* plan, const struct planner_limits* limits, int64_t distance);

// The same with the stepped profile.
bool planner_stepped_move(struct plan* plan, const struct planner_stepped_profile* stepped,
                          int64_t distance);

// Sets the borders of the sections 2 and 3, as fractions between first and top in 2^-16. S4 uses
// 1/6 and 1/2, which is 1:2:3; its paper prints 1/6 and 1/3.
void planner_stepped_borders(struct planner_stepped_profile* stepped, uint32_t second,
                             uint32_t third);

// Plans the continuation of `plan` to another target: it joins `plan` `ticks` after the last
// segment that was taken, which must be before its end, and ends at rest at `distance` from where
// `plan` began. Returns false if it is refused: made->cause says why. It takes about 300 000 cycles
// and calls `meanwhile` repeatedly, if that is not null; `meanwhile` may take segments of `plan`.
bool planner_retarget(struct plan* made, const struct plan* plan, uint32_t ticks,
                      const struct planner_limits* limits, int64_t distance,
                      void (*meanwhile)(void));

#endif

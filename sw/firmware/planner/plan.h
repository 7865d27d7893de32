// SPDX-License-Identifier: Apache-2.0
// plan -- builds the list of events of a plan, and walks through it segment by segment.
#ifndef MOIRE_PLAN_H
#define MOIRE_PLAN_H

#include "planner/plan_types.h"

void plan_clear(struct plan* plan);  // no event, at rest; the union is not touched
bool plan_refuse(struct plan* plan, enum planner_cause cause);  // sets the cause; returns false

// Adds an event at a tick. Events of the same tick and slot are summed.
void plan_add(struct plan* plan, uint32_t tick, struct planner_event event);

// Advances by a number of ticks in which nothing changes.
void plan_advance(struct planner_progress* at, uint32_t ticks);

// The next segment from a progress `at`, event `next`; see planner_take_up_to.
bool plan_walk(const struct plan* plan, struct planner_progress* at, uint8_t* next,
               struct planner_segment* piece, bool* last, uint32_t longest);

// Takes the next segment for the queue of the player, of at most `longest` ticks. *last: the plan
// ends with it. Returns false when nothing is left.
// Events may be a tick apart, but the queue of the player holds few segments. So a segment of one
// tick is joined to the next tick. Velocity, acceleration and jerk give the velocities of both and
// of the tick after them, so this is exact, and the acceleration continues as without it. Only
// these are shorter: the last segment, one whose jerk does not fit into 32 bits, and those of a
// stepped profile.
bool planner_take_up_to(struct plan* plan, struct planner_segment* piece, bool* last,
                        uint32_t longest);

#endif

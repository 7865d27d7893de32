// SPDX-License-Identifier: Apache-2.0
// plan -- a move as what changes at instants: how the planner puts it together and walks through
// it.
#ifndef MOIRE_PLAN_H
#define MOIRE_PLAN_H

#include "planner/plan_types.h"

void plan_clear(struct plan* plan);  // no event, at rest; the union is left as it is
bool plan_refuse(struct plan* plan, enum planner_cause cause);  // false
void plan_add(struct plan* plan, uint32_t tick, struct planner_event event);

// So many ticks on, in which nothing changes.
void plan_advance(struct planner_progress* at, uint32_t ticks);

// The next piece from a place; see planner_take_up_to.
bool plan_walk(const struct plan* plan, struct planner_progress* at, uint8_t* next,
               struct planner_segment* piece, bool* last, uint32_t longest);

// The next piece to queue, of so many ticks at most; *last tells that the plan ends with it. false:
// nothing is left.
bool planner_take_up_to(struct plan* plan, struct planner_segment* piece, bool* last,
                        uint32_t longest);

#endif

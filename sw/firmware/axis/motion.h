// SPDX-License-Identifier: Apache-2.0
// motion -- one motion at a time of an axis: plans it, feeds the profile player, and detects the
// end and the settling.
//
// Distances and positions are in 2^-16 period. A `velocity_id` is the parameter that limits the
// velocity.
#ifndef MOIRE_MOTION_H
#define MOIRE_MOTION_H

#include <stdbool.h>
#include <stdint.h>

void motion_set_target_to_position(unsigned n);  // at once, at velocity 0, with an empty queue
void motion_controlled_stop(unsigned n);         // within the limits of acceleration and jerk
void motion_feed(unsigned n);  // fills the queue of the player; to be called often while it plays

// Plans a motion and fills the queue; the player must be at rest. A distance of 0 plays nothing.
// Returns ok, or why the planner refuses: out_of_range, too_long, stepped_profile_invalid.
// motion_play starts it too.
uint8_t motion_prepare(unsigned n, int64_t distance, uint8_t velocity_id);
void motion_start(unsigned n);
uint8_t motion_play(unsigned n, int64_t distance, uint8_t velocity_id);

// Changes the target of the motion in flight. If it is refused, the motion continues unchanged.
// Returns the causes of motion_prepare, and busy when the motion is too near its end, has a stepped
// profile, or another axis is being replanned.
uint8_t motion_retarget(unsigned n, int64_t target, uint8_t velocity_id);

bool motion_played(unsigned n);     // the player is at rest and no piece is left
bool motion_complete(unsigned n);   // the target is exactly where the plan ends
uint32_t motion_ticks(unsigned n);  // duration of the motion that was planned last

// Settling: the error must stay inside the window for settle_time.
void motion_settle_begin(unsigned n);
uint8_t motion_settle(unsigned n, int64_t window);  // ok, not_settled, or running
bool motion_overdue(unsigned n);  // settle_timeout has passed since motion_settle_begin
bool motion_inside(unsigned n, int64_t window);  // the following error is inside the window now

#endif

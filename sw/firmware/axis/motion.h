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

#include "planner/plan_types.h"

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

// A stream hands its pieces to the player itself. `feed` is called by motion_feed, also for axes
// without a stream, while no plan is left; a null pointer ends this.
void motion_set_stream(void (*feed)(unsigned n));
// Queues a piece of at most 255 ticks; the queue must have room. `to` is the target at the end of
// the stream, as far as it is known.
void motion_stream(unsigned n, const struct planner_segment* piece, bool last, int64_t to);
// The motion that was prepared follows set-points, which set_point_player plays: its end is not
// known.
void motion_follow(unsigned n);
bool motion_follows(unsigned n);     // the motion prepared last follows set-points
uint32_t motion_room(unsigned n);    // pieces that fit into the queue of the player
uint32_t motion_queued(unsigned n);  // ticks in it, without the piece that is being played
uint32_t motion_busy_ticks(void);    // longest time between two calls of motion_feed

// Settling: the axis must be held for good and the error stay inside the window for settle_time.
void motion_settle_begin(unsigned n);
uint8_t motion_settle(unsigned n, bool held, int64_t window);  // ok, not_settled, or running
bool motion_overdue(unsigned n);  // settle_timeout has passed since motion_settle_begin
bool motion_inside(unsigned n, int64_t window);  // the following error is inside the window now

#endif

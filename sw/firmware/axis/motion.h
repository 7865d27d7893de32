// SPDX-License-Identifier: Apache-2.0
// motion -- one motion at a time of an axis: plan it, feed the player, know when it has been played
// and has settled.
#ifndef MOIRE_MOTION_H
#define MOIRE_MOTION_H

#include <stdbool.h>
#include <stdint.h>

void motion_set_target_to_position(unsigned n);  // target := position, standing, nothing queued
void motion_controlled_stop(unsigned n);         // controlled stop
void motion_feed(unsigned n);                    // to be called often while something is played

// The player must stand. A distance of zero plays nothing. ok, or why the planner refuses it.
// motion_play starts at once.
uint8_t motion_prepare(unsigned n, int64_t distance, uint8_t velocity_id);
void motion_start(unsigned n);
uint8_t motion_play(unsigned n, int64_t distance, uint8_t velocity_id);

// Another target (2^-16 period) while a motion is played. Refused, it goes on as it was; busy: it
// is too near its end, or climbs stairs.
uint8_t motion_retarget(unsigned n, int64_t target, uint8_t velocity_id);

bool motion_played(unsigned n);
uint32_t motion_ticks(unsigned n);  // duration of the motion planned last

// ok, not_settled, or running as long as neither is decided.
void motion_settle_begin(unsigned n);
uint8_t motion_settle(unsigned n, int64_t window);
bool motion_overdue(unsigned n);  // settle_timeout has passed since motion_settle_begin
bool motion_inside(unsigned n, int64_t window);  // the following error is

#endif

// SPDX-License-Identifier: Apache-2.0
// planner -- a move as segments of constant jerk for profile_player, in exact integers. No hardware, no state.
#ifndef MOIRE_PLANNER_H
#define MOIRE_PLANNER_H

#include <stdbool.h>
#include <stdint.h>

#define PLANNER_TICK_HZ 4000u
#define PLANNER_SEGMENTS 16u            // room for the 15 instants at which a move changes
#define PLANNER_LONGEST_PIECE 0x800000u // ticks in one push; profile_player takes 24 bits

struct planner_limits {                 // 2^-40 period per tick, tick^2, tick^3
    uint64_t velocity;
    uint64_t acceleration;
    uint32_t jerk;
};

struct planner_segment {                // values at its start
    int64_t velocity;
    int64_t acceleration;
    int32_t jerk;
    uint32_t ticks;
};

struct plan {
    uint32_t ticks;                     // of the whole move
    uint8_t count;                      // segments
    uint8_t next;                       // first segment not yet taken whole
    struct planner_segment segment[PLANNER_SEGMENTS];
};

// The limits in units of the player from period/s, period/s^2, period/s^3; rounded down, and jerk held to 31 bits.
uint64_t planner_velocity(uint32_t velocity);
struct planner_limits planner_limits(uint32_t velocity, uint32_t acceleration, uint32_t jerk);

// From rest to rest over `distance` (2^-16 period). false: it would cruise for 2^30 ticks (3 days) or more.
bool planner_move(struct plan *plan, const struct planner_limits *limits, int64_t distance);

// The next piece to queue; *last tells that the plan ends with it. false: nothing is left.
bool planner_take(struct plan *plan, struct planner_segment *piece, bool *last);

#endif

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

#define PLANNER_TICK_HZ 4000u
#define PLANNER_EVENTS 60u   // instants at which a move changes; 57 at most
#define PLANNER_SECTIONS 9u  // of stepped: a tick of rest, three up, two at the top, three down
#define PLANNER_LONGEST_PIECE 0x800000u  // ticks in one push; profile_player takes 24 bits
#define PLANNER_ANY_JERK \
    UINT32_MAX  // limits.jerk: trapezoid, the acceleration changes within three ticks
#define PLANNER_LEAST_LIMIT \
    64u  // smaller limits leave a retarget no room for the units that make it exact

struct planner_limits {  // 2^-40 period per tick, tick^2, tick^3
    uint64_t velocity;
    uint64_t acceleration;
    uint32_t jerk;
};

enum planner_cause {
    PLANNER_OK,
    PLANNER_NO_VELOCITY,  // the limit is zero in units of the player; for a retarget, below
                          // PLANNER_LEAST_LIMIT
    PLANNER_NO_ACCELERATION,
    PLANNER_NO_JERK,   // below two units: no pulse of jerk can be made
    PLANNER_TOO_LONG,  // a cruise of 2^30 ticks (3 days), a retarget with ramps of 2^27 ticks or
                       // 2^22 periods, or more
    PLANNER_BORDERS,   // stepped whose borders or steps are not in order
    PLANNER_TOO_MANY_LEVELS,  // above 4096
    PLANNER_STEPPED,          // stepped go on to where they were planned to go
    PLANNER_NO_PLAN  // none inside the limits was found, even with an eighth of them kept free
};

struct planner_segment {  // values at its start
    int64_t velocity;
    int64_t acceleration;
    int32_t jerk;
    uint32_t ticks;
};

struct planner_event {  // what is added at one instant
    int64_t jerk;
    uint32_t tick;
    int8_t velocity;
    int8_t acceleration;
    uint8_t slot;  // 0..3: of the events of one change of jerk; PLANNER_LANDING: it makes the
                   // landing exact
};

#define PLANNER_LANDING 4u

struct planner_state {  // after a tick
    uint64_t gone;      // 2^-40 period since the plan began, modulo 2^64
    int64_t velocity;   // of the next tick
    int64_t acceleration;
};

struct planner_progress {  // how far a plan was taken
    struct planner_state state;
    int64_t jerk;
    int64_t landing;  // jerk of the events that make the landing exact
    uint32_t tick;    // since the plan was made or retargeted, or of this section of stepped
};

struct plan {
    uint32_t ticks;  // of the whole move, from where it was made or retargeted
    uint8_t count;   // events, or sections of stepped
    uint8_t next;    // first of them not yet taken; `count`: nothing is left
    uint8_t cause;   // planner_cause: why the last request was refused
    bool stepped;
    struct planner_progress at;
    union {
        struct planner_event event[PLANNER_EVENTS];
        struct planner_segment section[PLANNER_SECTIONS];  // `jerk` + 1 stepped of constant
                                                           // velocity, `acceleration` apart
    };
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

// The next piece to queue, of so many ticks at most; *last tells that the plan ends with it. false:
// nothing is left.
bool planner_take_up_to(struct plan* plan, struct planner_segment* piece, bool* last,
                        uint32_t longest);

#endif

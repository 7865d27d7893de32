// SPDX-License-Identifier: Apache-2.0
// plan_types -- a move as a list of events, and how far it was played.
#ifndef MOIRE_PLAN_TYPES_H
#define MOIRE_PLAN_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#define PLANNER_EVENTS 60u   // instants at which a move changes; 57 at most
#define PLANNER_SECTIONS 9u  // of stepped: a tick of rest, three up, two at the top, three down
#define PLANNER_LONGEST_PIECE 0x800000u  // ticks in one push; profile_player takes 24 bits

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

#endif

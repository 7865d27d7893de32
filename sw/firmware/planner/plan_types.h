// SPDX-License-Identifier: Apache-2.0
// plan_types -- a plan: a motion as a list of events, and how far it has been played.
//
// Units: velocity, acceleration and jerk are 2^-40 period per tick, per tick^2 and per tick^3.
// docs/planner.md has the formulae.
#ifndef MOIRE_PLAN_TYPES_H
#define MOIRE_PLAN_TYPES_H

#include <stdbool.h>
#include <stdint.h>

#define PLANNER_EVENTS 60u   // instants at which a motion changes; 57 at most
#define PLANNER_SECTIONS 9u  // of a stepped profile: a tick at rest, 3 up, 2 at the top, 3 down
#define PLANNER_LONGEST_PIECE 0x800000u  // ticks in one segment; the motion engine has 24 bits

enum planner_cause {
    PLANNER_OK,
    PLANNER_NO_VELOCITY,  // the limit is 0 in units of the player; for a retarget, below
                          // PLANNER_LEAST_LIMIT
    PLANNER_NO_ACCELERATION,
    PLANNER_NO_JERK,   // below two units: no pulse of jerk is possible
    PLANNER_TOO_LONG,  // a cruise of 2^30 ticks (3 days); a retarget with ramps of 2^27 ticks or
                       // 2^22 periods, or more
    PLANNER_BORDERS,   // stepped profile: borders or steps are not in order
    PLANNER_TOO_MANY_LEVELS,  // stepped profile: more than 4096 steps in a section
    PLANNER_STEPPED,          // the target of a stepped profile cannot change in flight
    PLANNER_NO_PLAN  // no plan inside the limits was found, even with an eighth of them kept free
};

struct planner_segment {  // velocity and acceleration at its start
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
    uint8_t slot;  // 0..3: number of the event in a change of jerk; or PLANNER_LANDING
};

#define PLANNER_LANDING 4u  // slot of an event that makes the landing exact

struct planner_state {  // after a tick
    uint64_t moved;     // distance since the plan began, in 2^-40 period, modulo 2^64
    int64_t velocity;   // of the next tick
    int64_t acceleration;
};

struct planner_progress {  // how far a plan has been taken
    struct planner_state state;
    int64_t jerk;
    int64_t landing;  // jerk of the landing events
    uint32_t tick;    // since the plan was made or retargeted, or in this section
};

struct plan {
    uint32_t ticks;  // of the whole motion, from where it was made or retargeted
    uint8_t count;   // number of events, or of sections of a stepped profile
    uint8_t next;    // first event or section that has not been taken; `count`: nothing is left
    uint8_t cause;   // planner_cause: why the last request was refused
    bool stepped;
    struct planner_progress at;
    union {
        struct planner_event event[PLANNER_EVENTS];
        // a section is `jerk` + 1 steps of constant velocity, which differ by `acceleration`
        struct planner_segment section[PLANNER_SECTIONS];
    };
};

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
// axis.h -- an axis between its HAL pins and the words of a packet: switches the drive on, lets the
// node home, and turns commanded positions into set-points.
#ifndef MOIRE_AXIS_H
#define MOIRE_AXIS_H

#include <stdbool.h>
#include <stdint.h>

#include "made/pins.h"
#include "node_clock.h"

// What the driver does with the axis now.
enum phase {
    OFF,        // the drive is off
    RESETTING,  // latched faults are being reset
    ENABLING,   // the drive is being switched on
    ENABLED,    // the drive holds; the node does not know the zero of the axis
    RELEASING,  // the stream is being ended, to home again
    HOMING,     // the node homes
    ABORTING,   // LinuxCNC has aborted the homing, the node stops
    PREPARING,  // a stream is being opened
    STARTING,   // commanded positions are taken, but not sent yet
    FOLLOWING,  // each packet has a set-point
    STOPPING,   // no set-points any more; the drive stays on until the node has stopped the axis
    FAILED      // off, or about to be, until `enable` falls
};

struct axis {
    struct axis_pins pins;
    enum phase phase;
    unsigned periods;    // since the phase began
    bool seen;           // the node has begun to home, or has just homed
    double commands[3];  // the last commanded positions, the newest one last
    double offset;       // added to them, it falls to 0 after the start
    double aborted;      // after an aborted homing: added to the position that LinuxCNC sees
    double target;       // of the node, machine units
    uint32_t faults, first_fault, mode, ended, state;
};

// The words of an axis in a request.
struct axis_request {
    int64_t position;  // 2^-16 period
    int32_t velocity;  // 2^-24 period per tick
    bool enable, home, stream, reset;
    bool commit;
};

// What a good reply says of axis `number` of `axes` goes to its pins.
void axis_take(struct axis* axis, const uint32_t* words, unsigned axes, unsigned number,
               double tick_s);

// One period of the axis, after axis_take if a reply has come. `cause`: why no drive may be on; 0:
// it may. Sets the pins that answer LinuxCNC. An axis in motion stops under control first if its
// set-points do not reach the node.
void axis_decide(struct axis* axis, uint32_t cause, double period_s);

// The touch probe has met an edge at `position` (2^-16 period): LinuxCNC sees that for a period.
// After axis_decide.
void axis_show_edge(struct axis* axis, int64_t position);

// The part of the axis in the next request. The set-point is at the commanded position of the
// period before, `shift_s` later.
struct axis_request axis_give(struct axis* axis, double period_s, double tick_s, double shift_s);

#endif

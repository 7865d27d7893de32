// SPDX-License-Identifier: GPL-2.0-or-later
// probe.h -- the touch probe of a node: its level for LinuxCNC, which changes when the positions of
// all axes at the edge are known.
#ifndef MOIRE_PROBE_H
#define MOIRE_PROBE_H

#include "latch.h"

enum probe_phase {
    PROBE_SETTLING,  // no edge is latched; the level is that of the pin once it is steady
    PROBE_ARMING,    // the latches are being armed
    PROBE_ARMED,     // the next edge is latched
    PROBE_TAKING     // the edge was seen, the latches are being read
};

struct probe {
    enum probe_phase phase;
    bool level;        // for LinuxCNC
    bool pin;          // in the last reply
    unsigned steady;   // replies since the pin has changed
    unsigned waiting;  // replies since the edge was seen
};

// A good reply has come. `pin`: its level. `ready`: all axes follow set-points, so no homing uses
// the captures. True if the level has changed now, and the latches have the positions of its edge.
bool probe_take(struct probe* probe, struct latch* latches, unsigned axes, bool pin, bool ready);

#endif

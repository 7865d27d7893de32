// SPDX-License-Identifier: GPL-2.0-or-later
// node.h -- a node at the other end of the link, which another program has set up
// (docs/linuxcnc.md).
#ifndef MOIRE_NODE_H
#define MOIRE_NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "carrier.h"
#include "made/lists.h"
#include "made/registers.h"
#include "packet.h"

enum { MOST_AXES = 8 };
enum { COUNT_SHIFT = 14 };                 // from 2^-16 period to quarter periods
static const double POSITION_LSB = 65536;  // per period; per period and tick of a velocity

struct node {
    struct carrier carrier;
    struct link_session link;
    unsigned axes;
    unsigned drives;  // axes with a drive; they come first, the others are encoders
    bool probes;      // all axes with a drive capture edges of a touch probe
    double clk_hz;
    double tick;         // cycles of a servo tick
    uint32_t time;       // in the last reply, cycles
    uint32_t read_time;  // at which the values of the last reply were read, cycles
    bool locked;         // the PLL of the node follows the requests
    bool captured;       // it had the values read, before the request
    double phase_error;  // cycles, that a request was later than the PLL of the node expected
    int64_t time_at;     // ns, when the request was sent that it answers
    int64_t sent_at;     // ns, of the last request
    int64_t patience;    // ns, with each request of the check
    char why[160];       // why it cannot be used, one sentence
};

// Opens the carrier to a node with `axes` axes and checks that the node has this session and fits
// the driver; false with the reason in `why`. Waits for each reply for `patience` ns, several
// times: not for a realtime thread.
bool node_open(struct node* node, const char* where, unsigned axes, uint32_t session,
               int64_t patience);

// The first word of a register in the lists of a node; `axis` is 0 for a register of the node.
static inline unsigned list_word(struct list_place place, unsigned axes, unsigned axis) {
    return place.fixed + axes * place.each + axis * place.width;
}

// A wide register in the values of a reply.
static inline int64_t position_word(const uint32_t* words, struct list_place place, unsigned axes,
                                    unsigned axis) {
    const uint32_t* at = words + list_word(place, axes, axis);
    return (int64_t)((uint64_t)at[1] << 32 | at[0]);
}

// A pin `scale`, periods per unit; 1 as long as it is 0.
static inline double scale_of(double scale) { return scale == 0 ? 1 : scale; }

// Takes the time of the node, and of the values, from the reply to the last request.
void node_take_time(struct node* node, const struct link_reply* reply);

// Time of the node in cycles when a request that is sent now will arrive.
uint32_t node_time(const struct node* node);

#endif

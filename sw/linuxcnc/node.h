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

struct node {
    struct carrier carrier;
    struct link_session link;
    unsigned axes;
    double clk_hz;
    double tick;      // cycles of a servo tick
    uint32_t time;    // in the last reply, cycles
    int64_t sent_at;  // of the request that it answers, ns
    char why[160];    // why it cannot be used, one sentence
};

// Opens the carrier to a node with `axes` axes and checks that the node has this session and fits
// the driver; false with the reason in `why`. Waits for replies: not for a realtime thread.
bool node_open(struct node* node, const char* where, unsigned axes, uint32_t session);

// The first word of a register of an axis in the lists of a node; of a register of the node, axis
// 0.
static inline unsigned list_word(struct list_place place, unsigned axes, unsigned axis) {
    return place.fixed + axes * place.each + axis * place.width;
}

// Time of the node in cycles when a request that is sent now will arrive.
uint32_t node_time(const struct node* node);

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
#include "node.h"

#include <stdio.h>

enum { TRIES = 20, TRY_NS = 100000000 };  // of an exchange of the check
static const double NS = 1e-9;

static bool misfit(struct node* node, const char* why) {
    snprintf(node->why, sizeof node->why, "%s", why);
    return false;
}

// Reads a register by the spare access; the write list gets zeros, which ask for nothing.
static bool read_register(struct node* node, uint32_t address, uint32_t* value) {
    static const uint32_t nothing[PACKET_MOST_VALUES];
    static struct link_reply reply;
    uint8_t packet[PACKET_LONGEST];
    for (unsigned tries = 0; tries < TRIES; tries++) {
        size_t length = packet_request(&node->link, node->time, nothing, address, 0, packet);
        node->sent_at = carrier_now();
        carrier_send(&node->carrier, packet, length);
        while ((length = carrier_receive(&node->carrier, packet, node->sent_at + TRY_NS)))
            if (packet_reply(&node->link, packet, length, &reply)) {
                node->time = reply.time;
                *value = reply.spare;
                return true;
            }
    }
    return misfit(node, "the node does not answer: it is off, not set up, or another host runs it");
}

static bool check(struct node* node) {
    uint32_t map, build, clock, tick;
    if (!read_register(node, NODE_BASE + NODE_MAP_CRC, &map)) return false;
    if (map != MAP_CRC)
        return misfit(node, "the node is of another build: its register map differs");
    if (!read_register(node, NODE_BASE + NODE_BUILD, &build)) return false;
    if (FIELD_GET(build, NODE_BUILD_AXES) != node->axes) {
        snprintf(node->why, sizeof node->why, "the node has %u axes, the configuration has %u",
                 FIELD_GET(build, NODE_BUILD_AXES), node->axes);
        return false;
    }
    for (unsigned axis = 0; axis < node->axes; axis++) {
        uint32_t built;
        if (!read_register(node, AXIS_BASE + axis * AXIS_STRIDE + AXIS_BUILT, &built)) return false;
        if (FIELD_GET(built, AXIS_BUILT_SET_POINTS)) continue;
        snprintf(node->why, sizeof node->why, "axis %u of the node has no set-points", axis);
        return false;
    }
    if (!read_register(node, NODE_BASE + NODE_CLK_HZ, &clock)) return false;
    if (!read_register(node, NODE_BASE + NODE_TICK_PERIOD, &tick)) return false;
    if (tick == 0) return misfit(node, "the firmware of the node has not started");
    node->clk_hz = clock;
    node->tick = tick;
    return true;
}

bool node_open(struct node* node, const char* where, unsigned axes, uint32_t session) {
    node->axes = axes;
    node->link = (struct link_session){
        .session = session,
        .writes = WRITES_FIXED + axes * WRITES_EACH,
        .reads = READS_FIXED + axes * READS_EACH,
    };
    const char* why = carrier_open(&node->carrier, where);
    if (why) return misfit(node, why);
    if (check(node)) return true;
    carrier_close(&node->carrier);
    return false;
}

uint32_t node_time(const struct node* node) {
    double seconds = (double)(carrier_now() - node->sent_at) * NS;
    return node->time + (uint32_t)(int64_t)(seconds * node->clk_hz);
}

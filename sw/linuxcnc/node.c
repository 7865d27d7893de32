// SPDX-License-Identifier: GPL-2.0-or-later
#include "node.h"

#include <stdio.h>

enum { TRIES = 20 };  // of an exchange of the check
static const double NS = 1e-9;

void node_take_time(struct node* node, const struct link_reply* reply) {
    uint32_t pll = reply->values[READ_LINK_PLL_STATE.fixed];
    bool built = FIELD_GET(pll, LINK_PLL_STATE_BUILT);
    node->locked = FIELD_GET(pll, LINK_PLL_STATE_LOCKED);
    node->captured = FIELD_GET(pll, LINK_PLL_STATE_CAPTURED);
    node->phase_error =
        (int32_t)(pll & LINK_PLL_STATE_PHASE_ERROR_MASK) >> LINK_PLL_STATE_PHASE_ERROR_SHIFT;
    node->read_time = built ? reply->values[READ_LINK_READ_TIME.fixed] : reply->time;
    node->time = reply->time;
    node->time_at = node->sent_at;
}

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
        while ((length = carrier_receive(&node->carrier, packet, node->sent_at + node->patience)))
            if (packet_reply(&node->link, packet, length, &reply)) {
                node_take_time(node, &reply);
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
    node->drives = 0;
    node->probes = true;
    for (unsigned axis = 0; axis < node->axes; axis++) {
        uint32_t built;
        if (!read_register(node, AXIS_BASE + axis * AXIS_STRIDE + AXIS_BUILT, &built)) return false;
        if (!FIELD_GET(built, AXIS_BUILT_DRIVE)) continue;
        const char* why = NULL;
        if (!FIELD_GET(built, AXIS_BUILT_SET_POINTS)) why = "has no set-points";
        if (node->drives++ != axis) why = "has a drive, the one before it has none";
        if (!FIELD_GET(built, AXIS_BUILT_CAPTURE)) node->probes = false;
        if (!why) continue;
        snprintf(node->why, sizeof node->why, "axis %u of the node %s", axis, why);
        return false;
    }
    if (!read_register(node, NODE_BASE + NODE_CLK_HZ, &clock)) return false;
    if (!read_register(node, NODE_BASE + NODE_TICK_PERIOD, &tick)) return false;
    if (tick == 0) return misfit(node, "the firmware of the node has not started");
    node->clk_hz = clock;
    node->tick = tick;
    return true;
}

bool node_open(struct node* node, const char* where, unsigned axes, uint32_t session,
               int64_t patience) {
    node->axes = axes;
    node->patience = patience;
    node->link = (struct link_session){
        .session = session,
        .writes = WRITES_FIXED + axes * WRITES_EACH,
        .reads = READS_FIXED + axes * READS_EACH,
    };
    const char* why = carrier_open(&node->carrier, where);
    if (why) return misfit(node, why);
    node->carrier.reply = packet_reply_length(&node->link);
    if (check(node)) return true;
    carrier_close(&node->carrier);
    return false;
}

uint32_t node_time(const struct node* node) {
    double seconds = (double)(carrier_now() - node->time_at) * NS;
    return node->time + (uint32_t)(int64_t)(seconds * node->clk_hz);
}

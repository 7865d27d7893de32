// SPDX-License-Identifier: GPL-2.0-or-later
#include "node.h"

#include <stdio.h>

#ifndef LINK_BASE  // PROVISIONAL until the link has its registers
#define LINK_BASE 0x1c00u
#define LINK_SESSION 0x00u
#define LINK_ENTRIES 0x04u
#define LINK_TIME_WINDOW 0x08u
#define LINK_WATCHDOG 0x0cu
#define LINK_LIST 0x200u
#endif

enum { TRIES = 20, TRY_NS = 100000000 };  // of an exchange of the set-up

static const uint32_t AXIS_READ_LIST[AXIS_READS] = {
    [READ_STATE] = AXIS_STATE,
    [READ_FAULTS] = AXIS_FAULTS,
    [READ_FIRST_FAULT] = AXIS_FIRST_FAULT,
    [READ_POSITION_LOW] = AXIS_POSITION_LOW,
    [READ_POSITION_HIGH] = AXIS_POSITION_HIGH,
    [READ_TARGET_LOW] = AXIS_TARGET_LOW,
    [READ_TARGET_HIGH] = AXIS_TARGET_HIGH,
    [READ_VELOCITY] = AXIS_VELOCITY,
    [READ_FOLLOWING_ERROR] = AXIS_FOLLOWING_ERROR,
    [READ_STREAM_STATE] = AXIS_STREAM_STATE,
    [READ_STREAM_COUNTS] = AXIS_STREAM_COUNTS,
    [READ_SUPERVISION] = AXIS_SUPERVISION,
};
static const uint32_t AXIS_WRITE_LIST[AXIS_WRITES] = {
    [WRITE_POSITION_LOW] = AXIS_SET_POINT_POSITION_LOW,
    [WRITE_POSITION_HIGH] = AXIS_SET_POINT_POSITION_HIGH,
    [WRITE_VELOCITY] = AXIS_SET_POINT_VELOCITY,
};
static const uint32_t NODE_READ_LIST[NODE_READS] = {[READ_TICK_COUNT] = NODE_TICK_COUNT};
static const uint32_t NODE_WRITE_LIST[NODE_WRITES] = {
    [WRITE_AXIS_REQUESTS] = NODE_AXIS_REQUESTS,
    [WRITE_SET_POINT_TICK] = NODE_SET_POINT_TICK,
    [WRITE_SET_POINT_COMMIT] = NODE_SET_POINT_COMMIT,
};

static unsigned reads_of(const struct node* node) { return NODE_READS + node->axes * AXIS_READS; }

static unsigned writes_of(const struct node* node) {
    return NODE_WRITES + node->axes * AXIS_WRITES;
}

static uint32_t axis_address(unsigned axis, uint32_t offset) {
    return AXIS_BASE + axis * AXIS_STRIDE + offset;
}

static uint32_t read_address(const struct node* node, unsigned entry) {
    if (entry < NODE_READS) return NODE_BASE + NODE_READ_LIST[entry];
    entry -= NODE_READS;
    if (entry >= node->axes * AXIS_READS) return 0;
    return axis_address(entry / AXIS_READS, AXIS_READ_LIST[entry % AXIS_READS]);
}

static uint32_t write_address(const struct node* node, unsigned entry) {
    unsigned of_axes = node->axes * AXIS_WRITES;
    if (entry < of_axes) return axis_address(entry / AXIS_WRITES, AXIS_WRITE_LIST[entry % AXIS_WRITES]);
    entry -= of_axes;
    return entry < NODE_WRITES ? NODE_BASE + NODE_WRITE_LIST[entry] : 0;
}

// The set-up: checks of the node, then the lists, then the numbers of the session.
enum step {
    CHECK_MAP,
    CHECK_AXES,
    GET_CLOCK,
    GET_TICK,
    CHECK_SET_POINTS,  // one step for each axis
    LISTS,             // after them, one step for each entry
};

struct access {
    uint32_t address;  // with SPARE_WRITE to write
    uint32_t value;
};

static unsigned entries_of(const struct node* node) {
    unsigned reads = reads_of(node), writes = writes_of(node);
    return reads > writes ? reads : writes;
}

static unsigned first_list(const struct node* node) { return CHECK_SET_POINTS + node->axes; }

static unsigned first_number(const struct node* node) {
    return first_list(node) + entries_of(node);
}

static struct access access_of(const struct node* node) {
    unsigned step = node->step;
    if (step == CHECK_MAP) return (struct access){NODE_BASE + NODE_MAP_CRC, 0};
    if (step == CHECK_AXES) return (struct access){NODE_BASE + NODE_BUILD, 0};
    if (step == GET_CLOCK) return (struct access){NODE_BASE + NODE_CLK_HZ, 0};
    if (step == GET_TICK) return (struct access){NODE_BASE + NODE_TICK_PERIOD, 0};
    if (step < first_list(node))
        return (struct access){axis_address(step - CHECK_SET_POINTS, AXIS_BUILT), 0};
    unsigned entry = step - first_list(node);
    if (step < first_number(node)) {
        uint32_t addresses = write_address(node, entry) | read_address(node, entry) << 16;
        return (struct access){SPARE_WRITE | (LINK_BASE + LINK_LIST + 4 * entry), addresses};
    }
    const struct access numbers[] = {
        {LINK_BASE + LINK_TIME_WINDOW, (uint32_t)(node->time_window_ms * node->clk_hz / 1000)},
        {LINK_BASE + LINK_WATCHDOG, node->watchdog_ms},
        {LINK_BASE + LINK_ENTRIES, writes_of(node) | reads_of(node) << 8},
        {LINK_BASE + LINK_SESSION, node->session},
    };
    struct access found = numbers[step - first_number(node)];
    found.address |= SPARE_WRITE;
    return found;
}

enum { NUMBERS = 4 };  // writes after the lists

static bool misfit(struct node* node, const char* why) {
    snprintf(node->why, sizeof node->why, "%s", why);
    return false;
}

void node_begin(struct node* node) {
    node->step = 0;
    node->link = (struct link_session){0};
}

bool node_ready(const struct node* node) { return node->step >= first_number(node) + NUMBERS; }

size_t node_set_up_request(struct node* node, uint8_t* packet) {
    struct access access = access_of(node);
    return packet_request(&node->link, 0, NULL, access.address, access.value, packet);
}

bool node_set_up_reply(struct node* node, const struct link_reply* reply) {
    uint32_t value = reply->spare;
    unsigned step = node->step++;
    if (step == CHECK_MAP && value != MAP_CRC)
        return misfit(node, "the node is of another build: its register map differs");
    if (step == CHECK_AXES && FIELD_GET(value, NODE_BUILD_AXES) != node->axes) {
        snprintf(node->why, sizeof node->why, "the node has %u axes, the configuration %u",
                 FIELD_GET(value, NODE_BUILD_AXES), node->axes);
        return false;
    }
    if (step == GET_CLOCK) node->clk_hz = value;
    if (step == GET_TICK) {
        node->tick = value;
        if (value == 0) return misfit(node, "the firmware of the node has not started");
    }
    if (step >= CHECK_SET_POINTS && step < first_list(node) &&
        !FIELD_GET(value, AXIS_BUILT_SET_POINTS)) {
        snprintf(node->why, sizeof node->why, "axis %u of the node is built without set-points",
                 step - CHECK_SET_POINTS);
        return false;
    }
    if (node_ready(node))
        node->link = (struct link_session){
            .session = node->session, .writes = writes_of(node), .reads = reads_of(node)};
    return true;
}

static bool exchange(struct node* node, struct link_reply* reply) {
    uint8_t packet[PACKET_LONGEST];
    for (unsigned tries = 0; tries < TRIES; tries++) {
        node->sent_at = carrier_now();
        carrier_send(&node->carrier, packet, node_set_up_request(node, packet));
        size_t length;
        while ((length = carrier_receive(&node->carrier, packet, node->sent_at + TRY_NS)))
            if (packet_reply(&node->link, packet, length, reply)) return true;
    }
    return misfit(node, "the node does not answer, or another host runs it");
}

bool node_set_up(struct node* node, const char* where) {
    const char* why = carrier_open(&node->carrier, where);
    if (why) return misfit(node, why);
    node_begin(node);
    while (!node_ready(node)) {
        struct link_reply reply;
        if (!exchange(node, &reply) || !node_set_up_reply(node, &reply)) {
            carrier_close(&node->carrier);
            return false;
        }
        node->time = reply.time;
    }
    return true;
}

uint32_t node_time(const struct node* node) {
    double seconds = (double)(carrier_now() - node->sent_at) * 1e-9;
    return node->time + (uint32_t)(int64_t)(seconds * node->clk_hz);
}

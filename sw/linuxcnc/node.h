// SPDX-License-Identifier: GPL-2.0-or-later
// node.h -- a node at the other end of the link: the registers that each packet carries, and the
// set-up of the link, one exchange at a time.
#ifndef MOIRE_NODE_H
#define MOIRE_NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "carrier.h"
#include "made/registers.h"
#include "packet.h"

enum { MOST_AXES = 8 };

// Words of an axis in the read list and in the write list, in their order.
enum {
    READ_STATE,
    READ_FAULTS,
    READ_FIRST_FAULT,
    READ_POSITION_LOW,
    READ_POSITION_HIGH,
    READ_TARGET_LOW,
    READ_TARGET_HIGH,
    READ_VELOCITY,
    READ_FOLLOWING_ERROR,
    READ_STREAM_STATE,
    READ_STREAM_COUNTS,
    READ_SUPERVISION,
    AXIS_READS
};
enum { WRITE_POSITION_LOW, WRITE_POSITION_HIGH, WRITE_VELOCITY, AXIS_WRITES };

// Words of the node: before those of the axes in the read list, after them in the write list, so
// that the commit is the last one.
enum { READ_TICK_COUNT, NODE_READS };
enum { WRITE_AXIS_REQUESTS, WRITE_SET_POINT_TICK, WRITE_SET_POINT_COMMIT, NODE_WRITES };

struct node {
    struct carrier carrier;
    struct link_session link;
    unsigned axes;
    uint32_t session;      // that the link is to have after the set-up
    uint32_t time_window_ms;  // 0: requests are not checked for their time
    uint32_t watchdog_ms;
    double clk_hz;
    double tick;      // cycles of a servo tick
    unsigned step;    // of the set-up
    char why[160];    // why the set-up has failed, one sentence
    uint32_t time;    // in the last reply, cycles
    int64_t sent_at;  // of the request that it answers, ns
};

// Begins the set-up again, from the first step.
void node_begin(struct node* node);

// Whether the set-up is done, and packets carry all registers.
bool node_ready(const struct node* node);

// Makes the request of the present step of the set-up; returns its length.
size_t node_set_up_request(struct node* node, uint8_t* packet);

// Takes the reply to it. False if the node does not fit: `why` has the reason.
bool node_set_up_reply(struct node* node, const struct link_reply* reply);

// The whole set-up, waiting for each reply; false with the reason in `why`. Not for a realtime
// thread.
bool node_set_up(struct node* node, const char* where);

// Time of the node in cycles when a request that is sent now will arrive.
uint32_t node_time(const struct node* node);

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
// latch.h -- the latch of an axis: its position at an event, captured by the node and read by the
// spare access of the packets, which reaches one register in each. A lost packet is sent again.
#ifndef MOIRE_LATCH_H
#define MOIRE_LATCH_H

#include <stdbool.h>
#include <stdint.h>

// Bits of the register capture_sources.
enum { SOURCE_INDEX = 1, SOURCE_PROBE_RISING = 8, SOURCE_PROBE_FALLING = 32 };

enum latch_phase {
    LATCH_OFF,
    LATCH_SOURCES,  // the sources are being set
    LATCH_CLEAR,    // older captures are being dropped
    LATCH_ARMED,    // the node captures the next event
    LATCH_READ,     // the captured position is being read
    LATCH_DONE      // `position` is there
};

struct latch {
    enum latch_phase phase;
    uint32_t sources;
    int64_t position;  // 2^-16 period
};

// A spare access: words of a request.
struct spare_access {
    uint32_t spare, value;
};

// Begins to arm the latch for the next event of these sources.
void latch_arm(struct latch* latch, uint32_t sources);

// Whether the latch of an axis needs an access in the next request, and which.
bool latch_asks(const struct latch* latch, unsigned axis, struct spare_access* access);

// A good reply has come: the register capture_state in it. Before latch_answer.
void latch_look(struct latch* latch, uint32_t state);

// A good reply has come to the request with the access of this latch: the value that was read, and
// the present position of the axis, which is less than 2^15 periods away from the captured one.
void latch_answer(struct latch* latch, uint32_t value, int64_t present);

#endif

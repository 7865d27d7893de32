// SPDX-License-Identifier: GPL-2.0-or-later
// packet.h -- the packets of the real-time link (docs/link.md): makes requests, checks replies.
#ifndef MOIRE_PACKET_H
#define MOIRE_PACKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "made/packet_layout.h"

enum { PACKET_LONGEST = 4 * PACKET_LONGEST_WORDS };  // bytes
enum { CAUSE_COUNTS = 6 };                           // counts of refused requests
#define SPARE_WRITE 0x80000000u                      // beside the address of a spare access

// A session: what host and node have agreed at set-up, and the sequence of the last request.
struct link_session {
    uint32_t session;  // 24 bits
    unsigned writes;   // entries of the write list
    unsigned reads;    // entries of the read list
    uint32_t sequence;
};

struct link_reply {
    uint32_t time;  // of the node in cycles, before the first register was read
    uint8_t refused[CAUSE_COUNTS];
    uint32_t spare;
    uint32_t values[PACKET_MOST_VALUES];
};

// Makes the next request in `packet` (PACKET_LONGEST bytes) and returns its length in bytes. `time`
// is that of the node in cycles when the request will arrive; `spare` is the address of one more
// register to read, or to write with SPARE_WRITE.
size_t packet_request(struct link_session* link, uint32_t time, const uint32_t* values,
                      uint32_t spare, uint32_t spare_value, uint8_t* packet);

// Reads the reply to the last request; false if the packet is damaged, foreign, or old.
bool packet_reply(const struct link_session* link, const uint8_t* packet, size_t length,
                  struct link_reply* reply);

// Length of a reply of this session in bytes.
size_t packet_reply_length(const struct link_session* link);

#endif

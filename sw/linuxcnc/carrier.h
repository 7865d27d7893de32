// SPDX-License-Identifier: GPL-2.0-or-later
// carrier.h -- brings packets to a node and back: UDP, or a serial port.
#ifndef MOIRE_CARRIER_H
#define MOIRE_CARRIER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "packet.h"

struct carrier {
    int file;
    bool serial;
    size_t received;                       // bytes of a stuffed packet that is not complete
    uint8_t stuffed[PACKET_LONGEST + 16];  // of a serial port: COBS adds a byte for each 254
};

// Opens `udp:HOST:PORT` or `serial:DEVICE:BAUD`. Returns NULL, or one sentence with the reason
// (static text). Not for a realtime thread.
const char* carrier_open(struct carrier* carrier, const char* where);

void carrier_close(struct carrier* carrier);

// Sends a packet; false if the system does not take it now. Does not wait.
bool carrier_send(struct carrier* carrier, const uint8_t* packet, size_t length);

// Takes the next packet, of PACKET_LONGEST bytes at most. Waits until `deadline` (CLOCK_MONOTONIC,
// ns) at most, and returns 0 if none has come by then.
size_t carrier_receive(struct carrier* carrier, uint8_t* packet, int64_t deadline);

// The present time of CLOCK_MONOTONIC in ns.
int64_t carrier_now(void);

#endif

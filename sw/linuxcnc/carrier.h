// SPDX-License-Identifier: GPL-2.0-or-later
// carrier.h -- brings packets to a node and back: UDP, a serial port, or SPI.
#ifndef MOIRE_CARRIER_H
#define MOIRE_CARRIER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "packet.h"

enum carrier_kind { CARRIER_UDP, CARRIER_SERIAL, CARRIER_SPI };
// Bytes of an SPI transfer between request and reply, for which the node plays the request: for
// `packets` bytes of both.
#define SPI_TURNROUND(packets, hz)                                                            \
    (((uint64_t)(hz) * (PACKET_SPI_TURNROUND_NS + PACKET_SPI_TURNROUND_BYTE_NS * (packets)) + \
      7999999999) /                                                                           \
     8000000000)

enum { SPI_LEAST_HZ = 1000, SPI_MOST_HZ = 50000000, PACKETS_LONGEST = 2 * PACKET_LONGEST };
enum { SPI_LONGEST = PACKETS_LONGEST + SPI_TURNROUND(PACKETS_LONGEST, SPI_MOST_HZ) };

struct carrier {
    int file;
    enum carrier_kind kind;
    size_t reply;                          // bytes of a reply, set by the caller for SPI
    unsigned hz;                           // clock of the SPI
    size_t received;                       // bytes of a stuffed packet that is not complete
    uint8_t stuffed[PACKET_LONGEST + 16];  // of a serial port: COBS, and two zeros
    uint8_t transferred[SPI_LONGEST];      // of an SPI transfer, both ways; the reply is in it
};

// Opens `udp:HOST:PORT`, `serial:DEVICE:BAUD` or `spi:DEVICE:HZ`. Returns NULL, or one sentence
// with the reason (static text). Not for a realtime thread.
const char* carrier_open(struct carrier* carrier, const char* where);

void carrier_close(struct carrier* carrier);

// Sends a packet; false if the system does not take it now. Does not wait, but for SPI: there it
// makes the whole transfer, and the reply is there when it returns.
bool carrier_send(struct carrier* carrier, const uint8_t* packet, size_t length);

// Takes the next packet, of PACKET_LONGEST bytes at most. Waits until `deadline` (CLOCK_MONOTONIC,
// ns) at most, and returns 0 if none has come by then.
size_t carrier_receive(struct carrier* carrier, uint8_t* packet, int64_t deadline);

// The present time of CLOCK_MONOTONIC in ns.
int64_t carrier_now(void);

#endif

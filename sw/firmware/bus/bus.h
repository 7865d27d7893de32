// SPDX-License-Identifier: Apache-2.0
// bus -- the RS-485 bus: receives frames, executes their requests, sends replies. The protocol is
// in docs/protocol.md.
#ifndef MOIRE_BUS_H
#define MOIRE_BUS_H

#include <stdbool.h>
#include <stdint.h>

void bus_start(unsigned axes);
void bus_poll(void);  // handles a few received bytes; to be called often
bool bus_idle(void);  // whether there is nothing to do before a word is received

// Executes a request body that did not come over the bus. Returns the length of the reply body, at
// most BUS_LONGEST_BODY.
uint8_t bus_execute(const uint8_t* request, uint8_t length, uint8_t* reply);

uint32_t bus_crc(const uint8_t* bytes, uint32_t count);  // CRC-32

// For the parts of an image: a field of the request that is being executed, and of its reply.
// Little endian; `at` is an offset of bus_protocol.h.
uint64_t bus_request_field(uint32_t at, unsigned bytes);
void bus_reply_field(uint32_t at, uint64_t value, unsigned bytes);

#endif

// SPDX-License-Identifier: Apache-2.0
// line -- frames in, requests done, replies out. docs/protocol.md
#ifndef MOIRE_LINE_H
#define MOIRE_LINE_H

#include <stdint.h>

void line_start(unsigned axes);
void line_poll(void);

// Do a request body that came another way; returns the length of the reply body, at most LINE_LONGEST_BODY.
uint8_t line_do(const uint8_t *request, uint8_t length, uint8_t *reply);

uint32_t line_crc(const uint8_t *bytes, uint32_t count);        // CRC-32

// For the parts of an image: a field of the request that is being done, and one of its reply; little endian, `at` as in line_protocol.h.
uint64_t line_field(uint32_t at, unsigned bytes);
void line_answer(uint32_t at, uint64_t value, unsigned bytes);

#endif

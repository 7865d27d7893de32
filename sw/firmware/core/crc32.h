// SPDX-License-Identifier: Apache-2.0
// crc32 -- CRC-32 in software, for data whose CRC is made in pieces. That of the bus is made by
// the hardware, without pauses.
#ifndef MOIRE_CRC32_H
#define MOIRE_CRC32_H

#include <stdint.h>

// The CRC-32 (IEEE 802.3) continued by `count` bytes; it begins with UINT32_MAX, and what is stored
// is its complement.
uint32_t crc32_continue(uint32_t crc, const void* bytes, unsigned count);

#endif

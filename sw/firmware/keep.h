// SPDX-License-Identifier: Apache-2.0
// keep -- the parameters of the axes and the settings, kept over a power cut: which of them, and what they become again. store keeps them.
#ifndef MOIRE_KEEP_H
#define MOIRE_KEEP_H

#include <stdbool.h>
#include <stdint.h>

#define KEEP_NODE 0xFFu                         // `of` a setting; else an axis
#define KEEP_HEAD 0x100u                        // the first one
#define KEEP_END 0x101u                         // the last one
#define KEEP_NOTHING 0xFFFFu                    // of keep_next: the last one follows

struct keep_value {                             // as in the EEPROM
    int64_t value;                              // head: generation, and above it what the build keeps; end: CRC-32 of all before
    uint32_t of, id;
};

void keep_start(unsigned axes);
uint8_t keep_operation(uint8_t operation);

uint32_t keep_build(void);                      // differs where a kept number would mean something else
bool keep_next(unsigned *at, struct keep_value *value);     // begins at 0; false: that one is at its default. The last one is KEEP_END
bool keep_take(const struct keep_value *value); // false: it is not allowed

#endif

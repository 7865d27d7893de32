// SPDX-License-Identifier: Apache-2.0
// keep -- the parameters of the axes and the settings, kept over a power cut: which of them, and
// what they become again. store keeps them.
#ifndef MOIRE_NONVOLATILE_H
#define MOIRE_NONVOLATILE_H

#include <stdbool.h>
#include <stdint.h>

#define SAVED_NODE 0xFFu       // `of` a setting; else an axis
#define SAVED_HEAD 0x100u      // the first one
#define SAVED_END 0x101u       // the last one
#define SAVED_NOTHING 0xFFFFu  // of saved_values_next: the last one follows

struct saved_value {  // as in the EEPROM
    int64_t
        value;  // head: generation, and above it what the build keeps; end: CRC-32 of all before
    uint32_t of, id;
};

void nonvolatile_start(unsigned axes);
uint8_t nonvolatile_operation(uint8_t operation);

uint32_t saved_values_build(void);  // differs where a kept number would mean something else
bool saved_values_next(unsigned* at,
                       struct saved_value* value);  // begins at 0; false: that one is at its
                                                    // default. The last one is SAVED_END
bool saved_values_restore(const struct saved_value* value);  // false: it is not allowed

#endif

// SPDX-License-Identifier: Apache-2.0
// saved_values -- the list of the values that a node saves, and what each becomes again when it is
// restored: the parameters of its axes, then its settings.
#ifndef MOIRE_SAVED_VALUES_H
#define MOIRE_SAVED_VALUES_H

#include <stdbool.h>
#include <stdint.h>

#define SAVED_NODE 0xFFu       // owner of a setting; any lower owner is an axis
#define SAVED_HEAD 0x100u      // owner of the first entry of a copy
#define SAVED_END 0x101u       // owner of the last entry of a copy
#define SAVED_NOTHING 0xFFFFu  // a cursor behind the last value: only SAVED_END follows

// One entry, as it is in the EEPROM: 16 bytes. `value` of the head holds the generation in its low
// word and saved_values_build in its high word; `value` of the end is the CRC-32 of all before it.
struct saved_value {
    int64_t value;
    uint32_t owner, id;
};

void saved_values_start(unsigned axes);

// A number that differs between builds that give a saved value different meanings.
uint32_t saved_values_build(void);

// Gets the value at *cursor, which begins with 0, and advances the cursor. Returns false if that
// value is at its default and need not be saved. After all values it returns SAVED_END.
bool saved_values_next(unsigned* cursor, struct saved_value* value);

// Puts a value into force. Returns false if the node does not accept it.
bool saved_values_restore(const struct saved_value* value);

#endif

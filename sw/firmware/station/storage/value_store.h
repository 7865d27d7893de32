// SPDX-License-Identifier: Apache-2.0
// value_store -- the parameters and settings of a node in the EEPROM, in two copies; they come into
// force at power-up.
#ifndef MOIRE_VALUE_STORE_H
#define MOIRE_VALUE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "station/storage/saved_values.h"
#include "station/storage/store.h"

#define VALUE_STORE_MAX 254u  // values of a copy

struct value_store_status {
    uint32_t generation;  // of the saved values, in one sequence with station lists; 0: none
    uint16_t values;      // those that are not at their defaults
    uint8_t cause;        // a bus_cause: ok, or why the defaults are in force or the save failed
    bool damaged;         // one copy was damaged
};

extern const struct store_client value_store_client;

const struct value_store_status* value_store_status(void);

// Begins to save all values that are not at their defaults, or with `nothing` none, so that all are
// at their defaults from the next power-up on. Returns a bus_cause: ok, eeprom_busy or
// eeprom_missing; value_store_status reports how the writing ends.
uint8_t value_store_save(bool nothing);

// Gets one of status.values saved values by its number from 0 on. Returns a bus_cause: ok,
// eeprom_busy while it is being read, out_of_range, or eeprom_missing.
uint8_t value_store_get(unsigned number, struct saved_value* value);

#endif

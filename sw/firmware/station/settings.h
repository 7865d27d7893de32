// SPDX-License-Identifier: Apache-2.0
// settings -- the values that are set once in a station: tolerances, times, roles. They belong to
// the node; the parameters belong to its axes.
#ifndef MOIRE_SETTINGS_H
#define MOIRE_SETTINGS_H

#include <stdint.h>

void settings_start(unsigned axes);  // sets all to their defaults
uint8_t settings_operation(uint8_t operation);

// By their bus_setting, in the unit of bus.toml.
int64_t settings_get(uint8_t id);
int64_t settings_default(uint8_t id);
uint8_t settings_set(uint8_t id, int64_t value);  // ok, unknown_parameter or out_of_range

#endif

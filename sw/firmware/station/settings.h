// SPDX-License-Identifier: Apache-2.0
// settings -- what a station is told once: tolerances, times, roles. The parameters of its axes are
// another matter.
#ifndef MOIRE_SETTINGS_H
#define MOIRE_SETTINGS_H

#include <stdint.h>

void settings_start(unsigned axes);  // defaults
uint8_t settings_operation(uint8_t operation);
int64_t settings_get(uint8_t id);  // a bus_setting
int64_t settings_default(uint8_t id);
uint8_t settings_set(uint8_t id, int64_t value);  // a bus_cause

#endif

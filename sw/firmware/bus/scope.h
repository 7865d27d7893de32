// SPDX-License-Identifier: Apache-2.0
// scope -- records position, error and command of one axis, from before a trigger on.
//
// With an amplitude it drives the axis in open loop meanwhile, to measure its response. One scope
// serves all axes. Times are since the sample before, in SCOPE_CYCLES cycles.
#ifndef MOIRE_SCOPE_H
#define MOIRE_SCOPE_H

#include <stdbool.h>
#include <stdint.h>

#define SCOPE_CYCLES 64u

void scope_start(unsigned axes);
void scope_work(void);
bool scope_idle(void);
uint8_t scope_operation(uint8_t operation);  // a bus_cause

#endif

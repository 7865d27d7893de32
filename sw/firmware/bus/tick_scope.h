// SPDX-License-Identifier: Apache-2.0
// tick_scope -- records signals of axes at each servo tick with the recorder of the node, and adds
// a waveform to the commands of an axis, to measure its response.
//
// Both need SCOPE_WORDS of rtl/node.sv. The excitation ends with any request to its axis to move,
// home, stop or switch off, and when the drive is off.
#ifndef MOIRE_TICK_SCOPE_H
#define MOIRE_TICK_SCOPE_H

#include <stdbool.h>
#include <stdint.h>

void tick_scope_start(unsigned axes);
void tick_scope_work(void);
bool tick_scope_idle(void);
uint8_t tick_scope_operation(uint8_t operation);  // a bus_cause

#endif

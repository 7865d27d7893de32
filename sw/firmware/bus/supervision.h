// SPDX-License-Identifier: Apache-2.0
// supervision -- serves a host that reaches the registers of the node, over the real-time link or
// the bus: it requests by the register axis_requests, and streams set-points to set_point_player.
//
// The firmware decides whether an axis may be enabled, homed or streamed, with the checks of every
// motion, and shows what it has done in the register supervision of the axis. The set-points
// themselves do not pass through it. An axis whose bits were never set belongs to the bus alone.
#ifndef MOIRE_SUPERVISION_H
#define MOIRE_SUPERVISION_H

#include <stdbool.h>
#include <stdint.h>

void supervision_start(unsigned axes);
void supervision_work(void);
uint8_t supervision_operation(uint8_t operation);  // write_register of its registers; a bus_cause
bool supervision_idle(void);

#endif

// SPDX-License-Identifier: Apache-2.0
// peer -- the connection between main node and sub-node: the main node orders a turn to a station,
// the sub-node reports that it has turned (docs/indexing.md).
#ifndef MOIRE_PEER_H
#define MOIRE_PEER_H

#include <stdint.h>

void peer_start(unsigned axes);
void peer_work(void);
uint8_t peer_operation(uint8_t operation);

// These are for a main node.

// Orders a turn to a station. The angle (0.01 arcsec) is sent in mode frames only: in mode legacy
// the sub-node counts its own stations. Returns a bus_cause at once: ok if it has begun, or
// not_built, peer_off or busy.
uint8_t peer_turn_to(uint16_t station, uint32_t angle);

// Stops the table. A sub-node in mode legacy cannot be stopped: its table turns on to its station.
// Returns ok.
uint8_t peer_stop(void);

uint8_t peer_state(void);  // a bus_peer_phase
uint8_t peer_cause(void);  // why it failed, a bus_cause

// bus_fault bits of the sub-node if faults made it fail; only the first fault if it is known.
uint16_t peer_faults(void);

// A person requested a reset of the faults: the next turn begins with it.
void peer_reset_fault(void);

#endif

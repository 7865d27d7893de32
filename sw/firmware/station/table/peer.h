// SPDX-License-Identifier: Apache-2.0
// peer -- main node and sub-node speak to each other: index to a station, indexed. docs/indexing.md
#ifndef MOIRE_PEER_H
#define MOIRE_PEER_H

#include <stdint.h>

void peer_start(unsigned axes);
void peer_work(void);
uint8_t peer_operation(uint8_t operation);

// Of a main node. The first two return a bus_cause at once. The angle (0.01 arcsec) goes with
// frames only: in mode printed the sub-node counts its own stations.
uint8_t peer_turn_to(uint16_t station, uint32_t angle);
uint8_t peer_stop(void);     // in mode printed it is not heard: the table turns on to its station
uint8_t peer_state(void);    // a bus_peer_phase
uint8_t peer_cause(void);    // why it failed, a bus_cause
uint16_t peer_faults(void);  // of the sub-node, if they were that: bus_fault bits, the first one
                             // alone where it is known
void peer_reset_fault(
    void);  // a person wants it: the next index begins by resetting the fault that was told

#endif

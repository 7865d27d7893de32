// SPDX-License-Identifier: Apache-2.0
// nonvolatile -- the bus operations that save the values of the node and report what is saved.
#ifndef MOIRE_NONVOLATILE_H
#define MOIRE_NONVOLATILE_H

#include <stdint.h>

uint8_t nonvolatile_operation(uint8_t operation);  // returns a bus_cause

#endif

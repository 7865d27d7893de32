// SPDX-License-Identifier: Apache-2.0
// clock -- milliseconds since start, from the time stamp of the node.
#ifndef MOIRE_CLOCK_H
#define MOIRE_CLOCK_H

#include <stdint.h>

void clock_start(void);
void clock_poll(void);    // to be called at least once in 2^32 cycles
uint32_t clock_ms(void);  // wraps

#endif

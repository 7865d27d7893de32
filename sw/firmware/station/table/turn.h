// SPDX-License-Identifier: Apache-2.0
// index -- turn the table of axis 0 to an absolute angle of its sensor. Angles in 0.01 arcsec.
#ifndef MOIRE_TURN_H
#define MOIRE_TURN_H

#include <stdint.h>

void turn_start(unsigned axes);
void turn_work(void);
uint8_t turn_operation(uint8_t operation);

uint8_t turn_to(uint32_t angle);  // a bus_cause at once: ok if it has begun
uint8_t turn_ended(void);         // running, or how it ended

#endif

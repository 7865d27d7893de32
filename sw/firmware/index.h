// SPDX-License-Identifier: Apache-2.0
// index -- turn the table of axis 0 to an absolute angle of its sensor. Angles in 0.01 arcsec.
#ifndef MOIRE_INDEX_H
#define MOIRE_INDEX_H

#include <stdint.h>

void index_start(unsigned axes);
void index_work(void);
uint8_t index_operation(uint8_t operation);

uint8_t index_to(uint32_t angle);       // a line_cause at once: ok if it has begun
uint8_t index_ended(void);              // running, or how it ended
uint32_t index_reading(void);           // last angle that was read at rest

#endif

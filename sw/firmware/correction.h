// SPDX-License-Identifier: Apache-2.0
// correction -- the learners of all axes as a part of an image: their turns and what the line asks of them.
#ifndef MOIRE_CORRECTION_H
#define MOIRE_CORRECTION_H

#include <stdint.h>

void correction_start(unsigned axes);
void correction_work(void);
uint8_t correction_operation(uint8_t operation);

#endif

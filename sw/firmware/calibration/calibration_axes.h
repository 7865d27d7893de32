// SPDX-License-Identifier: Apache-2.0
// correction -- the learners of all axes as a part of an image: their turns and what the line asks
// of them.
#ifndef MOIRE_CALIBRATION_AXES_H
#define MOIRE_CALIBRATION_AXES_H

#include <stdint.h>

void calibration_axes_start(unsigned axes);
void calibration_axes_work(void);
uint8_t calibration_axes_operation(uint8_t operation);

#endif

// SPDX-License-Identifier: Apache-2.0
// calibration_axes -- the calibrations of all axes as a part of an image: one axis a poll, and the
// bus operations about them.
#ifndef MOIRE_CALIBRATION_AXES_H
#define MOIRE_CALIBRATION_AXES_H

#include <stdbool.h>
#include <stdint.h>

void calibration_axes_start(unsigned axes);
void calibration_axes_work(void);
bool calibration_axes_idle(void);
uint8_t calibration_axes_operation(uint8_t operation);  // returns a bus_cause

#endif

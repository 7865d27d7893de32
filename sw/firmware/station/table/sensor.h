// SPDX-License-Identifier: Apache-2.0
// sensor -- the absolute angle of the table, from the frames of a time-grating sensor. Angles in
// 0.01 arcsec.
#ifndef MOIRE_SENSOR_H
#define MOIRE_SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#define SENSOR_TURN 129600000u

void sensor_start(unsigned axes);
void sensor_work(void);
uint8_t sensor_operation(uint8_t operation);

bool sensor_built(void);
bool sensor_timed_out(void);    // no good frame for sensor_timeout
uint32_t sensor_changes(void);  // frames with another angle than the one before; wraps

// The mean of so many frames that were sent from now on.
void sensor_measure(uint32_t frames);
bool sensor_measured(void);
uint32_t sensor_mean(void);

#endif

// SPDX-License-Identifier: Apache-2.0
// sensor -- the absolute angle of the table, from the frames of a time-grating sensor. Angles are
// in 0.01 arcsec.
#ifndef MOIRE_SENSOR_H
#define MOIRE_SENSOR_H

#include <stdbool.h>
#include <stdint.h>

#define SENSOR_TURN 129600000u  // a turn

void sensor_start(unsigned axes);
void sensor_work(void);
uint8_t sensor_operation(uint8_t operation);

bool sensor_built(void);
bool sensor_timed_out(void);    // no good frame for sensor_timeout
uint32_t sensor_changes(void);  // frames whose angle differed from the one before; wraps

// Measures the mean angle of `frames` frames that are sent from now on.
void sensor_measure(uint32_t frames);
bool sensor_measured(void);
uint32_t sensor_mean(void);  // after sensor_measured

#endif

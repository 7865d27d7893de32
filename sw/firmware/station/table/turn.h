// SPDX-License-Identifier: Apache-2.0
// turn -- turns the indexing table of axis 0 to an absolute angle of its sensor.
#ifndef MOIRE_TURN_H
#define MOIRE_TURN_H

#include <stdint.h>

void turn_start(unsigned axes);
void turn_work(void);
uint8_t turn_operation(uint8_t operation);

// Begins to turn to an angle, 0.01 arcsec, below a turn. Returns a bus_cause at once: ok if it has
// begun, or not_built, out_of_range, busy, sensor_timed_out or why the axis cannot be enabled.
uint8_t turn_to(uint32_t angle);
uint8_t turn_ended(void);  // a bus_cause: running, or how it ended

#endif

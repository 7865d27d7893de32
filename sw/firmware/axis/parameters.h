// SPDX-License-Identifier: Apache-2.0
// parameters -- the settings of the axes, and those registers that follow from them.
#ifndef MOIRE_PARAMETERS_H
#define MOIRE_PARAMETERS_H

#include <stdint.h>

#include "planner/planner.h"

#define SAMPLE_HZ 100000u  // highest rate of the converters
#define SAMPLE_CYCLES 30u  // a conversion takes 29
#define BAUD 115200u

enum profile { S_CURVE, TRAPEZOID, STEPPED };  // values of the parameters
enum position_source { PHASES, COUNTS, OWN_STEPS };

void parameters_start_node(void);         // clock dividers, line speed
void parameters_set_baud(uint32_t baud);  // of the line, until the next start
uint32_t parameters_sample_hz(void);      // rate of the converters
void parameters_start(unsigned axis);     // defaults, into the registers too
uint8_t parameters_check(unsigned axis, uint8_t id, int64_t value);  // a bus_cause
void parameters_set(unsigned axis, uint8_t id, int64_t value);
int64_t parameters_get(unsigned axis, uint8_t id);
int64_t parameters_default(uint8_t id);
struct planner_limits parameters_limits(unsigned axis, uint8_t velocity_id);
struct planner_stepped_profile parameters_stepped_profile(unsigned axis, uint8_t velocity_id);

#endif

// SPDX-License-Identifier: Apache-2.0
// parameters -- the parameters of the axes, and the registers that follow from them.
//
// Values are in counts of the wire, as bus.toml defines them.
#ifndef MOIRE_PARAMETERS_H
#define MOIRE_PARAMETERS_H

#include <stdint.h>

#include "planner/planner.h"

#define SAMPLE_HZ 100000u  // highest sample rate of the ADC
#define SAMPLE_CYCLES 30u  // shortest sample period; a conversion takes 29 cycles
#define BAUD 115200u

enum profile { S_CURVE, TRAPEZOID, STEPPED };  // values of the parameter profile
enum position_source { PHASES, COUNTS, OWN_STEPS };

void parameters_start_node(void);         // clock dividers and baud rate
void parameters_set_baud(uint32_t baud);  // of the bus, until the next start
uint32_t parameters_sample_hz(void);      // sample rate of the ADC

void parameters_start(unsigned axis);  // all defaults, written to the registers too

// Whether a parameter accepts a value. Returns ok, unknown_parameter, out_of_range or not_built.
uint8_t parameters_check(unsigned axis, uint8_t id, int64_t value);

// Sets a parameter and writes its registers; the caller has checked the value.
void parameters_set(unsigned axis, uint8_t id, int64_t value);
int64_t parameters_get(unsigned axis, uint8_t id);
int64_t parameters_default(uint8_t id);

// Writes the bus watchdog's time again, since a bit of it may have flipped.
void parameters_refresh(void);

// Limits of a motion whose velocity is limited by the parameter `velocity_id`.
struct planner_limits parameters_limits(unsigned axis, uint8_t velocity_id);
struct planner_stepped_profile parameters_stepped_profile(unsigned axis, uint8_t velocity_id);

#endif

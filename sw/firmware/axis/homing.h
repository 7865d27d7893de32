// SPDX-License-Identifier: Apache-2.0
// homing -- finds the zero of an axis by a method of CiA 402-2, of S0 or of S3 (parameter
// home_method).
#ifndef MOIRE_HOMING_H
#define MOIRE_HOMING_H

#include <stdbool.h>
#include <stdint.h>

// Starts the homing. Returns ok, or the cause of a motion that the planner refuses.
uint8_t homing_begin(unsigned n);

// Continues the homing; `state` is the axis register of that name. Returns running, ok, or the
// cause of the failure: no_switch, switch_stuck, no_index, not_settled.
uint8_t homing_poll(unsigned n, uint32_t state);

// Ends the search for an index, if there is one: the index is used in both directions again. To be
// called whenever a homing has ended or was refused.
void homing_disarm(unsigned n);

// Position that the last homing found, relative to the zero that it chose, in 2^-16 period.
int32_t homing_phase(unsigned n);

// Position that the last homing gave to the zero, in periods.
int32_t homing_zero(unsigned n);

#endif

// SPDX-License-Identifier: Apache-2.0
// homing -- find the zero of an axis by one of the methods of CiA 402-2, of S0 or of S3 (parameter
// home_method).
#ifndef MOIRE_HOMING_H
#define MOIRE_HOMING_H

#include <stdbool.h>
#include <stdint.h>

// A bus_cause at once: ok if the homing has begun.
uint8_t homing_begin(unsigned n);

// running, or how it ended.
uint8_t homing_poll(unsigned n, uint32_t state);

int32_t homing_phase(
    unsigned n);  // [2^-16 period] place of the last zero above the phase zero that was chosen
int32_t homing_zero(unsigned n);  // what the zero was called by the last homing, in periods

#endif

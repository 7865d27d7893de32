// SPDX-License-Identifier: Apache-2.0
// calibration_driver -- connects the calibration of each axis to its registers: bursts come from
// calibration_recorder, values go into signal_correction and harmonic_correction.
//
// The parameter `auto_calibration` says whether an axis calibrates itself or follows the drift of
// its signal; when it does neither, the values that were determined stay in force.
#ifndef MOIRE_CALIBRATION_DRIVER_H
#define MOIRE_CALIBRATION_DRIVER_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration.h"

// Corrects nothing yet. The parameters of the axis must have their defaults by then.
void calibration_driver_start(unsigned n);

// One small piece of work, about 1 ms at most.
void calibration_driver_poll(unsigned n);
// Whether there is nothing to do but to see that the axis moves.
bool calibration_driver_idle(unsigned n);

const struct calibration* calibration_driver_state(unsigned n);
uint8_t calibration_driver_reason(unsigned n);  // a bus_calibration_reason

// Does a bus_calibration_action. Returns ok or out_of_range.
uint8_t calibration_driver_do(unsigned n, uint8_t action);

// Sets the harmonic of an order, 1 … CALIBRATION_ORDERS, in 2^-24 period; it waits for
// calibration_driver_set_correction. Returns ok or out_of_range.
uint8_t calibration_driver_set_harmonic(unsigned n, uint8_t order, int32_t cosine, int32_t sine);

// Sets offsets, gain and quadrature error; `apply` puts them into force together with the harmonics
// that were set before. Returns ok or out_of_range.
uint8_t calibration_driver_set_correction(unsigned n, const struct calibration_values* ellipse,
                                          bool apply);

#endif

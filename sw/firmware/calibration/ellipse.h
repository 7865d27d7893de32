// SPDX-License-Identifier: Apache-2.0
// ellipse -- offsets, gain and quadrature error of a sine/cosine signal, from its samples.
#ifndef MOIRE_ELLIPSE_H
#define MOIRE_ELLIPSE_H

#include <stdint.h>

#include "calibration/calibration_types.h"
#include "calibration/equations.h"
#include "made/bus_protocol.h"

void ellipse_start(struct calibration_ellipse* ellipse);

// Adds a sample {cos, sin}, 16 bits each, full scale 2^15. The calibration has the amplitude window
// and the offsets in force.
void ellipse_take(struct calibration_ellipse* ellipse, const struct calibration* calibration,
                  uint32_t word);

// The equations of the samples. Returns calibrating, or why the samples do not allow it:
// amplitude, standstill or partial_circle.
enum bus_calibration_reason ellipse_equations(const struct calibration_ellipse* ellipse,
                                              struct equations* e);

// Puts the solution of the equations into `values`, whose harmonics stay. Returns calibrating, or
// distorted and leaves them.
enum bus_calibration_reason ellipse_values(const int64_t solution[5],
                                           struct calibration_values* values);

// All of it at once. Returns as both do, and partial_circle for equations without a solution.
enum bus_calibration_reason ellipse_fit(const struct calibration_ellipse* ellipse,
                                        struct calibration_values* values);

#endif

// SPDX-License-Identifier: Apache-2.0
// harmonics -- the periodic error of a sine/cosine signal, from bursts of phases in motion.
//
// All but harmonics_table_entry work on `burst`. Functions with `next` are pieces of work, numbered
// from 0; they return true with the last one.
#ifndef MOIRE_HARMONICS_H
#define MOIRE_HARMONICS_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration_types.h"
#include "made/bus_protocol.h"

// Entry 0 … CALIBRATION_POINTS - 1 of the table of harmonic_correction, 2^-20 period.
int32_t harmonics_table_entry(const struct calibration_values* values, uint32_t point);

// The candidate becomes the present result of the pass, and the table of the burst is made from it.
bool harmonics_update_candidate(const struct calibration_pass* pass, uint32_t next);
bool harmonics_fill_table(uint32_t next);

// First reading, a block of phases at a time.
void harmonics_begin_first_reading(void);
void harmonics_read_first(const uint32_t words[CALIBRATION_WORDS]);

// Returns calibrating, or why the burst is not used: too_fast, standstill, partial_circle or
// unsteady.
enum bus_calibration_reason harmonics_check_burst(void);

// Sets up burst.fit for the fit to the blocks: 3 unknowns of the motion, or 5 of motion and
// vibration. The caller solves it.
void harmonics_begin_equations(uint32_t unknowns);

// Puts the residual of the motion into the spectrum.
bool harmonics_put_residuals(uint32_t next);

// Adds the vibration of burst.vibration to the fit.
void harmonics_begin_vibration(void);
bool harmonics_fit_vibration(uint32_t next);

// Second reading: sorts the residual of motion and vibration into bins of the phase.
bool harmonics_clear(uint32_t next);
void harmonics_begin_second_reading(void);
void harmonics_read_second(const uint32_t words[CALIBRATION_WORDS]);

// Weighs the burst, and then projects it: harmonics_project and harmonics_add_order for each order.
void harmonics_weigh(void);
bool harmonics_fold(uint32_t next);
bool harmonics_project(uint32_t next);
bool harmonics_add_order(struct calibration_pass* pass);  // returns true with the last order

// The standard error of the pass, 2^-20 period; above 2^31 if the pass has no information about an
// order. `*even` becomes true if it has about as much information about each order.
uint32_t harmonics_scatter(const struct calibration_pass* pass, bool* even);

#endif

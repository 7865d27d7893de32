// SPDX-License-Identifier: Apache-2.0
// calibration -- offset, gain, quadrature error and harmonics of a sine/cosine signal, determined
// in motion and without a reference (docs/interpolation.md). No hardware.
//
// The caller polls `need` and does this, a few words or one piece of work a poll:
//   CALIBRATION_NEEDS_SAMPLES, _PHASES  let calibration_recorder fill, then call calibration_open
//   CALIBRATION_NEEDS_WORDS             calibration_take for each sample of the burst, or for each
//                                       four words of phases; a burst of phases is read twice
//   CALIBRATION_NEEDS_WORK              calibration_work
//   CALIBRATION_NEEDS_LOADING           values into signal_correction, harmonics_table_entry 0 …
//                                       255 into harmonic_correction, then call calibration_loaded
// All calibrations share one work area: while a burst is in it, calibration_open of the others
// returns false.
#ifndef MOIRE_CALIBRATION_H
#define MOIRE_CALIBRATION_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration_types.h"

void calibration_start(struct calibration* calibration);  // from reset: nothing is known

// The values become calibration_identity and everything is determined from scratch; window, limit,
// counters and the mode do not change.
void calibration_forget(struct calibration* calibration);

// Puts values into force as if they had been determined. Returns false and changes nothing if one
// is out of range.
bool calibration_restore(struct calibration* calibration, const struct calibration_values* values);

// A frozen calibration determines nothing; its values stay in force. What was under way ends.
void calibration_set_mode(struct calibration* calibration, enum calibration_mode mode);

// A burst was recorded, one sample of `every`; it is spoiled if its amplitude left the window.
// Returns false if no burst is needed, or another calibration works on one: then call again.
bool calibration_open(struct calibration* calibration, uint16_t every, bool spoiled);

// The next words of the burst: one sample in the first word, or four words of phases.
void calibration_take(struct calibration* calibration, const uint32_t words[CALIBRATION_WORDS]);

void calibration_work(struct calibration* calibration);    // one piece: some hundred instructions
void calibration_loaded(struct calibration* calibration);  // the values are in the hardware

#endif

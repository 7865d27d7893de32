// SPDX-License-Identifier: Apache-2.0
// grating -- the correction of the sine and cosine of an axis: its learner and the recorder, the correction and the table that
// serve it. The parameter `learning` says whether it learns; what was learned stays in force when it does not.
#ifndef MOIRE_GRATING_H
#define MOIRE_GRATING_H

#include <stdbool.h>
#include <stdint.h>

#include "learner.h"

void grating_start(unsigned n);                                         // corrects nothing; after parameters_start
void grating_poll(unsigned n);                                          // one small piece of work

const struct learner *grating_learner(unsigned n);
uint8_t grating_learn(unsigned n, uint8_t action);                      // a line_learner_action; returns a line_cause, as all here
uint8_t grating_reason(unsigned n);                                     // a line_learner_reason
uint8_t grating_set_harmonic(unsigned n, uint8_t order, int32_t cosine, int32_t sine);              // waits for set_correction
uint8_t grating_set_correction(unsigned n, const struct learner_values *ellipse, bool apply);
void grating_clear_signal_faults(unsigned n);

uint8_t grating_write_register(uint32_t offset, unsigned n, uint32_t value);    // what a user may write, by offset in the block
bool grating_may_read(uint32_t offset);                                 // reading it changes nothing

#endif

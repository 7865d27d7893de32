// SPDX-License-Identifier: Apache-2.0
// grating -- the correction of the sine and cosine of an axis: its calibration and the recorder,
// the correction and the table that serve it. The parameter `learning` says whether it learns; what
// was learned stays in force when it does not.
#ifndef MOIRE_CALIBRATION_RUNNER_H
#define MOIRE_CALIBRATION_RUNNER_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration.h"

void calibration_runner_start(unsigned n);  // corrects nothing; after parameters_start
void calibration_runner_poll(unsigned n);   // one small piece of work

const struct calibration* calibration_runner_state(unsigned n);
uint8_t calibration_runner_do(
    unsigned n, uint8_t action);  // a bus_calibration_action; returns a bus_cause, as all here
uint8_t calibration_runner_reason(unsigned n);  // a bus_calibration_reason
uint8_t calibration_runner_set_harmonic(unsigned n, uint8_t order, int32_t cosine,
                                        int32_t sine);  // waits for set_correction
uint8_t calibration_runner_set_correction(unsigned n, const struct calibration_values* ellipse,
                                          bool apply);

#endif

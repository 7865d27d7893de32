// SPDX-License-Identifier: Apache-2.0
// fine_response -- records how the fine stage of an axis responds to steps of its DAC, in open
// loop.
//
// A step is an offset of the DAC beside the command of the fine stage, which is 0. The recorder of
// the calibration stores the phases that follow, at equal intervals. The recording of a step begins
// some ten cycles before the DAC gets it, and the DAC is sent one word after the other, so that it
// has the step after one to two words. One axis at a time.
#ifndef MOIRE_FINE_RESPONSE_H
#define MOIRE_FINE_RESPONSE_H

#include <stdbool.h>
#include <stdint.h>

void fine_response_start(unsigned axes);
void fine_response_work(void);
bool fine_response_idle(void);
uint8_t fine_response_operation(uint8_t operation);  // a bus_cause

#endif

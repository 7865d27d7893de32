// SPDX-License-Identifier: Apache-2.0
// spectrum -- the spectrum of a burst, and the vibration of the machine in it.
#ifndef MOIRE_SPECTRUM_H
#define MOIRE_SPECTRUM_H

#include <stdbool.h>
#include <stdint.h>

#include "calibration/calibration_types.h"

// The Hann window in the middle of a block, 1.0 = 2^15.
int32_t spectrum_window(uint32_t block);

// Puts the residual of a block, 2^-20 period, into the order that the transform requires.
void spectrum_put(uint32_t block, int32_t residual);

// Pieces of work, `next` from 0; they return true with the last one.
bool spectrum_transform(uint32_t next);
bool spectrum_weakest_lines(struct calibration_pass* pass, uint32_t next);

// Finds the frequency of the vibration in this burst: near the line that is present in every burst
// of the pass. Returns false if there is none above 1.5 cycles a burst.
bool spectrum_find_vibration(void);

#endif

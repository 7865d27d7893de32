// SPDX-License-Identifier: Apache-2.0
// segments -- the segment table of each axis, as a part of an image. The host loads it; it is in
// force while the parameter `segments` requests it and the zero is known.
#ifndef MOIRE_SEGMENTS_H
#define MOIRE_SEGMENTS_H

#include <stdbool.h>
#include <stdint.h>

void segments_start(unsigned axes);
void segments_work(void);
bool segments_idle(void);
uint8_t segments_operation(uint8_t operation);  // a bus_cause

#endif

// SPDX-License-Identifier: Apache-2.0
// update -- new firmware over the bus, in two images behind the factory image, and the choice of
// the image that runs after power-up.
#ifndef MOIRE_UPDATE_H
#define MOIRE_UPDATE_H

#include <stdbool.h>
#include <stdint.h>

void update_start(unsigned axes);  // in image 0, starts the newest confirmed image, if there is one
void update_work(void);
uint8_t update_operation(uint8_t operation);  // a bus_cause; not_built: none of an update
bool update_idle(void);

#endif

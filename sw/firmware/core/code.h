// SPDX-License-Identifier: Apache-2.0
// code -- the part of the firmware that the soft core executes from its flash.
#ifndef MOIRE_CODE_H
#define MOIRE_CODE_H

#include <stdbool.h>

#include "core/hardware.h"

// Whether the flash has the part that belongs to this firmware, bit by bit.
#if HARDWARE_CODE
bool code_intact(void);
#else
static inline bool code_intact(void) { return true; }
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// feedback -- access of the host to the registers of a feedback channel.
//
// `offset` is the byte offset inside the register block, `n` the axis.
#ifndef MOIRE_FEEDBACK_H
#define MOIRE_FEEDBACK_H

#include <stdbool.h>
#include <stdint.h>

// Clears the latched signal faults; those whose cause persists are latched again at once.
void feedback_clear_signal_faults(unsigned n);

// Writes one of the registers that the host may write: index, capture and compare. A word of a wide
// register is in force at once.
// Returns a bus_cause: no_such_register for all others, out_of_range for strobes of the firmware.
uint8_t feedback_write_register(uint32_t offset, unsigned n, uint32_t value);

// Whether the host may read this register: reading it changes nothing.
bool feedback_may_read(uint32_t offset);

#endif

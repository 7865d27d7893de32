// SPDX-License-Identifier: Apache-2.0
// hardware -- all that the firmware knows of the machine below it: the made register map and three
// things of the core. With MOIRE_REGISTER_ACCESS defined, register_read and register_write come
// from a test and the core is the host's.
#ifndef MOIRE_HARDWARE_H
#define MOIRE_HARDWARE_H

#include <stdbool.h>
#include <stdint.h>

#include "made/registers.h"

#ifndef HARDWARE_AXES
#define HARDWARE_AXES 8u  // the most that are served
#endif

// A position of 48 bits.
static inline int64_t axis_read_position(unsigned axis, uint32_t offset) {
    return (int64_t)(axis_read_wide(axis, offset) << 16) >> 16;
}

static inline bool hardware_has_sine(unsigned axis) {
    return feedback_read(axis, FEEDBACK_POSITION_SOURCE) & FEEDBACK_POSITION_SOURCE_SINE_MASK;
}

static inline bool hardware_map_fits(void) { return node_read(NODE_MAP_CRC) == MAP_CRC; }

#ifndef MOIRE_REGISTER_ACCESS
#define STACK_MARK 0x4d6f6972u  // start.S writes it to the lowest word of the stack
extern const volatile uint32_t _stack_limit;
static inline bool hardware_stack_intact(void) { return _stack_limit == STACK_MARK; }
static inline void hardware_halt(void) {
    __asm__ volatile("ebreak");
}  // the core stops, the guard switches the drives off
#else
static inline bool hardware_stack_intact(void) { return true; }
static inline void hardware_halt(void) {}
#endif

#endif

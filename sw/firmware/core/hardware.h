// SPDX-License-Identifier: Apache-2.0
// hardware -- the firmware's view of the hardware: the made register map and three features of the
// soft core.
//
// With MOIRE_REGISTER_ACCESS defined, a test provides register_read and register_write, and the
// firmware runs on the host computer.
#ifndef MOIRE_HARDWARE_H
#define MOIRE_HARDWARE_H

#include <stdbool.h>
#include <stdint.h>

#include "made/registers.h"

#ifndef HARDWARE_AXES
#define HARDWARE_AXES 8u  // most axes that the firmware serves
#endif
#ifndef HARDWARE_DRIVES
#define HARDWARE_DRIVES 1  // 0: the nodes of this image measure and have no drives
#endif
#ifndef HARDWARE_UPDATE
#define HARDWARE_UPDATE 0  // 1: for nodes with HAS_UPDATE, whose firmware reaches its flash
#endif

#ifndef HARDWARE_CODE
#define HARDWARE_CODE \
    0  // 1: a part of the firmware is executed from a flash (CODE_BYTES of a node)
#endif

// A position of 48 bits.
static inline int64_t axis_read_position(unsigned axis, uint32_t offset) {
    return (int64_t)(axis_read_wide(axis, offset) << 16) >> 16;
}

// Whether an axis was built with this feature: a mask AXIS_BUILT_..._MASK.
static inline bool hardware_built(unsigned axis, uint32_t feature) {
    return axis_read(axis, AXIS_BUILT) & feature;
}

static inline bool hardware_map_fits(void) { return node_read(NODE_MAP_CRC) == MAP_CRC; }

#ifndef MOIRE_REGISTER_ACCESS
#define STACK_MARK 0x4d6f6972u  // start.S writes it into the lowest word of the stack
extern const volatile uint32_t _stack_limit;
static inline bool hardware_stack_intact(void) { return _stack_limit == STACK_MARK; }
// The core stops, and the drive-enable interlock switches the drives off: nothing is at this
// address. The serial core does not stop at an ebreak.
static inline void hardware_halt(void) { *(volatile uint32_t*)0x40000000u = 0; }
#else
static inline bool hardware_stack_intact(void) { return true; }
static inline void hardware_halt(void) {}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// feedback -- access of the host to the registers of a feedback channel.
#include "axis/feedback.h"

#include "core/hardware.h"
#include "made/bus_protocol.h"

#define USER_STROBES                                                            \
    (FEEDBACK_STROBES_ARM_INDEX_MASK | FEEDBACK_STROBES_CAPTURE_NOW_MASK |      \
     FEEDBACK_STROBES_CAPTURE_NEXT_MASK | FEEDBACK_STROBES_CAPTURE_CLEAR_MASK | \
     FEEDBACK_STROBES_COMPARE_ARM_MASK | FEEDBACK_STROBES_COMPARE_DISARM_MASK)

#define COMPARE_STROBES (FEEDBACK_STROBES_COMPARE_ARM_MASK | FEEDBACK_STROBES_COMPARE_DISARM_MASK)
#define CAPTURE_INDEX 1u  // of capture_sources; an axis without a queue captures it, too

void feedback_clear_signal_faults(unsigned n) {
    feedback_write(n, FEEDBACK_STROBES, FEEDBACK_STROBES_CLEAR_SIGNAL_FAULTS_MASK);
}

uint8_t feedback_write_register(uint32_t offset, unsigned n, uint32_t value) {
    uint32_t feature = 0;
    switch (offset) {
    case FEEDBACK_STROBES:
        if (value & ~USER_STROBES) return BUS_CAUSE_OUT_OF_RANGE;
        if (value & COMPARE_STROBES) feature = AXIS_BUILT_COMPARE_MASK;
        if (value & FEEDBACK_STROBES_CAPTURE_NOW_MASK) feature |= AXIS_BUILT_CAPTURE_MASK;
        break;
    case FEEDBACK_CAPTURE_SOURCES:
        if (value & ~CAPTURE_INDEX) feature = AXIS_BUILT_CAPTURE_MASK;
        break;
    case FEEDBACK_INDEX:
    case FEEDBACK_INDEX_EVENTS:
    case FEEDBACK_CAPTURE_STATE: break;
    case FEEDBACK_COUNTS_PER_REVOLUTION: feature = AXIS_BUILT_ENCODER_CHECK_MASK; break;
    case FEEDBACK_COMPARE_START_LOW:
    case FEEDBACK_COMPARE_START_HIGH:
    case FEEDBACK_COMPARE_STEP_LOW:
    case FEEDBACK_COMPARE_STEP_HIGH:
    case FEEDBACK_COMPARE_COUNT:
    case FEEDBACK_COMPARE_PULSE:
    case FEEDBACK_COMPARE_GAP:
    case FEEDBACK_COMPARE_STATE: feature = AXIS_BUILT_COMPARE_MASK; break;
    default: return BUS_CAUSE_NO_SUCH_REGISTER;
    }
    if (feature & ~axis_read(n, AXIS_BUILT)) return BUS_CAUSE_NOT_BUILT;
    feedback_write(n, offset, value);
    return BUS_CAUSE_OK;
}

bool feedback_may_read(uint32_t offset) { return offset != FEEDBACK_RECORDER_WORD; }

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

// Writes one word of a wide register, together with the other one as it is. The host writes them by
// two requests, and between these the firmware writes other wide registers.
static void write_word(unsigned n, uint32_t offset, uint32_t value) {
    if (offset & 4u)
        feedback_write_wide(n, offset - 4u, (uint64_t)value << 32 | feedback_read(n, offset - 4u));
    else
        feedback_write_wide(n, offset, (uint64_t)feedback_read(n, offset + 4u) << 32 | value);
}

uint8_t feedback_write_register(uint32_t offset, unsigned n, uint32_t value) {
    uint32_t feature = 0;
    bool wide = false;
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
    default:  // the registers of compare follow each other, those of the two positions first
        if (offset % 4u || offset < FEEDBACK_COMPARE_START_LOW || offset > FEEDBACK_COMPARE_STATE)
            return BUS_CAUSE_NO_SUCH_REGISTER;
        feature = AXIS_BUILT_COMPARE_MASK;
        wide = offset <= FEEDBACK_COMPARE_STEP_HIGH;
    }
    if (feature & ~axis_read(n, AXIS_BUILT)) return BUS_CAUSE_NOT_BUILT;
    wide ? write_word(n, offset, value) : feedback_write(n, offset, value);
    return BUS_CAUSE_OK;
}

bool feedback_may_read(uint32_t offset) { return offset != FEEDBACK_RECORDER_WORD; }

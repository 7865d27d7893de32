// SPDX-License-Identifier: GPL-2.0-or-later
#include "latch.h"

#include "made/registers.h"
#include "packet.h"

void latch_arm(struct latch* latch, uint32_t sources) {
    latch->sources = sources;
    latch->phase = LATCH_SOURCES;
}

bool latch_asks(const struct latch* latch, unsigned axis, struct spare_access* access) {
    uint32_t base = FEEDBACK_BASE + axis * FEEDBACK_STRIDE;
    switch (latch->phase) {
    case LATCH_SOURCES:
        *access =
            (struct spare_access){(base + FEEDBACK_CAPTURE_SOURCES) | SPARE_WRITE, latch->sources};
        return true;
    case LATCH_CLEAR:
        *access = (struct spare_access){
            (base + FEEDBACK_STROBES) | SPARE_WRITE,
            FEEDBACK_STROBES_CAPTURE_CLEAR_MASK | FEEDBACK_STROBES_ARM_INDEX_MASK};
        return true;
    case LATCH_READ:
        *access = (struct spare_access){base + FEEDBACK_CAPTURED_POSITION, 0};
        return true;
    default: return false;
    }
}

void latch_look(struct latch* latch, uint32_t state) {
    bool present = FIELD_GET(state, FEEDBACK_CAPTURE_STATE_PRESENT);
    if (latch->phase == LATCH_ARMED && present) latch->phase = LATCH_READ;
}

void latch_answer(struct latch* latch, uint32_t value, int64_t present) {
    switch (latch->phase) {
    case LATCH_SOURCES: latch->phase = LATCH_CLEAR; break;
    case LATCH_CLEAR: latch->phase = LATCH_ARMED; break;
    case LATCH_READ:
        latch->position = present + (int32_t)(value - (uint32_t)present);
        latch->phase = LATCH_DONE;
        break;
    default: break;
    }
}

// SPDX-License-Identifier: GPL-2.0-or-later
#include "encoder.h"

#include "node.h"

// `index-enable`: the next index is latched by the node, so its position is exact at any speed.
static void look_for_index(struct encoder* encoder, struct latch* latch) {
    if (!*encoder->pins.index_enable) {
        latch->phase = LATCH_OFF;
    } else if (latch->phase == LATCH_OFF) {
        latch_arm(latch, SOURCE_INDEX);
    } else if (latch->phase == LATCH_DONE) {
        encoder->zero = latch->position;
        latch->phase = LATCH_OFF;
        *encoder->pins.index_enable = 0;
    }
}

void encoder_take(struct encoder* encoder, struct latch* latch, const uint32_t* words,
                  unsigned axes, unsigned number, double tick_s) {
    struct encoder_pins* pins = &encoder->pins;
    int64_t position = position_word(words, READ_AXIS_POSITION, axes, number);
    int32_t velocity = (int32_t)words[list_word(READ_AXIS_VELOCITY, axes, number)];
    double scale = scale_of(*pins->scale);
    look_for_index(encoder, latch);
    if (*pins->reset) encoder->zero = position;
    *pins->rawcounts = (int32_t)(position >> COUNT_SHIFT);
    *pins->count = (int32_t)((position - encoder->zero) >> COUNT_SHIFT);
    *pins->position = (double)(position - encoder->zero) / POSITION_LSB / scale;
    *pins->velocity = velocity / POSITION_LSB / tick_s / scale;
}

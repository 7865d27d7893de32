// SPDX-License-Identifier: GPL-2.0-or-later
// encoder.h -- an axis without a drive as an encoder of LinuxCNC, such as that of a spindle.
#ifndef MOIRE_ENCODER_H
#define MOIRE_ENCODER_H

#include <stdint.h>

#include "latch.h"
#include "made/pins.h"

struct encoder {
    struct encoder_pins pins;
    int64_t zero;  // 2^-16 period, where its count is 0
};

// What a good reply says of axis `number` of `axes` goes to its pins; `latch` is that of the axis.
void encoder_take(struct encoder* encoder, struct latch* latch, const uint32_t* words,
                  unsigned axes, unsigned number, double tick_s);

#endif

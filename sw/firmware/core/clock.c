// SPDX-License-Identifier: Apache-2.0
// clock -- milliseconds since start.
#include "core/clock.h"

#include "core/hardware.h"

static uint32_t now_ms, last_stamp, cycles_per_ms;

void clock_start(void) {
    now_ms = 0;
    last_stamp = node_read(NODE_TIME_STAMP_LOW);
    cycles_per_ms = node_read(NODE_CLK_HZ) / 1000u;
    if (cycles_per_ms == 0) cycles_per_ms = 1;
}

void clock_poll(void) {
    uint32_t passed = node_read(NODE_TIME_STAMP_LOW) - last_stamp;
    if (passed < cycles_per_ms) return;
    uint32_t ms = passed / cycles_per_ms;
    now_ms += ms;
    last_stamp += ms * cycles_per_ms;
}

uint32_t clock_ms(void) { return now_ms; }

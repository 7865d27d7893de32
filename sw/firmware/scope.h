// SPDX-License-Identifier: Apache-2.0
// scope -- records position, error and command of one axis, from before a trigger on. With an amplitude it drives the axis in open
// loop meanwhile, to see how it answers. There is one for all axes. Times are in SCOPE_CLK clk since the sample before.
#ifndef MOIRE_SCOPE_H
#define MOIRE_SCOPE_H

#include <stdint.h>

#define SCOPE_CLK 64u

struct scope_setting {
    uint8_t axis;
    uint8_t trigger;                        // line_scope_trigger
    uint8_t before;                         // samples kept from before the trigger
    uint16_t every;                         // ticks from sample to sample, at least
    uint32_t level;                         // of the error; with an amplitude: how far the axis may go. LSB of position
    int16_t amplitude;                      // of the open loop, 0: none
};

struct scope_sample {                       // as on the line
    int32_t position;                       // low word
    int32_t error;
    int16_t command;
    uint16_t time;
};

void scope_start(void);
void scope_poll(void);
uint8_t scope_arm(const struct scope_setting *setting);         // a line_cause
uint8_t scope_state(void);                                      // line_scope_state
uint8_t scope_count(void);                                      // samples there, once it is full
uint8_t scope_before(void);                                     // of them from before the trigger
uint8_t scope_byte(uint8_t first, uint32_t n);                  // of the samples from this one on, 0 behind the last; the oldest is 0

#endif

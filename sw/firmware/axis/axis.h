// SPDX-License-Identifier: Apache-2.0
// axis -- what an axis is doing: off, holding, moving, homing, faulted. Requests answer with a
// bus_cause at once; what they began goes on in axis_poll, and its outcome is axis_ended.
#ifndef MOIRE_AXIS_H
#define MOIRE_AXIS_H

#include <stdbool.h>
#include <stdint.h>

void axis_start(unsigned n);
void axis_poll(unsigned n);

uint8_t axis_enable(unsigned n, bool on);
uint8_t axis_home(unsigned n);
uint8_t axis_move(unsigned n, int64_t target, uint32_t* duration_ticks);
uint8_t axis_prepare(unsigned n, int64_t target, uint32_t* duration_ticks);
uint8_t axis_start_prepared(unsigned count, uint32_t mask);  // bit n: axis n, of so many
uint8_t axis_may_start(unsigned count, uint32_t mask);       // whether all of them wait for it
void axis_started(unsigned count, uint32_t mask);            // by the hardware
uint8_t axis_stop(unsigned n);
uint8_t axis_excite(unsigned n, bool on);  // open loop: whoever asked for it writes open_command
uint8_t axis_go(unsigned n, int64_t distance,
                uint8_t velocity_id);  // for what measures by itself: no zero, no travel
uint8_t axis_command_count(
    unsigned n);  // changes when the axis is told off, home, move, prepare or stop
uint8_t axis_reset_faults(unsigned n);
uint8_t axis_set_parameter(unsigned n, uint8_t id, int64_t value);

uint8_t axis_state(unsigned n);  // a bus_state
uint8_t axis_ended(unsigned n);  // a bus_cause
uint8_t axis_flags(unsigned n);  // bus_flag bits
bool axis_homed(unsigned n);

#endif

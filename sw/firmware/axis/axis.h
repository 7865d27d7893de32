// SPDX-License-Identifier: Apache-2.0
// axis -- state machine of an axis: off, holding, moving, homing, faulted.
//
// A request returns a bus_cause at once. Work that it starts continues in axis_poll; axis_ended
// returns how it ended. All positions and distances are in 2^-16 period, `n` is the axis.
#ifndef MOIRE_AXIS_H
#define MOIRE_AXIS_H

#include <stdbool.h>
#include <stdint.h>

void axis_start(unsigned n);  // drive off, all parameters at their defaults
void axis_poll(unsigned n);   // one step of the state machine; to be called often

// The longest time to the next axis_poll, in ticks; 0: at once.
uint32_t axis_idle_ticks(unsigned n);

// Switches the drive on or off. Returns faulted if a fault is latched or latches at once.
uint8_t axis_enable(unsigned n, bool on);

// Each of these starts a motion. Returns faulted, not_enabled, busy, or the refusal of the planner.
uint8_t axis_home(unsigned n);
// Returns also not_homed and out_of_travel. While the axis moves, it changes the target in flight
// and leaves *duration_ticks at 0.
uint8_t axis_move(unsigned n, int64_t target, uint32_t* duration_ticks);
// Moves by a distance, without zero and limits of travel: for parts that measure the position
// themselves.
uint8_t axis_go(unsigned n, int64_t distance, uint8_t velocity_id);

// Plans a motion to `target` and waits for the common start; returns as axis_move.
uint8_t axis_prepare(unsigned n, int64_t target, uint32_t* duration_ticks);

// Of `count` axes, bit n of `mask` selects axis n. All selected axes start in the same tick, or
// none: out_of_range for an empty mask or an axis that does not exist, not_prepared.
uint8_t axis_start_prepared(unsigned count, uint32_t mask);
uint8_t axis_may_start(unsigned count, uint32_t mask);  // the check alone
void axis_started(unsigned count, uint32_t mask);       // the hardware has started them
uint32_t axis_prepared(unsigned count, uint32_t mask);  // those of the axes that wait for a start

uint8_t axis_stop(unsigned n);  // controlled stop; always ok
// Begins a controlled stop of a motion in progress, which then ends with this cause.
void axis_break_off(unsigned n, uint8_t cause);

// Open loop on or off: while it is on, the caller writes the register open_command.
uint8_t axis_excite(unsigned n, bool on);
bool axis_ease(unsigned n);  // meanwhile: open_command slowly becomes 0; true when it is

// Returns fault_persists while the cause of a latched fault is present.
uint8_t axis_reset_faults(unsigned n);

// Returns the causes of parameters_check, and busy for a parameter that must not change now.
// Another decoder_mode or position_source invalidates the zero.
uint8_t axis_set_parameter(unsigned n, uint8_t id, int64_t value);

// Changes with each request to switch off, home, move, prepare or stop; wraps.
uint8_t axis_command_count(unsigned n);

uint8_t axis_state(unsigned n);  // a bus_state
uint8_t axis_ended(unsigned n);  // a bus_cause
uint8_t axis_flags(unsigned n);  // bits of bus_flag
bool axis_homed(unsigned n);

#endif

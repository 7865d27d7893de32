// SPDX-License-Identifier: Apache-2.0
// machine -- the wire-EDM machine: its keyboard keys start a cut, two status inputs tell whether it cuts and whether something is wrong.
#ifndef MOIRE_MACHINE_H
#define MOIRE_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

enum machine_state { MACHINE_LEFT, MACHINE_QUIET, MACHINE_KEYS_WAIT, MACHINE_STARTING, MACHINE_CUTTING, MACHINE_ENDING, MACHINE_CUT, MACHINE_FAILED };

void machine_start(unsigned axes);
void machine_work(void);
void machine_begin(void);                       // send the keys, follow the cut
void machine_follow(void);                      // the cut that is under way
void machine_leave(void);                       // keys that are not yet under way are taken back
enum machine_state machine_state(void);
uint8_t machine_cause(void);                    // why it failed
bool machine_built(void);
bool machine_cuts(void);
bool machine_alarms(void);
bool machine_keys_wait(void);                   // a person types, or the machine takes no keys
bool machine_rests(void);                       // neither cutting, nor do keys of ours wait that would start it

#endif

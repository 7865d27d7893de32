// SPDX-License-Identifier: Apache-2.0
// machine -- the wire-EDM machine: its keyboard keys start a cut, two status inputs tell whether it
// cuts and whether something is wrong.
#ifndef MOIRE_EDM_H
#define MOIRE_EDM_H

#include <stdbool.h>
#include <stdint.h>

enum edm_state {
    EDM_LEFT,
    EDM_QUIET,
    MACHINE_KEYS_PENDING,
    EDM_STARTING,
    EDM_CUTTING,
    EDM_ENDING,
    EDM_CUT,
    EDM_FAILED
};

void edm_start(unsigned axes);
void edm_work(void);
void edm_begin(void);   // send the keys, follow the cut
void edm_follow(void);  // the cut that is under way
void edm_leave(void);   // keys that are not yet under way are taken back
enum edm_state edm_state(void);
uint8_t edm_cause(void);  // why it failed
bool edm_built(void);
bool edm_cuts(void);
bool edm_alarms(void);
bool machine_keys_pending(void);  // a person types, or the machine takes no keys
bool edm_rests(void);             // neither cutting, nor do keys of ours wait that would start it

#endif

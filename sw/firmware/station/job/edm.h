// SPDX-License-Identifier: Apache-2.0
// edm -- the wire-EDM machine: keys of its keyboard start a cut, and two status inputs say whether
// it cuts and whether it has an alarm.
#ifndef MOIRE_EDM_H
#define MOIRE_EDM_H

#include <stdbool.h>
#include <stdint.h>

enum edm_state {
    EDM_IDLE,          // no cut is followed
    EDM_QUIET,         // waits until nobody types
    EDM_KEYS_PENDING,  // the keys wait to be sent
    EDM_STARTING,
    EDM_CUTTING,
    EDM_ENDING,  // an alarm that ended the cut would show now
    EDM_CUT,     // the cut has ended well
    EDM_FAILED   // edm_cause says why
};

void edm_start(unsigned axes);
void edm_work(void);
void edm_begin(void);    // sends the keys and follows the cut
void edm_follow(void);   // follows the cut that is under way
void edm_release(void);  // stops following; keys that are not being sent are taken back
enum edm_state edm_state(void);
uint8_t edm_cause(void);      // why it failed, a bus_cause
bool edm_built(void);         // this node has a keyboard port and the status inputs
bool edm_cutting(void);       // the status input says so
bool edm_alarm(void);         // the status input says so
bool edm_keys_pending(void);  // keys wait: a person types, or the machine takes none
bool edm_at_rest(void);       // it does not cut, and no keys wait that would start it

#endif

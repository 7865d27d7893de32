// SPDX-License-Identifier: Apache-2.0
// store -- the program of stations, the journal of the job and what the node keeps of its values, in an EEPROM 24AA128, whole after a
// power cut at any moment.
#ifndef MOIRE_STORE_H
#define MOIRE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#define STORE_STATIONS 360u             // most
#define STORE_TURN 129600000u           // a turn in 0.01 arcsec

enum store_step { STORE_NOTHING, STORE_STARTED, STORE_INDEXED, STORE_CUT_BEGUN, STORE_CUT_DONE, STORE_FINISHED, STORE_STOPPED,
                  STORE_NEXT };         // of a sub-node that counts: its next station

struct store_record {                   // a line of the journal, as in the EEPROM
    uint32_t sequence;                  // each has one more; 0: the journal is empty
    uint32_t program;                   // store_identity then
    uint16_t station;
    uint16_t step;                      // store_step
    uint32_t crc;
};

enum store_state { STORE_LOADING, STORE_READY, STORE_WRITING, STORE_DEAD };

void store_start(unsigned axes);
void store_work(void);
enum store_state store_state(void);
uint8_t store_cause(void);              // how the last loading or writing ended
bool store_torn(void);                  // one copy of the program was found damaged, the other one is in force

// The program in force; nothing of it while it is loaded, or if there is none.
uint16_t store_stations(void);
uint32_t store_angle(unsigned station); // 0.01 arcsec
uint32_t store_generation(void);          // each saved one has a higher one; 0: there is none
uint32_t store_identity(void);          // its CRC-32

const struct store_record *store_record(void);             // the last line of the journal

// These return a line_cause. A new program is begun, given its stations in their order, and comes into force when it is saved.
uint8_t store_begin(void);
uint8_t store_add(uint32_t angle);
uint16_t store_added(void);             // stations that the new program has so far
uint8_t store_save(void);
uint8_t store_note(uint16_t station, enum store_step step);     // a line into the journal

#define STORE_VALUES 254u               // most

// Values of the node: taken at power-up, settings only if the program is not newer.
struct store_kept {
    uint32_t generation;                // of all that is saved, programs too; 0: nothing is there
    uint16_t values;
    uint8_t cause;                      // what is kept, or why the defaults are in force
    bool torn;                          // one copy was found damaged
};
const struct store_kept *store_kept(void);
uint8_t store_keep(bool nothing);       // a line_cause

#endif

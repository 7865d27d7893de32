// SPDX-License-Identifier: Apache-2.0
// store -- the program of stations, the journal of the job and what the node keeps of its values,
// in an EEPROM 24AA128, whole after a power cut at any moment.
#ifndef MOIRE_STORE_H
#define MOIRE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#define STATION_LIST_MAX 360u         // most
#define STATION_LIST_TURN 129600000u  // a turn in 0.01 arcsec

enum journal_step {
    JOURNAL_NOTHING,
    JOURNAL_STARTED,
    JOURNAL_TURNED,
    JOURNAL_CUT_BEGUN,
    JOURNAL_CUT_DONE,
    JOURNAL_FINISHED,
    JOURNAL_STOPPED,
    JOURNAL_NEXT
};  // of a sub-node that counts: its next station

struct journal_record {  // a line of the journal, as in the EEPROM
    uint32_t sequence;   // each has one more; 0: the journal is empty
    uint32_t list;       // station_list_identity then
    uint16_t station;
    uint16_t step;  // journal_step
    uint32_t crc;
};

enum store_state { STORE_LOADING, STORE_READY, STORE_WRITING, STORE_DEAD };

void store_start(unsigned axes);
void store_work(void);
enum store_state store_state(void);
uint8_t store_cause(void);  // how the last loading or writing ended
bool station_list_damaged(
    void);  // one copy of the program was found damaged, the other one is in force

// The program in force; nothing of it while it is loaded, or if there is none.
uint16_t station_list_count(void);
uint32_t station_list_angle(unsigned station);  // 0.01 arcsec
uint32_t station_list_generation(void);         // each saved one has a higher one; 0: there is none
uint32_t station_list_identity(void);           // its CRC-32

const struct journal_record* journal_last(void);  // the last line of the journal

// These return a bus_cause. A new program is begun, given its stations in their order, and comes
// into force when it is saved.
uint8_t station_list_begin(void);
uint8_t station_list_add(uint32_t angle);
uint16_t station_list_added(void);  // stations that the new program has so far
uint8_t station_list_save(void);
uint8_t journal_write(uint16_t station, enum journal_step step);  // a line into the journal

#define VALUE_STORE_MAX 254u  // most

// Values of the node: taken at power-up, settings only if the program is not newer.
struct value_store_status {
    uint32_t generation;  // of all that is saved, programs too; 0: nothing is there
    uint16_t values;
    uint8_t cause;  // what is kept, or why the defaults are in force
    bool damaged;   // one copy was found damaged
};
const struct value_store_status* value_store_status(void);
uint8_t value_store_save(bool nothing);  // a bus_cause

#endif

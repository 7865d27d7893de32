// SPDX-License-Identifier: Apache-2.0
// journal -- records each step of a job before and after it is done, so that a loss of power never
// hides whether a cut had begun.
#ifndef MOIRE_JOURNAL_H
#define MOIRE_JOURNAL_H

#include <stdint.h>

#include "station/storage/store.h"

enum journal_step {
    JOURNAL_NOTHING,
    JOURNAL_STARTED,
    JOURNAL_TURNED,
    JOURNAL_CUT_BEGUN,
    JOURNAL_CUT_DONE,
    JOURNAL_FINISHED,
    JOURNAL_STOPPED,
    JOURNAL_NEXT  // of a sub-node that counts: `station` is its next one
};

struct journal_record {  // as it is in the EEPROM
    uint32_t sequence;   // one more in each record; 0: the journal is empty
    uint32_t list;       // station_list_identity at the time
    uint16_t station;    // from 0
    uint16_t step;       // a journal_step
    uint32_t crc;        // CRC-32 of all before it
};

extern const struct store_client journal_client;

// The last record that was read or written whole.
const struct journal_record* journal_last(void);

// Begins to write a record about a station of the list in force. Returns a bus_cause: ok,
// eeprom_busy or eeprom_missing; store_cause reports how the writing ends.
uint8_t journal_write(uint16_t station, enum journal_step step);

#endif

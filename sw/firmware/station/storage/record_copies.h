// SPDX-License-Identifier: Apache-2.0
// record_copies -- two copies of a record, each with a generation and a CRC-32: the newer whole one
// is in force, and a new record is written over the other one.
//
// So a power cut at any moment of a writing leaves the old record or the new one. All records of
// the station share one sequence of generations: it says which of two was saved later.
#ifndef MOIRE_RECORD_COPIES_H
#define MOIRE_RECORD_COPIES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/crc32.h"

struct record_copies {
    uint32_t generation[2];  // of each copy; 0: it is not whole
    bool blank[2];           // the copy was never written
    uint8_t newest;          // the copy in force; the other one is written next
    bool damaged;            // a copy is neither whole nor blank
};

// To be called before loading. `newest` is the copy that counts as the newest while neither is
// whole.
void record_copies_reset(struct record_copies* copies, uint8_t newest);

// To be called when both copies have been read: sets `newest` and `damaged`.
void record_copies_choose(struct record_copies* copies);

uint32_t record_copies_next_generation(void);

// The copy that is not the newest has been written and verified: it becomes the newest.
void record_copies_saved(struct record_copies* copies, uint32_t generation);

// Takes about 100 cycles a byte of a CRC: do not pass more than CRC_STEP bytes a poll.
#define CRC_STEP 16u

#endif

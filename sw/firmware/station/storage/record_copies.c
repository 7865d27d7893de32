// SPDX-License-Identifier: Apache-2.0
// record_copies -- two copies of a record, each with a generation and a CRC-32: the newer whole one
// is in force, and a new record is written over the other one.
#include "station/storage/record_copies.h"

static uint32_t highest;  // generation of all records

static void raise(uint32_t generation) {
    if (generation > highest) highest = generation;
}

void record_copies_reset(struct record_copies* copies, uint8_t newest) {
    *copies = (struct record_copies){.newest = newest};
    highest = 0;
}

void record_copies_choose(struct record_copies* copies) {
    const uint32_t* generation = copies->generation;
    for (unsigned copy = 0; copy < 2; copy++) {
        if (generation[copy] == 0 && !copies->blank[copy]) copies->damaged = true;
        raise(generation[copy]);
    }
    if (generation[0] != generation[1]) copies->newest = generation[1] > generation[0];
}

uint32_t record_copies_next_generation(void) { return highest + 1u; }

void record_copies_saved(struct record_copies* copies, uint32_t generation) {
    copies->newest = !copies->newest;
    copies->generation[copies->newest] = generation;
    copies->damaged = false;
    raise(generation);
}

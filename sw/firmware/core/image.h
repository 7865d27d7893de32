// SPDX-License-Identifier: Apache-2.0
// image -- the parts of a firmware image besides bus and axes: one image_NAME.c lists them, and
// build.py chooses the file.
#ifndef MOIRE_IMAGE_H
#define MOIRE_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

struct image_part {                           // null: the part does not need this function
    void (*start)(unsigned axes);             // number of axes that may be accessed
    void (*work)(void);                       // a small piece of work: well below 1 ms at 3 MHz
    uint8_t (*operation)(uint8_t operation);  // a bus_cause; not_built: not of this part
    // Whether its work may wait for 64 ticks, or until a word of the bus is received. A part that
    // has work but not this function is never idle.
    bool (*idle)(void);
};

extern const struct image_part image_parts[];
extern const unsigned image_part_count;

#endif

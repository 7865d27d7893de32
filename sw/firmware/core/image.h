// SPDX-License-Identifier: Apache-2.0
// image -- what a firmware image consists of besides line and axes: the list of one image_NAME.c,
// which build.py chooses.
#ifndef MOIRE_IMAGE_H
#define MOIRE_IMAGE_H

#include <stdint.h>

struct image_part {                // a function that a part has no need of is null
    void (*start)(unsigned axes);  // those that may be touched
    void (*work)(void);            // one small piece of work: well below 1 ms at 3 MHz
    uint8_t (*operation)(
        uint8_t operation);  // a bus_cause; not_built: it is not one of this part's
};

extern const struct image_part image_parts[];
extern const unsigned image_part_count;

#endif

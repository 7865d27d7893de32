// SPDX-License-Identifier: Apache-2.0
// image_station -- a station of an indexing machine (S4), main node and sub-node alike.
#include "image.h"
#include "settings.h"

const struct image_part image_parts[] = {
    {settings_start, 0, settings_operation},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

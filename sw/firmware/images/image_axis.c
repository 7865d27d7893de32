// SPDX-License-Identifier: Apache-2.0
// image_axis -- parts of a node for axes with sine/cosine encoders.
#include "core/image.h"
#include "images/axis_parts.h"

const struct image_part image_parts[] = {AXIS_PARTS};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

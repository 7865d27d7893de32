// SPDX-License-Identifier: Apache-2.0
// image_axis -- the axes of a measuring machine: their sines and cosines are corrected.
#include "correction.h"
#include "image.h"
#include "scope.h"
#include "segments.h"

const struct image_part image_parts[] = {
    {correction_start, correction_work, correction_operation},
    {segments_start, segments_work, segments_operation},
    {scope_start, scope_work, scope_operation},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

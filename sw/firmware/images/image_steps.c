// SPDX-License-Identifier: Apache-2.0
// image_steps -- parts of a node for axes with A/B/Z scales and any drives, without sine and
// cosine: segment tables, scope.
#include "core/image.h"
#include "bus/scope.h"
#include "bus/segments.h"

const struct image_part image_parts[] = {
    {segments_start, segments_work, segments_operation, segments_idle},
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

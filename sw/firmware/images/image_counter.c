// SPDX-License-Identifier: Apache-2.0
// image_counter -- parts of a node that counts (A/B/Z) and has no drives: scope.
#include "core/image.h"
#include "bus/scope.h"

const struct image_part image_parts[] = {
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

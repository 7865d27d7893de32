// SPDX-License-Identifier: Apache-2.0
// image_counter -- parts of a node that counts (A/B/Z) and has no drives: scope; with a
// serial core, whose firmware comes out of a flash, also updates of the firmware.
#include "core/hardware.h"
#include "core/image.h"
#include "bus/scope.h"
#include "update/update.h"

const struct image_part image_parts[] = {
#if HARDWARE_UPDATE
    {update_start, update_work, update_operation, update_idle},
#endif
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

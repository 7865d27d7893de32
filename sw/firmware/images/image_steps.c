// SPDX-License-Identifier: Apache-2.0
// image_steps -- parts of a node for axes with A/B/Z scales and any drives, without sine and
// cosine: segment tables, scope; with a flash also updates of the firmware.
#include "core/hardware.h"
#include "core/image.h"
#include "bus/scope.h"
#include "bus/segments.h"
#include "update/update.h"

const struct image_part image_parts[] = {
#if HARDWARE_UPDATE
    {update_start, update_work, update_operation, update_idle},
#endif
    {segments_start, segments_work, segments_operation, segments_idle},
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

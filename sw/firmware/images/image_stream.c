// SPDX-License-Identifier: Apache-2.0
// image_stream -- parts of image_axis, and streamed set-points: over the bus, and to the registers.
#include "bus/stream.h"
#include "bus/supervision.h"
#include "core/image.h"
#include "images/axis_parts.h"

const struct image_part image_parts[] = {
    AXIS_PARTS,
    {stream_start, 0, stream_operation, 0},
    {supervision_start, supervision_work, supervision_operation, supervision_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

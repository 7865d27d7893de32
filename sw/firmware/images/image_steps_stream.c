// SPDX-License-Identifier: Apache-2.0
// image_steps_stream -- parts of image_steps without updates, and streamed set-points: over the
// bus, and to the registers. For a node that LinuxCNC runs.
#include "bus/scope.h"
#include "bus/segments.h"
#include "bus/stream.h"
#include "bus/supervision.h"
#include "core/image.h"

const struct image_part image_parts[] = {
    {segments_start, segments_work, segments_operation, segments_idle},
    {scope_start, scope_work, scope_operation, scope_idle},
    {stream_start, 0, stream_operation, 0},
    {supervision_start, supervision_work, supervision_operation, supervision_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

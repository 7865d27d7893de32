// SPDX-License-Identifier: Apache-2.0
// image_stream -- parts of image_axis, and streamed set-points.
#include "bus/stream.h"
#include "core/image.h"
#include "images/axis_parts.h"

const struct image_part image_parts[] = {AXIS_PARTS, {stream_start, 0, stream_operation, 0}};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

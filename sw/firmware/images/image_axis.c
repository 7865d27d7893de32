// SPDX-License-Identifier: Apache-2.0
// image_axis -- parts of a node for axes with sine/cosine encoders: calibration, segment tables,
// scope.
#include "calibration/calibration_axes.h"
#include "core/image.h"
#include "bus/scope.h"
#include "bus/segments.h"

const struct image_part image_parts[] = {
    {calibration_axes_start, calibration_axes_work, calibration_axes_operation,
     calibration_axes_idle},
    {segments_start, segments_work, segments_operation, segments_idle},
    {scope_start, scope_work, scope_operation, scope_idle},
};
const unsigned image_part_count = sizeof image_parts / sizeof *image_parts;

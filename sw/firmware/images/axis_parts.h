// SPDX-License-Identifier: Apache-2.0
// axis_parts -- the parts of a node for axes with sine/cosine encoders: calibration, segment
// tables, scope, recorder of ticks, response of the fine stage. The images axis and stream have
// them.
#ifndef MOIRE_AXIS_PARTS_H
#define MOIRE_AXIS_PARTS_H

#include "bus/scope.h"
#include "bus/segments.h"
#include "bus/tick_scope.h"
#include "calibration/calibration_axes.h"
#include "calibration/fine_response.h"

#define AXIS_PARTS                                                                           \
    {calibration_axes_start, calibration_axes_work, calibration_axes_operation,              \
     calibration_axes_idle},                                                                 \
        {segments_start, segments_work, segments_operation, segments_idle},                  \
        {scope_start, scope_work, scope_operation, scope_idle},                              \
        {tick_scope_start, tick_scope_work, tick_scope_operation, tick_scope_idle}, {        \
        fine_response_start, fine_response_work, fine_response_operation, fine_response_idle \
    }

#endif

// SPDX-License-Identifier: Apache-2.0
// segments -- switches the segment table of each axis on and off.
//
// The positions of the table count from the position that homing finds, whatever home_offset is.
// Before homing there is nothing to correct, and homing begins without the table. When the table is
// switched, the hardware moves position and target alike, and only while the axis is at rest, so
// that a planned motion ends at its target. The hardware needs less time for this than it takes to
// receive a request.
#include "bus/segments.h"

#include <stdbool.h>

#include "axis/axis.h"
#include "core/hardware.h"
#include "axis/homing.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"

#define OFF 0
#define LINEAR 2             // values of the parameter
#define POINTS 12u           // of a body
#define LARGEST 0x7FFFFF     // of a point
#define READ_BACK_POLLS 16u  // until a point has been read back

static struct table {
    uint16_t loaded;  // points
    uint8_t use;      // value of the parameter with which it was switched on; else OFF
} tables[HARDWARE_AXES];

static unsigned axes;
static unsigned turn;  // axis that was served last

static uint8_t required_use(unsigned n) {
    return (uint8_t)parameters_get(n, BUS_PARAMETER_SEGMENTS);
}

static uint8_t in_force(unsigned n) {
    return feedback_read(n, FEEDBACK_SEGMENT_STATE) & FEEDBACK_SEGMENT_STATE_IN_FORCE_MASK
               ? tables[n].use
               : OFF;
}

// ok, or why the required use is not in force.
static uint8_t reason(unsigned n) {
    if (required_use(n) == in_force(n)) return BUS_CAUSE_OK;
    if (tables[n].loaded <= parameters_get(n, BUS_PARAMETER_SEGMENT_COUNT))
        return BUS_CAUSE_NO_SEGMENTS;
    return axis_homed(n) ? BUS_CAUSE_BUSY : BUS_CAUSE_NOT_HOMED;
}

static void put_in_force(unsigned n, uint8_t use) {
    int64_t first =
        parameters_get(n, BUS_PARAMETER_SEGMENT_FIRST) + (int64_t)homing_zero(n) * 65536;
    tables[n].use = use;
    feedback_write_wide(n, FEEDBACK_SEGMENT_ORIGIN, (uint64_t)first);
    feedback_write_wide(n, FEEDBACK_SEGMENT_LENGTH,
                        (uint64_t)parameters_get(n, BUS_PARAMETER_SEGMENT_LENGTH));
    feedback_write(n, FEEDBACK_SEGMENT_USE,
                   FIELD_PUT(FEEDBACK_SEGMENT_USE_ENABLE, 1) |
                       FIELD_PUT(FEEDBACK_SEGMENT_USE_LINEAR, use == LINEAR) |
                       FIELD_PUT(FEEDBACK_SEGMENT_USE_SEGMENTS,
                                 parameters_get(n, BUS_PARAMETER_SEGMENT_COUNT)));
}

void segments_start(unsigned served_axes) {
    axes = served_axes;
    turn = 0;
    for (unsigned n = 0; n < axes; n++) {
        tables[n].loaded = 0;
        tables[n].use = OFF;
        feedback_write(n, FEEDBACK_SEGMENT_USE, 0);
    }
}

static bool unused(unsigned n) { return required_use(n) == OFF && tables[n].use == OFF; }

bool segments_idle(void) {
    for (unsigned n = 0; n < axes; n++)
        if (!unused(n) && required_use(n) != in_force(n)) return false;
    return true;
}

// Between two different uses the table is off for one turn.
void segments_work(void) {
    turn = turn + 1 < axes ? turn + 1 : 0;
    if (unused(turn)) return;  // the usual case
    if (axis_ended(turn) == BUS_CAUSE_RUNNING) return;
    uint8_t now = in_force(turn), use = axis_homed(turn) ? required_use(turn) : OFF;
    if (now == use) return;
    if (now != OFF) {
        feedback_write(turn, FEEDBACK_SEGMENT_USE, 0);
        tables[turn].use = OFF;
    } else if (reason(turn) == BUS_CAUSE_BUSY) {
        put_in_force(turn, use);
    }
}

static uint8_t segments(unsigned n) {
    bus_reply_field(BUS_SEGMENTS_REPLY_LOADED, tables[n].loaded, 2);
    bus_reply_field(BUS_SEGMENTS_REPLY_IN_FORCE, in_force(n), 1);
    bus_reply_field(BUS_SEGMENTS_REPLY_REASON, reason(n), 1);
    return BUS_CAUSE_OK;
}

static uint8_t set_segments(unsigned n) {
    uint32_t border = (uint32_t)bus_request_field(BUS_SET_SEGMENTS_REQUEST_BORDER, 1),
             points = (uint32_t)bus_request_field(BUS_SET_SEGMENTS_REQUEST_POINTS, 1);
    uint32_t most = FIELD_GET(axis_read(n, AXIS_BUILT), AXIS_BUILT_SEGMENTS);
    if (most == 0) return BUS_CAUSE_NOT_BUILT;
    if (required_use(n) != OFF || in_force(n) != OFF) return BUS_CAUSE_SEGMENTS_IN_USE;
    if ((border && border != tables[n].loaded) || points > POINTS || border + points > most + 1)
        return BUS_CAUSE_OUT_OF_RANGE;
    tables[n].loaded = (uint16_t)border;
    for (uint32_t i = 0; i < points; i++) {
        int32_t point = (int32_t)bus_request_field(BUS_SET_SEGMENTS_REQUEST_POINT_0 + 4 * i, 4);
        if (point > LARGEST || point < -LARGEST) return BUS_CAUSE_OUT_OF_RANGE;
        feedback_write(n, FEEDBACK_SEGMENT_POINT,
                       FIELD_PUT(FEEDBACK_SEGMENT_POINT, point) |
                           FIELD_PUT(FEEDBACK_SEGMENT_POINT_BORDER, border + i));
    }
    tables[n].loaded = (uint16_t)(border + points);
    return BUS_CAUSE_OK;
}

// Reads the points back from the hardware, which corrects with them.
static uint8_t get_segments(unsigned n) {
    uint32_t border = (uint32_t)bus_request_field(BUS_GET_SEGMENTS_REQUEST_BORDER, 1);
    for (uint32_t i = 0; i < POINTS; i++) {
        feedback_write(n, FEEDBACK_SEGMENT_READ, border + i);
        for (uint32_t poll = 0;
             poll < READ_BACK_POLLS &&
             !(feedback_read(n, FEEDBACK_SEGMENT_STATE) & FEEDBACK_SEGMENT_STATE_KNOWN_MASK);
             poll++) {}
        bus_reply_field(BUS_GET_SEGMENTS_REPLY_POINT_0 + 4 * i,
                        feedback_read(n, FEEDBACK_SEGMENT_STORED), 4);
    }
    return BUS_CAUSE_OK;
}

uint8_t segments_operation(uint8_t operation) {
    unsigned axis = (unsigned)bus_request_field(BUS_REQUEST_HEAD, 1);
    switch (operation) {
    case BUS_OPERATION_SEGMENTS: return segments(axis);
    case BUS_OPERATION_SET_SEGMENTS: return set_segments(axis);
    case BUS_OPERATION_GET_SEGMENTS: return get_segments(axis);
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

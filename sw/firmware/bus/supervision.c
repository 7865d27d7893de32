// SPDX-License-Identifier: Apache-2.0
// supervision -- serves a host that reaches the registers of the node.
#include "bus/supervision.h"

#include <stdint.h>

#include "axis/axis.h"
#include "axis/motion.h"
#include "axis/parameters.h"
#include "bus/bus.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"
#include "planner/planner.h"

// Values of stream_state.mode and stream_state.ended
enum { OFF, PREPARED, STREAMING, EXTRAPOLATING, ENDED };
enum { NOT_ENDED, RELEASED, STOPPED, LATE, FAULT };

enum follows { NOT, BEGINS, FOLLOWS };  // set-points

static struct supervised {
    enum follows follows;
    uint8_t refusal;  // bus_cause of the last request
    uint32_t shown;   // in the register
    uint32_t position_low;
} supervised[HARDWARE_AXES];

static unsigned axis_count;
static uint32_t requested;  // axis_requests, as it was served last

static uint32_t bits_of(unsigned n) {
    return 1u << (n + NODE_AXIS_REQUESTS_ENABLE_SHIFT) | 1u << (n + NODE_AXIS_REQUESTS_HOME_SHIFT) |
           1u << (n + NODE_AXIS_REQUESTS_STREAM_SHIFT) |
           1u << (n + NODE_AXIS_REQUESTS_RESET_FAULTS_SHIFT);
}

static void allow(unsigned n, bool on) {
    const uint32_t axes = node_read(NODE_STREAM_AXES);
    node_write(NODE_STREAM_AXES, on ? axes | 1u << n : axes & ~(1u << n));
}

static uint32_t limit(uint64_t value, unsigned shift, uint32_t most) {
    const uint64_t rounded = ((value + (value >> BUS_STREAM_TOLERANCE)) >> shift) + 1;
    return rounded < most ? (uint32_t)rounded : most;
}

static uint8_t begin(unsigned n) {
    const struct planner_limits limits = parameters_limits(n, BUS_PARAMETER_VELOCITY);
    uint32_t ticks;
    if (!hardware_built(n, AXIS_BUILT_SET_POINTS_MASK)) return BUS_CAUSE_NOT_BUILT;
    if (parameters_get(n, BUS_PARAMETER_FEED_OVERRIDE) !=
        parameters_default(BUS_PARAMETER_FEED_OVERRIDE))
        return BUS_CAUSE_OUT_OF_RANGE;
    const uint8_t cause = axis_prepare(n, axis_read_position(n, AXIS_TARGET), &ticks);
    if (cause != BUS_CAUSE_OK) return cause;
    axis_write(n, AXIS_STREAM_VELOCITY_LIMIT,
               limit(limits.velocity, 16, AXIS_STREAM_VELOCITY_LIMIT_MASK));
    axis_write(n, AXIS_STREAM_ACCELERATION_LIMIT, limit(limits.acceleration, 8, UINT32_MAX));
    axis_write_wide(n, AXIS_STREAM_TRAVEL_LOW,
                    (uint64_t)parameters_get(n, BUS_PARAMETER_TRAVEL_LOW));
    axis_write_wide(n, AXIS_STREAM_TRAVEL_HIGH,
                    (uint64_t)parameters_get(n, BUS_PARAMETER_TRAVEL_HIGH));
    motion_follow(n);
    allow(n, true);
    supervised[n].follows = BEGINS;
    return BUS_CAUSE_OK;
}

// The stream of an axis, as the hardware plays it.
static void follow(unsigned n) {
    struct supervised* s = &supervised[n];
    const uint32_t stream = axis_read(n, AXIS_STREAM_STATE),
                   mode = FIELD_GET(stream, AXIS_STREAM_STATE_MODE);
    const uint8_t state = axis_state(n);
    const bool open = state == BUS_STATE_PREPARED || state == BUS_STATE_MOVING;
    if (open && s->follows == BEGINS && mode == OFF) return;
    s->follows = FOLLOWS;
    if (open && mode != OFF && mode != ENDED) {
        if (mode != PREPARED && state == BUS_STATE_PREPARED) axis_started(axis_count, 1u << n);
        return;
    }
    // The stream has ended, or a fault, a stop or the bus has ended the motion. After a release at
    // rest the motion settles.
    s->follows = NOT;
    allow(n, false);
    if (!open) return;
    switch (FIELD_GET(stream, AXIS_STREAM_STATE_ENDED)) {
    case RELEASED:
        if (state == BUS_STATE_PREPARED) axis_started(axis_count, 1u << n);
        break;
    case LATE: axis_break_off(n, BUS_CAUSE_SET_POINT_LATE); break;
    case FAULT: axis_break_off(n, BUS_CAUSE_ENDED_BY_FAULT); break;
    default: axis_break_off(n, BUS_CAUSE_STOPPED); break;
    }
}

static void keep(unsigned n, uint8_t cause) {
    if (cause != BUS_CAUSE_OK) supervised[n].refusal = cause;
}

// What has changed in the requests for an axis. A request that is refused must fall and rise again.
static void serve(unsigned n, uint32_t requests) {
    const uint32_t rose = requests & ~requested, fell = requested & ~requests;
    if (!((rose | fell) & bits_of(n))) return;
    supervised[n].refusal = BUS_CAUSE_OK;
    if (rose >> n & 1u << NODE_AXIS_REQUESTS_RESET_FAULTS_SHIFT) keep(n, axis_reset_faults(n));
    if (fell >> n & 1u << NODE_AXIS_REQUESTS_STREAM_SHIFT) allow(n, false);
    if (fell >> n & 1u << NODE_AXIS_REQUESTS_ENABLE_SHIFT) keep(n, axis_enable(n, false));
    if (rose >> n & 1u << NODE_AXIS_REQUESTS_ENABLE_SHIFT) keep(n, axis_enable(n, true));
    if (fell >> n & 1u << NODE_AXIS_REQUESTS_HOME_SHIFT && axis_state(n) == BUS_STATE_HOMING)
        keep(n, axis_stop(n));
    if (rose >> n & 1u << NODE_AXIS_REQUESTS_HOME_SHIFT) keep(n, axis_home(n));
    if (rose >> n & 1u << NODE_AXIS_REQUESTS_STREAM_SHIFT) keep(n, begin(n));
}

static void show(unsigned n) {
    const uint32_t now = (uint32_t)axis_state(n) << AXIS_SUPERVISION_STATE_SHIFT |
                         (axis_homed(n) ? AXIS_SUPERVISION_HOMED_MASK : 0) |
                         (uint32_t)axis_ended(n) << AXIS_SUPERVISION_ENDED_SHIFT |
                         (uint32_t)supervised[n].refusal << AXIS_SUPERVISION_REFUSAL_SHIFT;
    if (now != supervised[n].shown) axis_write(n, AXIS_SUPERVISION, now);
    supervised[n].shown = now;
}

void supervision_start(unsigned axes) {
    axis_count = axes;
    requested = 0;
    if (axes == 0) return;
    node_write(NODE_LATE_LIMIT, BUS_STREAM_LATEST);
    node_write(NODE_STREAM_AXES, 0);
    for (unsigned n = 0; n < axes; n++) supervised[n] = (struct supervised){.shown = UINT32_MAX};
}

void supervision_work(void) {
    const uint32_t requests = node_read(NODE_AXIS_REQUESTS);
    for (unsigned n = 0; n < axis_count; n++) {
        serve(n, requests);
        if (supervised[n].follows != NOT) follow(n);
        show(n);
    }
    requested = requests;
}

static bool backlash_register(uint32_t address) {
    const uint32_t offset = address - FEEDBACK_BASE, n = offset / FEEDBACK_STRIDE,
                   of_axis = offset % FEEDBACK_STRIDE;
    return n < axis_count && hardware_built(n, AXIS_BUILT_BACKLASH_MASK) &&
           (of_axis == FEEDBACK_BACKLASH || of_axis == FEEDBACK_BACKLASH_RATE);
}

// A register that a host writes over the bus. The low word of a position waits here for the high
// one, since the firmware writes other wide registers in between.
uint8_t supervision_operation(uint8_t operation) {
    if (operation != BUS_OPERATION_WRITE_REGISTER) return BUS_CAUSE_NOT_BUILT;
    const uint32_t address = (uint32_t)bus_request_field(BUS_WRITE_REGISTER_REQUEST_ADDRESS, 2),
                   value = (uint32_t)bus_request_field(BUS_WRITE_REGISTER_REQUEST_VALUE, 4),
                   n = (address - AXIS_BASE) / AXIS_STRIDE;
    switch (address) {
    case NODE_BASE + NODE_SET_POINT_TICK:
    case NODE_BASE + NODE_SET_POINT_COMMIT:
    case NODE_BASE + NODE_LATE_LIMIT:
    case NODE_BASE + NODE_AXIS_REQUESTS: register_write(address, value); return BUS_CAUSE_OK;
    default: break;
    }
    if (backlash_register(address)) {
        register_write(address, value);
        return BUS_CAUSE_OK;
    }
    if (address < AXIS_BASE || n >= axis_count || !hardware_built(n, AXIS_BUILT_SET_POINTS_MASK))
        return BUS_CAUSE_NOT_BUILT;
    switch (address - AXIS_BASE - n * AXIS_STRIDE) {
    case AXIS_SET_POINT_POSITION_LOW: supervised[n].position_low = value; return BUS_CAUSE_OK;
    case AXIS_SET_POINT_POSITION_HIGH:
        axis_write_wide(n, AXIS_SET_POINT_POSITION,
                        (uint64_t)value << 32 | supervised[n].position_low);
        return BUS_CAUSE_OK;
    case AXIS_SET_POINT_VELOCITY:
        axis_write(n, AXIS_SET_POINT_VELOCITY, value);
        return BUS_CAUSE_OK;
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

bool supervision_idle(void) {
    for (unsigned n = 0; n < axis_count; n++)
        if (supervised[n].follows != NOT) return false;
    return true;
}

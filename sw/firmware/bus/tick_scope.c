// SPDX-License-Identifier: Apache-2.0
// tick_scope -- records signals of axes at each servo tick with the recorder of the node, and adds
// a waveform to the commands of an axis meanwhile, to measure its response.
#include "bus/tick_scope.h"

#include "axis/axis.h"
#include "bus/bus.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"

#define WORDS 14u     // of a reply
#define VALUES 24u    // of a request
#define SETTINGS 24u  // bytes of a request to record, which are those of six registers

static struct {
    uint16_t read;  // words of the recording
    uint8_t axis;   // that is excited
    uint8_t count;  // of its commands: one that begins no motion ends the excitation
    bool excites;
} ticks;

static bool built(void) { return node_read(NODE_BUILD) & NODE_BUILD_SCOPE_MASK; }

void tick_scope_start(unsigned axes) {
    (void)axes;
    ticks.excites = false;
    node_write(NODE_EXCITATION, 0);
}

bool tick_scope_idle(void) { return !ticks.excites; }

static bool drive_is_on(unsigned n) { return axis_read(n, AXIS_STATE) & AXIS_STATE_ENABLED_MASK; }

void tick_scope_work(void) {
    unsigned n = ticks.axis;
    uint8_t count = axis_command_count(n);
    if (axis_state(n) == BUS_STATE_MOVING) ticks.count = count;
    if (!ticks.excites || (count == ticks.count && drive_is_on(n))) return;
    ticks.excites = false;
    node_write(NODE_EXCITATION, 0);
}

static uint8_t record(void) {
    if (!built()) return BUS_CAUSE_NOT_BUILT;
    for (uint32_t i = 0; i < SETTINGS; i += 4)
        node_write(NODE_SCOPE + i, (uint32_t)bus_request_field(BUS_REQUEST_HEAD + i, 4));
    ticks.read = 0;
    return BUS_CAUSE_OK;
}

static uint8_t read_words(void) {
    uint32_t state = node_read(NODE_SCOPE_STATE);
    uint32_t count = FIELD_GET(state, NODE_SCOPE_STATE_AVAILABLE);
    if (count > WORDS) count = WORDS;
    bus_reply_field(BUS_READ_TICKS_REPLY_STATE, FIELD_GET(state, NODE_SCOPE_STATE_PHASE), 1);
    bus_reply_field(BUS_READ_TICKS_REPLY_FIRST, ticks.read, 2);
    bus_reply_field(BUS_READ_TICKS_REPLY_COUNT, count, 1);
    for (uint32_t i = 0; i < WORDS; i++)
        bus_reply_field(BUS_READ_TICKS_REPLY_WORD_0 + 4 * i,
                        i < count ? node_read(NODE_SCOPE_WORD) : 0, 4);
    ticks.read = (uint16_t)(ticks.read + count);
    return BUS_CAUSE_OK;
}

static uint8_t load(uint32_t first) {
    if (!built()) return BUS_CAUSE_NOT_BUILT;
    for (uint32_t i = 0; i < VALUES && first + i < BUS_WAVEFORM_LONGEST; i++) {
        uint32_t value =
            (uint32_t)bus_request_field(BUS_LOAD_EXCITATION_REQUEST_VALUE_0 + 2 * i, 2);
        node_write(NODE_EXCITATION_VALUE, FIELD_PUT(NODE_EXCITATION_VALUE, value) |
                                              FIELD_PUT(NODE_EXCITATION_VALUE_AT, first + i));
    }
    return BUS_CAUSE_OK;
}

static uint8_t excite(unsigned n, uint32_t period) {
    uint8_t state = axis_state(n);
    if (!built()) return BUS_CAUSE_NOT_BUILT;
    if (period > BUS_WAVEFORM_LONGEST) return BUS_CAUSE_OUT_OF_RANGE;
    if (period && !drive_is_on(n)) return BUS_CAUSE_NOT_ENABLED;
    if (state == BUS_STATE_HOMING || state == BUS_STATE_EXCITED ||
        (ticks.excites && n != ticks.axis))
        return BUS_CAUSE_BUSY;
    ticks.axis = (uint8_t)n;
    ticks.count = axis_command_count(n);
    ticks.excites = period != 0;
    node_write(NODE_EXCITATION,
               FIELD_PUT(NODE_EXCITATION_AXIS, n) | FIELD_PUT(NODE_EXCITATION_PERIOD, period) |
                   FIELD_PUT(NODE_EXCITATION_LIMIT, axis_read(n, AXIS_OUTPUT_LIMIT)));
    return BUS_CAUSE_OK;
}

uint8_t tick_scope_operation(uint8_t operation) {
    unsigned axis = (unsigned)bus_request_field(BUS_REQUEST_HEAD, 1);
    switch (operation) {
    case BUS_OPERATION_RECORD_TICKS: return record();
    case BUS_OPERATION_READ_TICKS: return read_words();
    case BUS_OPERATION_LOAD_EXCITATION:
        return load((uint32_t)bus_request_field(BUS_LOAD_EXCITATION_REQUEST_FIRST, 2));
    case BUS_OPERATION_EXCITE:
        return excite(axis, (uint32_t)bus_request_field(BUS_EXCITE_REQUEST_PERIOD, 2));
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

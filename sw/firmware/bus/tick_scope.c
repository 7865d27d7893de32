// SPDX-License-Identifier: Apache-2.0
// tick_scope -- records signals of one axis at each servo tick with the recorder of the node, and
// adds a waveform to the commands of an axis, to measure its response.
#include "bus/tick_scope.h"

#include "axis/axis.h"
#include "bus/bus.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"

#define WORDS 14u   // of a reply
#define VALUES 24u  // of a request
#define BLOCK 256u  // words, LSB of NODE_BUILD_SCOPE
#define SIGNALS ((1u << NODE_SCOPE_SIGNALS_WIDTH) - 1u)

static struct {
    uint32_t words;  // of the recording
    uint32_t read;   // of these
    uint8_t axis;    // that is excited
    uint8_t count;   // of its commands: another one ends the excitation
    bool excites;
} ticks;

static uint32_t memory_words(void) {
    return FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_SCOPE) * BLOCK;
}

void tick_scope_start(unsigned axes) {
    (void)axes;
    ticks.words = 0;
    ticks.excites = false;
    node_write(NODE_EXCITATION, 0);
}

bool tick_scope_idle(void) { return !ticks.excites; }

static bool drive_is_on(unsigned n) { return axis_read(n, AXIS_STATE) & AXIS_STATE_ENABLED_MASK; }

void tick_scope_work(void) {
    unsigned n = ticks.axis;
    if (!ticks.excites || (axis_command_count(n) == ticks.count && drive_is_on(n))) return;
    ticks.excites = false;
    node_write(NODE_EXCITATION, 0);
}

static uint8_t record(unsigned n, uint32_t signals, uint32_t every, uint32_t length) {
    uint32_t each = 0;
    for (uint32_t left = signals; left; left &= left - 1u) each++;
    if (memory_words() == 0) return BUS_CAUSE_NOT_BUILT;
    if (each == 0 || signals > SIGNALS || length == 0 || length > memory_words() / each)
        return BUS_CAUSE_OUT_OF_RANGE;
    node_write(NODE_SCOPE, FIELD_PUT(NODE_SCOPE_AXIS, n) | FIELD_PUT(NODE_SCOPE_SIGNALS, signals));
    node_write(NODE_SCOPE_SAMPLES, FIELD_PUT(NODE_SCOPE_SAMPLES_LENGTH, length) |
                                       FIELD_PUT(NODE_SCOPE_SAMPLES_EVERY, every));
    node_write(NODE_SCOPE_STATE, NODE_SCOPE_STATE_START_MASK);
    ticks.words = length * each;
    ticks.read = 0;
    return BUS_CAUSE_OK;
}

static uint8_t read_words(void) {
    uint32_t state = node_read(NODE_SCOPE_STATE);
    bool full = ticks.words != 0 && (state & NODE_SCOPE_STATE_FULL_MASK);
    bus_reply_field(BUS_READ_TICKS_REPLY_STATE,
                    full                                      ? BUS_SCOPE_STATE_FULL
                    : state & NODE_SCOPE_STATE_RECORDING_MASK ? BUS_SCOPE_STATE_RECORDING
                                                              : BUS_SCOPE_STATE_EMPTY,
                    1);
    bus_reply_field(BUS_READ_TICKS_REPLY_FIRST, ticks.read, 2);
    for (uint32_t i = 0; i < WORDS; i++) {
        bool left = full && ticks.read < ticks.words;
        bus_reply_field(BUS_READ_TICKS_REPLY_WORD_0 + 4 * i, left ? node_read(NODE_SCOPE_WORD) : 0,
                        4);
        ticks.read += left;
    }
    return BUS_CAUSE_OK;
}

static uint8_t load(uint32_t first) {
    if (memory_words() == 0) return BUS_CAUSE_NOT_BUILT;
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
    if (memory_words() == 0) return BUS_CAUSE_NOT_BUILT;
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
    case BUS_OPERATION_RECORD_TICKS:
        return record(axis, (uint32_t)bus_request_field(BUS_RECORD_TICKS_REQUEST_SIGNALS, 1),
                      (uint32_t)bus_request_field(BUS_RECORD_TICKS_REQUEST_EVERY, 2),
                      (uint32_t)bus_request_field(BUS_RECORD_TICKS_REQUEST_SAMPLES, 2));
    case BUS_OPERATION_READ_TICKS: return read_words();
    case BUS_OPERATION_LOAD_EXCITATION:
        return load((uint32_t)bus_request_field(BUS_LOAD_EXCITATION_REQUEST_FIRST, 2));
    case BUS_OPERATION_EXCITE:
        return excite(axis, (uint32_t)bus_request_field(BUS_EXCITE_REQUEST_PERIOD, 2));
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

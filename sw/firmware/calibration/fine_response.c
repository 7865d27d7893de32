// SPDX-License-Identifier: Apache-2.0
// fine_response -- records how the fine stage of an axis responds to steps of its DAC, in open
// loop.
//
// The axis is in the state `excited` from the first step on. Whatever ends this state, the
// registers of the DAC then get back what the parameters say.
#include "calibration/fine_response.h"

#include "axis/axis.h"
#include "axis/parameters.h"
#include "bus/bus.h"
#include "calibration/calibration_driver.h"
#include "calibration/calibration_types.h"
#include "core/hardware.h"
#include "made/bus_protocol.h"

#define WORDS 14u     // of a reply
#define DAC_OUTPUT 2  // value of the parameter drive: there is no fine stage
#define BUILT (AXIS_BUILT_FINE_STAGE_MASK | AXIS_BUILT_RECORDER_MASK)

static struct {
    uint8_t state;  // bus_scope_state; empty: no axis is in open loop because of this part
    uint8_t axis;
    uint8_t count;   // of its commands: another one ends the open loop
    uint16_t every;  // samples
    uint16_t read;   // words
    uint16_t trim;   // register value with the offset of the step
} response;

void fine_response_start(unsigned axes) {
    (void)axes;
    response.state = BUS_SCOPE_STATE_EMPTY;
}

bool fine_response_idle(void) { return response.state == BUS_SCOPE_STATE_EMPTY; }

static void set_again(unsigned n, uint8_t id) { parameters_set(n, id, parameters_get(n, id)); }

// First the recorder and then the DAC, so that the first phases are from before the step.
static void begin(unsigned n) {
    uint32_t half_period = actuator_read(n, ACTUATOR_DAC) & ACTUATOR_DAC_HALF_PERIOD_MASK;
    feedback_write(n, FEEDBACK_RECORDER,
                   FIELD_PUT(FEEDBACK_RECORDER_DECIMATION, response.every) |
                       FIELD_PUT(FEEDBACK_RECORDER_PHASES, 1));
    actuator_write(n, ACTUATOR_DAC, half_period);  // refresh 0: one word after the other
    feedback_write(n, FEEDBACK_STROBES, FEEDBACK_STROBES_RECORD_MASK);
    actuator_write(n, ACTUATOR_DAC_TRIM, response.trim);
    response.state = BUS_SCOPE_STATE_RECORDING;
}

static bool opened(unsigned n) {
    return axis_state(n) == BUS_STATE_EXCITED && axis_command_count(n) == response.count;
}

void fine_response_work(void) {
    unsigned n = response.axis;
    if (fine_response_idle()) return;
    if (!opened(n)) {
        set_again(n, BUS_PARAMETER_DAC_CLOCK);
        set_again(n, BUS_PARAMETER_DAC_TRIM);
        response.state = BUS_SCOPE_STATE_EMPTY;
        return;
    }
    bool eased = axis_ease(n), middle = actuator_read(n, ACTUATOR_FINE_COMMAND) == 0;
    if (response.state == BUS_SCOPE_STATE_WAITING) {
        if (eased && middle && calibration_driver_idle(n)) begin(n);  // it may read its last burst
    } else if (feedback_read(n, FEEDBACK_RECORDER_STATE) & FEEDBACK_RECORDER_STATE_FULL_MASK) {
        response.state = BUS_SCOPE_STATE_FULL;
    }
}

static uint8_t step(unsigned n, int16_t offset, uint16_t every) {
    int32_t trim = (int32_t)parameters_get(n, BUS_PARAMETER_DAC_TRIM) + offset;
    if ((axis_read(n, AXIS_BUILT) & BUILT) != BUILT) return BUS_CAUSE_NOT_BUILT;
    if (every == 0 || trim != (int16_t)trim || parameters_get(n, BUS_PARAMETER_DRIVE) == DAC_OUTPUT)
        return BUS_CAUSE_OUT_OF_RANGE;
    if (fine_response_idle()) {
        uint8_t cause = axis_excite(n, true);
        if (cause != BUS_CAUSE_OK) return cause;
        response.count = axis_command_count(n);
    } else if (n != response.axis || !opened(n)) {
        return BUS_CAUSE_BUSY;
    }
    response.axis = (uint8_t)n;
    response.every = every;
    response.trim = (uint16_t)trim;
    response.read = 0;
    response.state = BUS_SCOPE_STATE_WAITING;
    return BUS_CAUSE_OK;
}

static uint8_t read_words(unsigned n) {
    bool full = response.state == BUS_SCOPE_STATE_FULL;
    if (fine_response_idle() || n != response.axis) return BUS_CAUSE_NOT_PREPARED;
    bus_reply_field(BUS_READ_FINE_REPLY_STATE, response.state, 1);
    bus_reply_field(
        BUS_READ_FINE_REPLY_INVALID,
        FIELD_GET(feedback_read(n, FEEDBACK_RECORDER_STATE), FEEDBACK_RECORDER_STATE_INVALID), 1);
    bus_reply_field(BUS_READ_FINE_REPLY_FIRST, response.read, 2);
    for (uint32_t i = 0; i < WORDS; i++) {
        bool left = full && response.read < CALIBRATION_BURST;
        bus_reply_field(BUS_READ_FINE_REPLY_WORD_0 + 4 * i,
                        left ? feedback_read(n, FEEDBACK_RECORDER_WORD) : 0, 4);
        response.read = (uint16_t)(response.read + left);
    }
    return BUS_CAUSE_OK;
}

uint8_t fine_response_operation(uint8_t operation) {
    unsigned axis = (unsigned)bus_request_field(BUS_REQUEST_HEAD, 1);
    switch (operation) {
    case BUS_OPERATION_STEP_FINE:
        return step(axis, (int16_t)bus_request_field(BUS_STEP_FINE_REQUEST_OFFSET, 2),
                    (uint16_t)bus_request_field(BUS_STEP_FINE_REQUEST_EVERY, 2));
    case BUS_OPERATION_READ_FINE: return read_words(axis);
    default: return BUS_CAUSE_NOT_BUILT;
    }
}

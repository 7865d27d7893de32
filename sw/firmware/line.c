// SPDX-License-Identifier: Apache-2.0
// line -- frames in, requests done, replies out.
//
// The hardware passes only words of frames for this node and marks the last word of a right one; a frame that it does not
// mark is forgotten when the next command byte comes. Causes are looked for in this order: wrong_map, unknown_operation,
// wrong_length, no_such_axis, out_of_range of a value, then what the axis says (faulted, not_enabled, busy, not_homed,
// out_of_travel).
#include "line.h"

#include "axis.h"
#include "grating.h"
#include "hardware.h"
#include "homing.h"
#include "line_protocol.h"
#include "parameters.h"
#include "planner.h"
#include "scope.h"

#define WAY_MASK 0x30u
#define WAY_TO_NODE 0x20u
#define WAY_FROM_NODE 0x10u
#define READY 0x40u
#define CRC_BYTES 4u
#define WORDS_A_POLL 8u                 // then the axes have their turn

#define OPERATION_LENGTH(name, code, request, reply) [code] = request,
static const uint8_t request_length[] = {LINE_OPERATIONS(OPERATION_LENGTH)};

static unsigned axes;
static bool wrong_map;
static bool receiving;
static uint8_t received;                                        // bytes in request
static uint8_t request[1 + LINE_LONGEST_BODY + CRC_BYTES];      // length, body, CRC-32
static uint8_t reply[1 + LINE_LONGEST_BODY + CRC_BYTES];
static uint8_t *const asked = &request[1], *const answer = &reply[1];
static bool answered;                                           // there was a request, with this CRC-32:
static uint32_t answered_crc;
static uint32_t repeated, refused;

static uint64_t get(const uint8_t *from, unsigned bytes)
{
    uint64_t value = 0;
    while (bytes--) value = value << 8 | from[bytes];
    return value;
}

static void put(uint32_t at, uint64_t value, unsigned bytes)
{
    uint8_t *to = &answer[at];
    while (bytes--) {
        *to++ = (uint8_t)value;
        value >>= 8;
    }
}

static uint8_t identify(void)
{
    put(LINE_IDENTIFY_REPLY_MAP_CRC, node_read(NODE_MAP_CRC), 4);
    put(LINE_IDENTIFY_REPLY_PROTOCOL_CRC, PROTOCOL_CRC, 4);
    put(LINE_IDENTIFY_REPLY_VERSION, LINE_VERSION, 2);
    put(LINE_IDENTIFY_REPLY_ADDRESS, FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS), 1);
    put(LINE_IDENTIFY_REPLY_AXES, axes, 1);
    put(LINE_IDENTIFY_REPLY_CLK_HZ, node_read(NODE_CLK_HZ), 4);
    put(LINE_IDENTIFY_REPLY_TICK_HZ, PLANNER_TICK_HZ, 4);
    put(LINE_IDENTIFY_REPLY_SAMPLE_HZ, parameters_sample_hz(), 4);
    reply[0] = LINE_IDENTIFY_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t status(unsigned axis)
{
    int64_t position = axis_read_position(axis, AXIS_POSITION);
    axis_poll(axis);
    put(LINE_STATUS_REPLY_STATE, axis_state(axis), 1);
    put(LINE_STATUS_REPLY_ENDED, axis_ended(axis), 1);
    put(LINE_STATUS_REPLY_FLAGS, axis_flags(axis), 1);
    put(LINE_STATUS_REPLY_ENCODER_EVENTS, axis_read(axis, AXIS_ENCODER_EVENTS), 1);
    put(LINE_STATUS_REPLY_FAULTS, axis_read(axis, AXIS_FAULTS), 2);
    put(LINE_STATUS_REPLY_FIRST_FAULT, axis_read(axis, AXIS_FIRST_FAULT), 2);
    put(LINE_STATUS_REPLY_POSITION, (uint64_t)position, 8);
    put(LINE_STATUS_REPLY_TARGET, (uint64_t)axis_read_position(axis, AXIS_TARGET), 8);
    put(LINE_STATUS_REPLY_VELOCITY, axis_read(axis, AXIS_VELOCITY), 4);
    put(LINE_STATUS_REPLY_COMMAND, axis_read(axis, AXIS_COMMAND), 2);
    put(LINE_STATUS_REPLY_COUNTS, (uint64_t)((position * parameters_get(axis, LINE_PARAMETER_COUNTS_PER_PERIOD)) >> 16), 8);
    reply[0] = LINE_STATUS_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t enable(unsigned axis)
{
    uint8_t on = asked[LINE_ENABLE_REQUEST_ON];
    return on > 1 ? LINE_CAUSE_OUT_OF_RANGE : axis_enable(axis, on);
}

typedef uint8_t motion_request(unsigned n, int64_t target, uint32_t *duration_ticks);

static uint8_t motion(unsigned axis, motion_request *begin)     // move and prepare have the same bodies
{
    uint32_t ticks = 0;
    uint8_t cause = begin(axis, (int64_t)get(&asked[LINE_MOVE_REQUEST_TARGET], 8), &ticks);
    put(LINE_MOVE_REPLY_DURATION_TICKS, ticks, 4);
    reply[0] = LINE_MOVE_REPLY_LENGTH;
    return cause;
}

static uint8_t get_parameter(unsigned axis)
{
    uint8_t id = asked[LINE_GET_PARAMETER_REQUEST_PARAMETER];
    if (parameters_check(id, 0) == LINE_CAUSE_UNKNOWN_PARAMETER) return LINE_CAUSE_UNKNOWN_PARAMETER;
    put(LINE_GET_PARAMETER_REPLY_VALUE, (uint64_t)parameters_get(axis, id), 8);
    reply[0] = LINE_GET_PARAMETER_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t set_parameter(unsigned axis)
{
    return axis_set_parameter(axis, asked[LINE_SET_PARAMETER_REQUEST_PARAMETER],
                              (int64_t)get(&asked[LINE_SET_PARAMETER_REQUEST_VALUE], 8));
}

static uint8_t counters(void)
{
    put(LINE_COUNTERS_REPLY_FRAMES_GOOD, line_read(LINE_FRAMES_GOOD), 4);
    put(LINE_COUNTERS_REPLY_FRAMES_BAD, line_read(LINE_FRAMES_BAD), 4);
    put(LINE_COUNTERS_REPLY_FRAMING_ERRORS, line_read(LINE_FRAMING_ERRORS), 4);
    put(LINE_COUNTERS_REPLY_START_GLITCHES, line_read(LINE_START_GLITCHES), 4);
    put(LINE_COUNTERS_REPLY_OVERRUNS, line_read(LINE_OVERRUNS), 4);
    put(LINE_COUNTERS_REPLY_REPEATED, repeated, 4);
    put(LINE_COUNTERS_REPLY_REFUSED, refused, 4);
    reply[0] = LINE_COUNTERS_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t encoder(unsigned axis)
{
    uint32_t sample = axis_read(axis, AXIS_SAMPLE), phase = axis_read(axis, AXIS_PHASE);
    put(LINE_ENCODER_REPLY_SIN, FIELD_GET(sample, AXIS_SAMPLE_SIN), 2);
    put(LINE_ENCODER_REPLY_COS, FIELD_GET(sample, AXIS_SAMPLE_COS), 2);
    put(LINE_ENCODER_REPLY_PHASE, FIELD_GET(phase, AXIS_PHASE_PHASE), 2);
    put(LINE_ENCODER_REPLY_AMPLITUDE, FIELD_GET(phase, AXIS_PHASE_AMPLITUDE), 2);
    put(LINE_ENCODER_REPLY_QUADRATURE_COUNT, axis_read(axis, AXIS_QUADRATURE_COUNT), 4);
    put(LINE_ENCODER_REPLY_REJECTED_PULSES, axis_read(axis, AXIS_REJECTED_PULSES), 4);
    put(LINE_ENCODER_REPLY_REJECTED_SAMPLES, axis_read(axis, AXIS_REJECTED_SAMPLES), 4);
    put(LINE_ENCODER_REPLY_HOME_PHASE, (uint32_t)homing_phase(axis), 4);
    put(LINE_ENCODER_REPLY_FAULT_POSITION, (uint64_t)axis_read_position(axis, AXIS_FAULT_POSITION), 8);
    reply[0] = LINE_ENCODER_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static bool of_axis(uint32_t block, uint32_t base)              // the blocks of an axis have the same stride
{
    return block >= base && block < base + axes * AXIS_STRIDE;
}

// A block has 64 words; those without a register read 0. Reading `receive` would take a word from the line, `recorder_word` one
// from the learner.
static uint8_t read_register(void)
{
    uint32_t address = (uint32_t)get(&asked[LINE_READ_REGISTER_REQUEST_ADDRESS], 2), block = address & ~0xFFu;
    bool exists = block == NODE_BASE || block == LINE_BASE || of_axis(block, AXIS_BASE) || of_axis(block, GRATING_BASE) ||
                  of_axis(block, ACTUATOR_BASE);
    if (!exists || address % 4 || address == LINE_BASE + LINE_RECEIVE) return LINE_CAUSE_NO_SUCH_REGISTER;
    if (of_axis(block, GRATING_BASE) && !grating_may_read(address - block)) return LINE_CAUSE_NO_SUCH_REGISTER;
    put(LINE_READ_REGISTER_REPLY_VALUE, register_read(address), 4);
    reply[0] = LINE_READ_REGISTER_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t write_register(void)
{
    uint32_t address = (uint32_t)get(&asked[LINE_WRITE_REGISTER_REQUEST_ADDRESS], 2), block = address & ~0xFFu;
    if (!of_axis(block, GRATING_BASE)) return LINE_CAUSE_NO_SUCH_REGISTER;
    return grating_write_register(address - block, (block - GRATING_BASE) / GRATING_STRIDE,
                                  (uint32_t)get(&asked[LINE_WRITE_REGISTER_REQUEST_VALUE], 4));
}

static uint8_t reset_faults(unsigned axis)
{
    grating_clear_signal_faults(axis);
    return axis_reset_faults(axis);
}

static uint8_t learner(unsigned axis)
{
    const struct learner *learner = grating_learner(axis);
    uint8_t cause = grating_learn(axis, asked[LINE_LEARNER_REQUEST_ACTION]);
    put(LINE_LEARNER_REPLY_REASON, grating_reason(axis), 1);
    put(LINE_LEARNER_REPLY_SETTLED, learner->settled, 1);
    put(LINE_LEARNER_REPLY_FROZEN, learner->frozen, 1);
    put(LINE_LEARNER_REPLY_ACCEPTED, learner->accepted, 4);
    put(LINE_LEARNER_REPLY_REFUSED, learner->refused, 4);
    put(LINE_LEARNER_REPLY_SCATTER, learner->scatter, 4);
    reply[0] = LINE_LEARNER_REPLY_LENGTH;
    return cause;
}

static uint8_t get_correction(unsigned axis)
{
    const struct learner_values *values = &grating_learner(axis)->values;
    put(LINE_GET_CORRECTION_REPLY_SIN_OFFSET, (uint64_t)values->sin_offset, 2);
    put(LINE_GET_CORRECTION_REPLY_COS_OFFSET, (uint64_t)values->cos_offset, 2);
    put(LINE_GET_CORRECTION_REPLY_GAIN, (uint64_t)values->gain, 4);
    put(LINE_GET_CORRECTION_REPLY_SHEAR, (uint64_t)values->shear, 4);
    reply[0] = LINE_GET_CORRECTION_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t get_harmonic(unsigned axis)
{
    const struct learner_values *values = &grating_learner(axis)->values;
    uint8_t order = asked[LINE_GET_HARMONIC_REQUEST_ORDER];
    if (order < 1 || order > LEARNER_ORDERS) return LINE_CAUSE_OUT_OF_RANGE;
    put(LINE_GET_HARMONIC_REPLY_COSINE, (uint64_t)values->cosine[order - 1], 4);
    put(LINE_GET_HARMONIC_REPLY_SINE, (uint64_t)values->sine[order - 1], 4);
    reply[0] = LINE_GET_HARMONIC_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t set_correction(unsigned axis)
{
    uint8_t apply = asked[LINE_SET_CORRECTION_REQUEST_APPLY];
    struct learner_values values = {.sin_offset = (int16_t)get(&asked[LINE_SET_CORRECTION_REQUEST_SIN_OFFSET], 2),
                                    .cos_offset = (int16_t)get(&asked[LINE_SET_CORRECTION_REQUEST_COS_OFFSET], 2),
                                    .gain = (int32_t)get(&asked[LINE_SET_CORRECTION_REQUEST_GAIN], 4),
                                    .shear = (int32_t)get(&asked[LINE_SET_CORRECTION_REQUEST_SHEAR], 4)};
    return apply > 1 ? LINE_CAUSE_OUT_OF_RANGE : grating_set_correction(axis, &values, apply);
}

static uint8_t set_harmonic(unsigned axis)
{
    return grating_set_harmonic(axis, asked[LINE_SET_HARMONIC_REQUEST_ORDER],
                                (int32_t)get(&asked[LINE_SET_HARMONIC_REQUEST_COSINE], 4),
                                (int32_t)get(&asked[LINE_SET_HARMONIC_REQUEST_SINE], 4));
}

static uint8_t signal(unsigned axis)
{
    put(LINE_SIGNAL_REPLY_FAULTS, grating_read(axis, GRATING_SIGNAL_FAULTS), 2);
    put(LINE_SIGNAL_REPLY_FIRST, grating_read(axis, GRATING_FIRST_SIGNAL_FAULTS), 2);
    reply[0] = LINE_SIGNAL_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t position(unsigned axis)
{
    put(LINE_POSITION_REPLY_POSITION, (uint64_t)axis_read_position(axis, AXIS_POSITION), 8);
    reply[0] = LINE_POSITION_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t arm_scope(unsigned axis)
{
    struct scope_setting setting = {.axis = (uint8_t)axis,
                                    .trigger = asked[LINE_ARM_SCOPE_REQUEST_TRIGGER],
                                    .before = asked[LINE_ARM_SCOPE_REQUEST_BEFORE],
                                    .every = (uint16_t)get(&asked[LINE_ARM_SCOPE_REQUEST_EVERY], 2),
                                    .level = (uint32_t)get(&asked[LINE_ARM_SCOPE_REQUEST_LEVEL], 4),
                                    .amplitude = (int16_t)get(&asked[LINE_ARM_SCOPE_REQUEST_AMPLITUDE], 2)};
    return scope_arm(&setting);
}

static uint8_t look_at_scope(void)
{
    put(LINE_SCOPE_REPLY_STATE, scope_state(), 1);
    put(LINE_SCOPE_REPLY_COUNT, scope_count(), 1);
    put(LINE_SCOPE_REPLY_BEFORE, scope_before(), 1);
    reply[0] = LINE_SCOPE_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t read_scope(void)
{
    uint8_t first = asked[LINE_READ_SCOPE_REQUEST_FIRST];
    if (first >= scope_count()) return LINE_CAUSE_OUT_OF_RANGE;
    for (uint32_t n = 0; n < LINE_READ_SCOPE_REPLY_LENGTH - LINE_REPLY_HEAD; n++)
        answer[LINE_REPLY_HEAD + n] = scope_byte(first, n);
    reply[0] = LINE_READ_SCOPE_REPLY_LENGTH;
    return LINE_CAUSE_OK;
}

static uint8_t execute(uint8_t operation, uint8_t length)
{
    unsigned axis = asked[LINE_REQUEST_HEAD];                   // of those operations that have one
    if (wrong_map && operation != LINE_OPERATION_IDENTIFY) return LINE_CAUSE_WRONG_MAP;
    if (length < LINE_REQUEST_HEAD) return LINE_CAUSE_WRONG_LENGTH;
    if (operation >= sizeof request_length || request_length[operation] == 0) return LINE_CAUSE_UNKNOWN_OPERATION;
    if (length != request_length[operation]) return LINE_CAUSE_WRONG_LENGTH;

    switch (operation) {
    case LINE_OPERATION_IDENTIFY: return identify();
    case LINE_OPERATION_COUNTERS: return counters();
    case LINE_OPERATION_READ_REGISTER: return read_register();
    case LINE_OPERATION_WRITE_REGISTER: return write_register();
    case LINE_OPERATION_SCOPE: return look_at_scope();
    case LINE_OPERATION_READ_SCOPE: return read_scope();
    case LINE_OPERATION_START: return axis_start_prepared(axes, asked[LINE_START_REQUEST_AXES]);
    default: break;
    }
    if (axis >= axes) return LINE_CAUSE_NO_SUCH_AXIS;
    switch (operation) {
    case LINE_OPERATION_STATUS: return status(axis);
    case LINE_OPERATION_ENABLE: return enable(axis);
    case LINE_OPERATION_HOME: return axis_home(axis);
    case LINE_OPERATION_MOVE: return motion(axis, axis_move);
    case LINE_OPERATION_PREPARE: return motion(axis, axis_prepare);
    case LINE_OPERATION_STOP: return axis_stop(axis);
    case LINE_OPERATION_RESET_FAULTS: return reset_faults(axis);
    case LINE_OPERATION_GET_PARAMETER: return get_parameter(axis);
    case LINE_OPERATION_SET_PARAMETER: return set_parameter(axis);
    case LINE_OPERATION_ENCODER: return encoder(axis);
    case LINE_OPERATION_LEARNER: return learner(axis);
    case LINE_OPERATION_GET_CORRECTION: return get_correction(axis);
    case LINE_OPERATION_GET_HARMONIC: return get_harmonic(axis);
    case LINE_OPERATION_SET_CORRECTION: return set_correction(axis);
    case LINE_OPERATION_SET_HARMONIC: return set_harmonic(axis);
    case LINE_OPERATION_SIGNAL: return signal(axis);
    case LINE_OPERATION_POSITION: return position(axis);
    case LINE_OPERATION_ARM_SCOPE: return arm_scope(axis);
    default: return LINE_CAUSE_UNKNOWN_OPERATION;
    }
}

static uint8_t own_address(void)
{
    return (uint8_t)FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS);
}

static void seal(void)                                          // length and CRC-32 around the body
{
    uint32_t length = reply[0], crc;
    line_write(LINE_CRC_START, LINE_CRC_START_START_MASK);
    line_write(LINE_CRC_BYTE, READY | WAY_FROM_NODE | own_address());
    for (uint32_t n = 0; n <= length; n++) line_write(LINE_CRC_BYTE, reply[n]);
    crc = line_read(LINE_CRC);
    put(length, crc, CRC_BYTES);
}

static void frame(void)
{
    uint8_t length = request[0], cause;
    uint32_t crc = (uint32_t)get(&asked[length], CRC_BYTES);
    if (answered && crc == answered_crc && asked[0] == answer[0]) {
        repeated++;
        return;
    }
    reply[0] = LINE_REPLY_HEAD;
    answer[0] = asked[0];
    answer[1] = length < LINE_REQUEST_HEAD ? 0 : asked[1];
    cause = execute(answer[1], length);
    if (cause != LINE_CAUSE_OK) {
        refused++;
        reply[0] = LINE_REPLY_HEAD;
    }
    answer[2] = cause;
    answered = true;
    answered_crc = crc;
    seal();
}

static void send(uint8_t data)
{
    line_write(LINE_TRANSMIT, data);
}

static void command_byte(uint8_t data)
{
    uint32_t bytes = 1;
    receiving = (data & WAY_MASK) == WAY_TO_NODE;
    received = 0;
    if (!receiving) bytes += 1 + reply[0] + CRC_BYTES;
    if (FIELD_GET(line_read(LINE_STATE), LINE_STATE_TRANSMIT_FREE) < bytes) return;    // silence, rather than half an answer
    send(READY | (data & 0x3F));
    for (uint32_t n = 0; n + 1 < bytes; n++) send(reply[n]);
}

void line_start(unsigned served_axes)
{
    axes = served_axes;
    wrong_map = !hardware_map_fits();
    receiving = answered = false;
    repeated = refused = 0;
    reply[0] = LINE_REPLY_HEAD;
    answer[0] = answer[1] = 0;
    answer[2] = LINE_CAUSE_OK;
    seal();
}

void line_poll(void)
{
    for (uint32_t words = 0; words < WORDS_A_POLL; words++) {
        uint32_t word = line_read(LINE_RECEIVE);
        if (!FIELD_GET(word, LINE_RECEIVE_PRESENT)) return;
        uint8_t data = (uint8_t)FIELD_GET(word, LINE_RECEIVE_DATA);
        if (FIELD_GET(word, LINE_RECEIVE_COMMAND)) {
            command_byte(data);
            continue;
        }
        if (!receiving || received == sizeof request) continue;
        request[received++] = data;
        if (FIELD_GET(word, LINE_RECEIVE_GOOD)) {
            receiving = false;
            if (received == 1u + request[0] + CRC_BYTES) frame();
        }
    }
}

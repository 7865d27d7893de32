// SPDX-License-Identifier: Apache-2.0
// line -- frames in, requests done, replies out.
//
// The hardware passes only words of frames for this node and marks the last word of a right one; a frame that it does not
// mark is forgotten when the next command byte comes. Causes are looked for in this order: wrong_map, unknown_operation,
// wrong_length, no_such_axis, out_of_range of a value, then what the axis says (faulted, not_enabled, busy, not_homed,
// out_of_travel).
#include "line.h"

#include "axis.h"
#include "clock.h"
#include "grating.h"
#include "hardware.h"
#include "homing.h"
#include "image.h"
#include "line_protocol.h"
#include "parameters.h"
#include "planner.h"

#define ADDRESS_MASK 0x0Fu
#define WAY_MASK 0x30u
#define WAY_TO_NODE 0x20u
#define WAY_FROM_NODE 0x10u
#define READY 0x40u
#define CRC_BYTES 4u
#define CAUSE (LINE_REPLY_HEAD - 1u)    // of a reply body
#define WORDS_A_POLL 8u                 // then the axes have their turn
#define LOWEST_BAUD 9600u
#define HIGHEST_BAUD 3000000u
#define SHORTEST_BIT_CLK 8u             // that receiver and transmitter can do
#define BAUD_PATIENCE_MS 5000u          // of a master at another baud rate than the first
#define NO_AXIS 0xFFu

#define OPERATION_SHAPE(name, code, request, reply, of_axis) [code] = {request, reply, of_axis},
static const struct { uint8_t request, reply; bool of_axis; } shapes[] = {LINE_OPERATIONS(OPERATION_SHAPE)};

static unsigned axes;
static bool wrong_map;
static bool receiving;
static uint8_t received;                                        // bytes in request
static uint8_t request[1 + LINE_LONGEST_BODY + CRC_BYTES];      // length, body, CRC-32
static uint8_t reply[1 + LINE_LONGEST_BODY + CRC_BYTES];
static const uint8_t *asked;                                    // bodies of what is being done
static uint8_t *answer;
static bool answered;                                           // there was a request, with this CRC-32:
static uint32_t answered_crc;
static uint32_t repeated, refused;
static uint8_t followed;                                        // whose position each reply tells afresh
static uint32_t baud, next_baud;                                // next: 0, or what comes after this reply
static uint32_t marked_axes, marks;                             // those that the next mark starts, and the marks before
static bool reply_sent;                                         // it is in the queue at least
static uint32_t called_ms, breaks;                              // when the master called last, and the breaks before this baud rate

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

uint64_t line_field(uint32_t at, unsigned bytes)
{
    return get(&asked[at], bytes);
}

void line_answer(uint32_t at, uint64_t value, unsigned bytes)
{
    put(at, value, bytes);
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
    return cause;
}

static uint8_t get_parameter(unsigned axis)
{
    uint8_t id = asked[LINE_GET_PARAMETER_REQUEST_PARAMETER];
    if (parameters_check(axis, id, 0) == LINE_CAUSE_UNKNOWN_PARAMETER) return LINE_CAUSE_UNKNOWN_PARAMETER;
    put(LINE_GET_PARAMETER_REPLY_VALUE, (uint64_t)parameters_get(axis, id), 8);
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
    put(LINE_COUNTERS_REPLY_BREAKS, line_read(LINE_BREAKS), 4);
    put(LINE_COUNTERS_REPLY_DRIVER_CUTS, line_read(LINE_DRIVER_CUTS), 4);
    put(LINE_COUNTERS_REPLY_MARKS, line_read(LINE_MARKS), 4);
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
    return LINE_CAUSE_OK;
}

static bool of_axis(uint32_t block, uint32_t base)              // the blocks of an axis have the same stride
{
    return block >= base && block < base + axes * AXIS_STRIDE;
}

// Reading these would take something away from the firmware.
static bool taken_by_reading(uint32_t address)
{
    return address == LINE_BASE + LINE_RECEIVE || address == LINKS_BASE + LINKS_I2C_ANSWER || address == LINKS_BASE + LINKS_PEER_RECEIVE;
}

// A block has 64 words; those without a register read 0.
static uint8_t read_register(void)
{
    uint32_t address = (uint32_t)get(&asked[LINE_READ_REGISTER_REQUEST_ADDRESS], 2), block = address & ~0xFFu;
    bool exists = block == NODE_BASE || block == LINE_BASE || block == LINKS_BASE || of_axis(block, AXIS_BASE) ||
                  of_axis(block, GRATING_BASE) || of_axis(block, ACTUATOR_BASE);
    if (!exists || address % 4 || taken_by_reading(address)) return LINE_CAUSE_NO_SUCH_REGISTER;
    if (of_axis(block, GRATING_BASE) && !grating_may_read(address - block)) return LINE_CAUSE_NO_SUCH_REGISTER;
    put(LINE_READ_REGISTER_REPLY_VALUE, register_read(address), 4);
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

static uint8_t signal(unsigned axis)
{
    if (!hardware_has_sine(axis)) return LINE_CAUSE_NOT_BUILT;
    put(LINE_SIGNAL_REPLY_FAULTS, grating_read(axis, GRATING_SIGNAL_FAULTS), 2);
    put(LINE_SIGNAL_REPLY_FIRST, grating_read(axis, GRATING_FIRST_SIGNAL_FAULTS), 2);
    return LINE_CAUSE_OK;
}

static uint8_t position(unsigned axis)
{
    put(LINE_POSITION_REPLY_POSITION, (uint64_t)axis_read_position(axis, AXIS_POSITION), 8);
    return LINE_CAUSE_OK;
}

static uint8_t set_baud(void)
{
    uint32_t wanted = (uint32_t)get(&asked[LINE_SET_BAUD_REQUEST_BAUD], 4);
    if (wanted < LOWEST_BAUD || wanted > HIGHEST_BAUD || wanted > node_read(NODE_CLK_HZ) / SHORTEST_BIT_CLK) return LINE_CAUSE_OUT_OF_RANGE;
    next_baud = wanted;
    return LINE_CAUSE_OK;
}

// The hardware starts them; the firmware learns it from the count of marks.
static uint8_t start_at_mark(uint32_t mask)
{
    uint8_t cause = mask ? axis_may_start(axes, mask) : LINE_CAUSE_OK;
    if (cause != LINE_CAUSE_OK) return cause;
    marks = line_read(LINE_MARKS);
    line_write(LINE_MARK_AXES, mask);
    marked_axes = mask;
    return LINE_CAUSE_OK;
}

static void look_for_mark(void)
{
    if (!marked_axes || line_read(LINE_MARKS) == marks) return;
    line_write(LINE_MARK_AXES, 0);
    axis_started(axes, marked_axes);
    marked_axes = 0;
}

static uint8_t operation_of_the_image(uint8_t operation)
{
    uint8_t cause = LINE_CAUSE_NOT_BUILT;
    for (unsigned part = 0; part < image_part_count && cause == LINE_CAUSE_NOT_BUILT; part++)
        if (image_parts[part].operation) cause = image_parts[part].operation(operation);
    return cause;
}

static uint8_t execute(uint8_t operation, uint8_t length)
{
    unsigned axis = asked[LINE_REQUEST_HEAD];                   // of those operations that have one
    if (wrong_map && operation != LINE_OPERATION_IDENTIFY) return LINE_CAUSE_WRONG_MAP;
    if (length < LINE_REQUEST_HEAD) return LINE_CAUSE_WRONG_LENGTH;
    if (operation >= sizeof shapes / sizeof *shapes || shapes[operation].request == 0) return LINE_CAUSE_UNKNOWN_OPERATION;
    if (length != shapes[operation].request) return LINE_CAUSE_WRONG_LENGTH;
    if (shapes[operation].of_axis && axis >= axes) return LINE_CAUSE_NO_SUCH_AXIS;

    switch (operation) {
    case LINE_OPERATION_IDENTIFY: return identify();
    case LINE_OPERATION_COUNTERS: return counters();
    case LINE_OPERATION_READ_REGISTER: return read_register();
    case LINE_OPERATION_WRITE_REGISTER: return write_register();
    case LINE_OPERATION_START: return axis_start_prepared(axes, asked[LINE_START_REQUEST_AXES]);
    case LINE_OPERATION_START_AT_MARK: return start_at_mark(asked[LINE_START_AT_MARK_REQUEST_AXES]);
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
    case LINE_OPERATION_SIGNAL: return signal(axis);
    case LINE_OPERATION_POSITION:
    case LINE_OPERATION_FOLLOW: return position(axis);          // the same bodies
    case LINE_OPERATION_SET_BAUD: return set_baud();
    default: return operation_of_the_image(operation);
    }
}

static uint8_t own_address(void)
{
    return (uint8_t)FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS);
}

static uint32_t crc_of(const uint8_t *bytes, uint32_t count)    // of what went before, and of these
{
    while (count--) line_write(LINE_CRC_BYTE, *bytes++);
    return line_read(LINE_CRC);
}

uint32_t line_crc(const uint8_t *bytes, uint32_t count)
{
    line_write(LINE_CRC_START, LINE_CRC_START_START_MASK);
    return crc_of(bytes, count);
}

static void seal(void)                                          // length and CRC-32 around the body
{
    uint8_t command = READY | WAY_FROM_NODE | own_address();
    uint32_t length = reply[0], crc;
    line_crc(&command, 1);
    crc = crc_of(reply, 1 + length);
    for (uint32_t n = 0; n < CRC_BYTES; n++) reply[1 + length + n] = (uint8_t)(crc >> 8 * n);
}

uint8_t line_do(const uint8_t *request_body, uint8_t length, uint8_t *reply_body)
{
    asked = request_body;
    answer = reply_body;
    answer[0] = asked[0];
    answer[1] = length < LINE_REQUEST_HEAD ? 0 : asked[1];
    answer[CAUSE] = execute(answer[1], length);
    return answer[CAUSE] == LINE_CAUSE_OK ? shapes[answer[1]].reply : LINE_REPLY_HEAD;
}

static void frame(void)
{
    uint8_t length = request[0];
    uint32_t crc = (uint32_t)get(&request[1 + length], CRC_BYTES);
    if (answered && crc == answered_crc && request[1] == reply[1]) {
        repeated++;
        return;
    }
    next_baud = 0;
    reply[0] = line_do(&request[1], length, &reply[1]);
    if (reply[1 + CAUSE] != LINE_CAUSE_OK) refused++;
    followed = reply[2] == LINE_OPERATION_FOLLOW && reply[1 + CAUSE] == LINE_CAUSE_OK ? request[1 + LINE_REQUEST_HEAD] : NO_AXIS;
    reply_sent = false;
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
    called_ms = clock_ms();
    receiving = false;
    if ((data & ADDRESS_MASK) == 0) return;                     // a mark for all nodes: the hardware took it
    receiving = (data & WAY_MASK) == WAY_TO_NODE;
    received = 0;
    if (!receiving) bytes += 1 + reply[0] + CRC_BYTES;
    if (FIELD_GET(line_read(LINE_STATE), LINE_STATE_TRANSMIT_FREE) < bytes) return;    // silence, rather than half an answer
    send(READY | (data & 0x3F));
    if (!receiving && followed != NO_AXIS) {                    // while the ready byte is under way
        answer = &reply[1];
        position(followed);
        seal();
    }
    reply_sent = !receiving;
    for (uint32_t n = 0; n + 1 < bytes; n++) send(reply[n]);
}

void line_start(unsigned served_axes)
{
    axes = served_axes;
    wrong_map = !hardware_map_fits();
    receiving = answered = reply_sent = false;
    followed = NO_AXIS;
    line_write(LINE_MARK_AXES, 0);
    marked_axes = 0;
    baud = BAUD;
    next_baud = 0;
    repeated = refused = 0;
    reply[0] = LINE_REPLY_HEAD;
    reply[1] = reply[2] = 0;
    reply[1 + CAUSE] = LINE_CAUSE_OK;
    seal();
}

static void speak_at(uint32_t wanted)
{
    parameters_set_baud(wanted);
    baud = wanted;
    next_baud = 0;
    called_ms = clock_ms();
    breaks = line_read(LINE_BREAKS);
}

static void keep_baud(void)
{
    if (next_baud && reply_sent && !FIELD_GET(line_read(LINE_STATE), LINE_STATE_SENDING)) speak_at(next_baud);
    else if (baud != BAUD && (clock_ms() - called_ms > BAUD_PATIENCE_MS || line_read(LINE_BREAKS) != breaks)) speak_at(BAUD);
}

void line_poll(void)
{
    keep_baud();
    look_for_mark();
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

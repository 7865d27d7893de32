// SPDX-License-Identifier: Apache-2.0
// bus -- receives frames, executes their requests, sends replies.
//
// The hardware passes only the words of frames for this node, and marks the last word of a frame
// whose CRC is right. A frame without the mark is dropped at the next command byte. A request is
// checked in this order: wrong_map, unknown_operation, wrong_length, no_such_axis, out_of_range of
// a value, then the state of the axis (faulted, not_enabled, busy, not_homed, out_of_travel).
#include "bus/bus.h"

#include "axis/axis.h"
#include "core/clock.h"
#include "axis/feedback.h"
#include "core/hardware.h"
#include "axis/homing.h"
#include "core/image.h"
#include "made/bus_protocol.h"
#include "axis/parameters.h"
#include "planner/planner.h"

#define ADDRESS_MASK 0x0Fu
#define DIRECTION_MASK 0x30u
#define DIRECTION_TO_NODE 0x20u
#define DIRECTION_FROM_NODE 0x10u
#define READY 0x40u
#define CRC_BYTES 4u
#define CAUSE (BUS_REPLY_HEAD - 1u)  // of a reply body
#define WORDS_PER_POLL 8u            // then the axes are polled
#define LOWEST_BAUD 9600u
#define HIGHEST_BAUD 3000000u
#define SHORTEST_BIT_CYCLES 8u  // that receiver and transmitter support
#define BAUD_TIMEOUT_MS 5000u   // without the master, until BAUD is set again
#define NO_AXIS 0xFFu

#define OPERATION_SHAPE(name, code, request, reply, of_axis) [code] = {request, reply, of_axis},
static const struct {
    uint8_t request, reply;
    bool of_axis;
} shapes[] = {BUS_OPERATIONS(OPERATION_SHAPE)};

static unsigned axes;
static bool wrong_map;
static bool receiving;
static uint8_t received;                                   // bytes in request
static uint8_t request[1 + BUS_LONGEST_BODY + CRC_BYTES];  // length, body, CRC-32
static uint8_t reply[1 + BUS_LONGEST_BODY + CRC_BYTES];
static const uint8_t* current_request;  // bodies of the request that is being executed
static uint8_t* current_reply;
static bool answered;          // there was a request
static uint32_t answered_crc;  // and this was its CRC-32
static uint32_t repeated, refused;
static uint8_t followed;           // axis whose present position goes into each reply
static uint32_t baud, next_baud;   // next: 0, or the baud rate after this reply
static uint32_t sync_axes, syncs;  // axes that the next sync starts, and the syncs so far
static bool reply_sent;            // at least it is in the transmit queue
static uint32_t last_command_ms;   // time of the last command byte
static uint32_t breaks;            // break conditions before this baud rate was set

static uint64_t get(const uint8_t* from, unsigned bytes) {
    uint64_t value = 0;
    while (bytes--) value = value << 8 | from[bytes];
    return value;
}

static void put(uint32_t at, uint64_t value, unsigned bytes) {
    uint8_t* to = &current_reply[at];
    while (bytes--) {
        *to++ = (uint8_t)value;
        value >>= 8;
    }
}

uint64_t bus_request_field(uint32_t at, unsigned bytes) { return get(&current_request[at], bytes); }

void bus_reply_field(uint32_t at, uint64_t value, unsigned bytes) { put(at, value, bytes); }

static uint8_t identify(void) {
    put(BUS_IDENTIFY_REPLY_MAP_CRC, node_read(NODE_MAP_CRC), 4);
    put(BUS_IDENTIFY_REPLY_PROTOCOL_CRC, PROTOCOL_CRC, 4);
    put(BUS_IDENTIFY_REPLY_VERSION, BUS_VERSION, 2);
    put(BUS_IDENTIFY_REPLY_ADDRESS, FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS), 1);
    put(BUS_IDENTIFY_REPLY_AXES, axes, 1);
    put(BUS_IDENTIFY_REPLY_CLK_HZ, node_read(NODE_CLK_HZ), 4);
    put(BUS_IDENTIFY_REPLY_TICK_HZ, PLANNER_TICK_HZ, 4);
    put(BUS_IDENTIFY_REPLY_SAMPLE_HZ, parameters_sample_hz(), 4);
    return BUS_CAUSE_OK;
}

static uint8_t status(unsigned axis) {
    int64_t position = axis_read_position(axis, AXIS_POSITION);
    axis_poll(axis);
    put(BUS_STATUS_REPLY_STATE, axis_state(axis), 1);
    put(BUS_STATUS_REPLY_ENDED, axis_ended(axis), 1);
    put(BUS_STATUS_REPLY_FLAGS, axis_flags(axis), 1);
    put(BUS_STATUS_REPLY_ENCODER_EVENTS, axis_read(axis, AXIS_ENCODER_EVENTS), 1);
    put(BUS_STATUS_REPLY_FAULTS, axis_read(axis, AXIS_FAULTS), 2);
    put(BUS_STATUS_REPLY_FIRST_FAULT, axis_read(axis, AXIS_FIRST_FAULT), 2);
    put(BUS_STATUS_REPLY_POSITION, (uint64_t)position, 8);
    put(BUS_STATUS_REPLY_TARGET, (uint64_t)axis_read_position(axis, AXIS_TARGET), 8);
    put(BUS_STATUS_REPLY_VELOCITY, axis_read(axis, AXIS_VELOCITY), 4);
    put(BUS_STATUS_REPLY_COMMAND, axis_read(axis, AXIS_COMMAND), 2);
    put(BUS_STATUS_REPLY_COUNTS,
        (uint64_t)((position * parameters_get(axis, BUS_PARAMETER_COUNTS_PER_PERIOD)) >> 16), 8);
    return BUS_CAUSE_OK;
}

static uint8_t enable(unsigned axis) {
    uint8_t on = current_request[BUS_ENABLE_REQUEST_ON];
    return on > 1 ? BUS_CAUSE_OUT_OF_RANGE : axis_enable(axis, on);
}

typedef uint8_t motion_request(unsigned n, int64_t target, uint32_t* duration_ticks);

// move and prepare have the same bodies
static uint8_t motion(unsigned axis, motion_request* begin) {
    uint32_t ticks = 0;
    uint8_t cause = begin(axis, (int64_t)get(&current_request[BUS_MOVE_REQUEST_TARGET], 8), &ticks);
    put(BUS_MOVE_REPLY_DURATION_TICKS, ticks, 4);
    return cause;
}

static uint8_t get_parameter(unsigned axis) {
    uint8_t id = current_request[BUS_GET_PARAMETER_REQUEST_PARAMETER];
    if (parameters_check(axis, id, 0) == BUS_CAUSE_UNKNOWN_PARAMETER)
        return BUS_CAUSE_UNKNOWN_PARAMETER;
    put(BUS_GET_PARAMETER_REPLY_VALUE, (uint64_t)parameters_get(axis, id), 8);
    return BUS_CAUSE_OK;
}

static uint8_t set_parameter(unsigned axis) {
    return axis_set_parameter(axis, current_request[BUS_SET_PARAMETER_REQUEST_PARAMETER],
                              (int64_t)get(&current_request[BUS_SET_PARAMETER_REQUEST_VALUE], 8));
}

static uint8_t counters(void) {
    put(BUS_COUNTERS_REPLY_FRAMES_GOOD, bus_read(BUS_FRAMES_GOOD), 4);
    put(BUS_COUNTERS_REPLY_FRAMES_BAD, bus_read(BUS_FRAMES_BAD), 4);
    put(BUS_COUNTERS_REPLY_FRAMING_ERRORS, bus_read(BUS_FRAMING_ERRORS), 4);
    put(BUS_COUNTERS_REPLY_START_GLITCHES, bus_read(BUS_START_GLITCHES), 4);
    put(BUS_COUNTERS_REPLY_OVERRUNS, bus_read(BUS_OVERRUNS), 4);
    put(BUS_COUNTERS_REPLY_REPEATED, repeated, 4);
    put(BUS_COUNTERS_REPLY_REFUSED, refused, 4);
    put(BUS_COUNTERS_REPLY_BREAKS, bus_read(BUS_BREAKS), 4);
    put(BUS_COUNTERS_REPLY_TRANSMIT_TIMEOUTS, bus_read(BUS_TRANSMIT_TIMEOUTS), 4);
    put(BUS_COUNTERS_REPLY_SYNCS, bus_read(BUS_SYNCS), 4);
    return BUS_CAUSE_OK;
}

static uint8_t encoder(unsigned axis) {
    uint32_t sample = axis_read(axis, AXIS_SAMPLE), phase = axis_read(axis, AXIS_PHASE);
    put(BUS_ENCODER_REPLY_SIN, FIELD_GET(sample, AXIS_SAMPLE_SIN), 2);
    put(BUS_ENCODER_REPLY_COS, FIELD_GET(sample, AXIS_SAMPLE_COS), 2);
    put(BUS_ENCODER_REPLY_PHASE, FIELD_GET(phase, AXIS_PHASE_PHASE), 2);
    put(BUS_ENCODER_REPLY_AMPLITUDE, FIELD_GET(phase, AXIS_PHASE_AMPLITUDE), 2);
    put(BUS_ENCODER_REPLY_QUADRATURE_COUNT, axis_read(axis, AXIS_QUADRATURE_COUNT), 4);
    put(BUS_ENCODER_REPLY_REJECTED_PULSES, axis_read(axis, AXIS_REJECTED_PULSES), 4);
    put(BUS_ENCODER_REPLY_REJECTED_SAMPLES, axis_read(axis, AXIS_REJECTED_SAMPLES), 4);
    put(BUS_ENCODER_REPLY_HOME_PHASE, (uint32_t)homing_phase(axis), 4);
    put(BUS_ENCODER_REPLY_FAULT_POSITION, (uint64_t)axis_read_position(axis, AXIS_FAULT_POSITION),
        8);
    return BUS_CAUSE_OK;
}

// The blocks of an axis have the same stride.
static bool of_axis(uint32_t block, uint32_t base) {
    return block >= base && block < base + axes * AXIS_STRIDE;
}

// Reading these registers would take data from the firmware.
static bool has_read_effect(uint32_t address) {
    return address == BUS_BASE + BUS_RECEIVE || address == NODE_BASE + NODE_SCOPE_WORD ||
           address == PERIPHERALS_BASE + PERIPHERALS_I2C_ANSWER ||
           address == PERIPHERALS_BASE + PERIPHERALS_PEER_RECEIVE;
}

// A block has 64 words; those without a register read 0. Those of the node fill all addresses below
// the axes.
_Static_assert(LINK_BASE + 0x100u == AXIS_BASE, "a block of the node is not below the axes");

static __attribute__((noinline)) bool may_read(uint32_t address) {
    uint32_t block = address & ~0xFFu;
    if (address % 4 || has_read_effect(address)) return false;
    if (of_axis(block, FEEDBACK_BASE)) return feedback_may_read(address - block);
    return block < AXIS_BASE || of_axis(block, AXIS_BASE) || of_axis(block, ACTUATOR_BASE);
}

// The word behind the one that is asked for is read with it and kept for the next request: it may
// be the high word of a wide register, and the firmware reads wide registers between two requests.
static uint8_t read_register(void) {
    static uint32_t kept, kept_for;  // its address + 1; 0: none is kept
    uint32_t address = (uint32_t)get(&current_request[BUS_READ_REGISTER_REQUEST_ADDRESS], 2);
    if (!may_read(address)) return BUS_CAUSE_NO_SUCH_REGISTER;
    uint32_t value = kept, next = 0;
    if (address + 1u != kept_for) {
        value = register_read(address);
        if (may_read(address + 4u)) {
            kept = register_read(address + 4u);
            next = address + 5u;
        }
    }
    kept_for = next;
    put(BUS_READ_REGISTER_REPLY_VALUE, value, 4);
    return BUS_CAUSE_OK;
}

static uint8_t image_operation(uint8_t operation) {
    uint8_t cause = BUS_CAUSE_NOT_BUILT;
    for (unsigned part = 0; part < image_part_count && cause == BUS_CAUSE_NOT_BUILT; part++)
        if (image_parts[part].operation) cause = image_parts[part].operation(operation);
    return cause;
}

// A part of the image may have registers to be written, too.
static uint8_t write_register(void) {
    uint32_t address = (uint32_t)get(&current_request[BUS_WRITE_REGISTER_REQUEST_ADDRESS], 2),
             block = address & ~0xFFu;
    uint32_t value = (uint32_t)get(&current_request[BUS_WRITE_REGISTER_REQUEST_VALUE], 4);
    if (block == LINK_BASE && address % 4 == 0) {
        if (!(link_read(LINK_STATE) & LINK_STATE_BUILT_MASK)) return BUS_CAUSE_NOT_BUILT;
        register_write(address, value);
        return BUS_CAUSE_OK;
    }
    uint8_t cause = image_operation(BUS_OPERATION_WRITE_REGISTER);
    if (cause != BUS_CAUSE_NOT_BUILT) return cause;
    if (!of_axis(block, FEEDBACK_BASE)) return BUS_CAUSE_NO_SUCH_REGISTER;
    return feedback_write_register(address - block, (block - FEEDBACK_BASE) / FEEDBACK_STRIDE,
                                   value);
}

static uint8_t reset_faults(unsigned axis) {
    feedback_clear_signal_faults(axis);
    return axis_reset_faults(axis);
}

static uint8_t signal(unsigned axis) {
    if (!hardware_built(axis, AXIS_BUILT_MONITOR_MASK)) return BUS_CAUSE_NOT_BUILT;
    put(BUS_SIGNAL_REPLY_FAULTS, feedback_read(axis, FEEDBACK_SIGNAL_FAULTS), 2);
    put(BUS_SIGNAL_REPLY_FIRST, feedback_read(axis, FEEDBACK_FIRST_SIGNAL_FAULTS), 2);
    return BUS_CAUSE_OK;
}

static uint8_t position(unsigned axis) {
    put(BUS_POSITION_REPLY_POSITION, (uint64_t)axis_read_position(axis, AXIS_POSITION), 8);
    return BUS_CAUSE_OK;
}

static uint8_t set_baud(void) {
    uint32_t requested = (uint32_t)get(&current_request[BUS_SET_BAUD_REQUEST_BAUD], 4);
    if (requested < LOWEST_BAUD || requested > HIGHEST_BAUD ||
        requested > node_read(NODE_CLK_HZ) / SHORTEST_BIT_CYCLES)
        return BUS_CAUSE_OUT_OF_RANGE;
    next_baud = requested;
    return BUS_CAUSE_OK;
}

// The hardware starts the axes; the firmware detects it by the count of syncs. An axis that is no
// longer prepared does not wait for a sync any more.
static uint8_t start_at_sync(uint32_t mask) {
    uint8_t cause = mask ? axis_may_start(axes, mask) : BUS_CAUSE_OK;
    if (cause != BUS_CAUSE_OK) return cause;
    syncs = bus_read(BUS_SYNCS);
    bus_write(BUS_SYNC_AXES, mask);
    sync_axes = mask;
    return BUS_CAUSE_OK;
}

static __attribute__((noinline)) void poll_sync(void) {
    if (!HARDWARE_DRIVES || !sync_axes) return;
    uint32_t waiting = axis_prepared(axes, sync_axes);
    if (bus_read(BUS_SYNCS) != syncs) {
        axis_started(axes, waiting);
        waiting = 0;
    }
    if (waiting == sync_axes) return;
    bus_write(BUS_SYNC_AXES, waiting);
    sync_axes = waiting;
}

static bool is_of_drive(uint8_t operation) {
    switch (operation) {
    case BUS_OPERATION_ENABLE:
    case BUS_OPERATION_HOME:
    case BUS_OPERATION_MOVE:
    case BUS_OPERATION_PREPARE:
    case BUS_OPERATION_START:
    case BUS_OPERATION_START_AT_SYNC:
    case BUS_OPERATION_STOP: return true;
    default: return false;
    }
}

static uint8_t drive_operation(uint8_t operation, unsigned axis) {
    switch (operation) {
    case BUS_OPERATION_ENABLE: return enable(axis);
    case BUS_OPERATION_HOME: return axis_home(axis);
    case BUS_OPERATION_MOVE: return motion(axis, axis_move);
    case BUS_OPERATION_PREPARE: return motion(axis, axis_prepare);
    case BUS_OPERATION_START:
        return axis_start_prepared(axes, current_request[BUS_START_REQUEST_AXES]);
    case BUS_OPERATION_START_AT_SYNC:
        return start_at_sync(current_request[BUS_START_AT_SYNC_REQUEST_AXES]);
    default: return axis_stop(axis);
    }
}

static uint8_t execute(uint8_t operation, uint8_t length) {
    unsigned axis = current_request[BUS_REQUEST_HEAD];  // if the operation has one
    if (wrong_map && operation != BUS_OPERATION_IDENTIFY) return BUS_CAUSE_WRONG_MAP;
    if (length < BUS_REQUEST_HEAD) return BUS_CAUSE_WRONG_LENGTH;
    if (operation >= sizeof shapes / sizeof *shapes || shapes[operation].request == 0)
        return BUS_CAUSE_UNKNOWN_OPERATION;
    if (length != shapes[operation].request) return BUS_CAUSE_WRONG_LENGTH;
    if (shapes[operation].of_axis && axis >= axes) return BUS_CAUSE_NO_SUCH_AXIS;

    if (is_of_drive(operation))
        return HARDWARE_DRIVES ? drive_operation(operation, axis) : BUS_CAUSE_NOT_BUILT;
    switch (operation) {
    case BUS_OPERATION_IDENTIFY: return identify();
    case BUS_OPERATION_COUNTERS: return counters();
    case BUS_OPERATION_READ_REGISTER: return read_register();
    case BUS_OPERATION_WRITE_REGISTER: return write_register();
    case BUS_OPERATION_STATUS: return status(axis);
    case BUS_OPERATION_RESET_FAULTS: return reset_faults(axis);
    case BUS_OPERATION_GET_PARAMETER: return get_parameter(axis);
    case BUS_OPERATION_SET_PARAMETER: return set_parameter(axis);
    case BUS_OPERATION_ENCODER: return encoder(axis);
    case BUS_OPERATION_SIGNAL: return signal(axis);
    case BUS_OPERATION_POSITION:
    case BUS_OPERATION_FOLLOW: return position(axis);  // the same bodies
    case BUS_OPERATION_SET_BAUD: return set_baud();
    default: return image_operation(operation);
    }
}

static uint8_t own_address(void) {
    return (uint8_t)FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS);
}

// Continues the CRC with these bytes.
static uint32_t crc_of(const uint8_t* bytes, uint32_t count) {
    while (count--) bus_write(BUS_CRC_BYTE, *bytes++);
    return bus_read(BUS_CRC);
}

uint32_t bus_crc(const uint8_t* bytes, uint32_t count) {
    bus_write(BUS_CRC_START, BUS_CRC_START_START_MASK);
    return crc_of(bytes, count);
}

// Completes the reply with its CRC-32, over the command byte too.
static void seal(void) {
    uint8_t command = READY | DIRECTION_FROM_NODE | own_address();
    uint32_t length = reply[0], crc;
    bus_crc(&command, 1);
    crc = crc_of(reply, 1 + length);
    for (uint32_t n = 0; n < CRC_BYTES; n++) reply[1 + length + n] = (uint8_t)(crc >> 8 * n);
}

uint8_t bus_execute(const uint8_t* request_body, uint8_t length, uint8_t* reply_body) {
    current_request = request_body;
    current_reply = reply_body;
    current_reply[0] = current_request[0];
    current_reply[1] = length < BUS_REQUEST_HEAD ? 0 : current_request[1];
    current_reply[CAUSE] = execute(current_reply[1], length);
    return current_reply[CAUSE] == BUS_CAUSE_OK ? shapes[current_reply[1]].reply : BUS_REPLY_HEAD;
}

static void frame(void) {
    uint8_t length = request[0];
    uint32_t crc = (uint32_t)get(&request[1 + length], CRC_BYTES);
    if (answered && crc == answered_crc && request[1] == reply[1]) {
        repeated++;
        return;
    }
    next_baud = 0;
    reply[0] = bus_execute(&request[1], length, &reply[1]);
    if (reply[1 + CAUSE] != BUS_CAUSE_OK) refused++;
    followed = reply[2] == BUS_OPERATION_FOLLOW && reply[1 + CAUSE] == BUS_CAUSE_OK
                   ? request[1 + BUS_REQUEST_HEAD]
                   : NO_AXIS;
    reply_sent = false;
    answered = true;
    answered_crc = crc;
    seal();
}

static void send(uint8_t data) { bus_write(BUS_TRANSMIT, data); }

static void command_byte(uint8_t data) {
    uint32_t bytes = 1;
    last_command_ms = clock_ms();
    receiving = false;
    if ((data & ADDRESS_MASK) == 0) return;  // sync for all nodes: the hardware handled it
    receiving = (data & DIRECTION_MASK) == DIRECTION_TO_NODE;
    received = 0;
    if (!receiving) bytes += 1 + reply[0] + CRC_BYTES;
    // no reply rather than half a reply
    if (FIELD_GET(bus_read(BUS_STATE), BUS_STATE_TRANSMIT_FREE) < bytes) return;
    send(READY | (data & 0x3F));
    if (!receiving && followed != NO_AXIS) {  // while the ready byte is sent
        current_reply = &reply[1];
        position(followed);
        seal();
    }
    reply_sent = !receiving;
    for (uint32_t n = 0; n + 1 < bytes; n++) send(reply[n]);
}

void bus_start(unsigned served_axes) {
    axes = served_axes;
    wrong_map = !hardware_map_fits();
    receiving = answered = reply_sent = false;
    followed = NO_AXIS;
    bus_write(BUS_SYNC_AXES, 0);
    sync_axes = 0;
    baud = BAUD;
    next_baud = 0;
    repeated = refused = 0;
    reply[0] = BUS_REPLY_HEAD;
    reply[1] = reply[2] = 0;
    reply[1 + CAUSE] = BUS_CAUSE_OK;
    seal();
}

static void switch_baud(uint32_t requested) {
    parameters_set_baud(requested);
    baud = requested;
    next_baud = 0;
    last_command_ms = clock_ms();
    breaks = bus_read(BUS_BREAKS);
}

static __attribute__((noinline)) void update_baud(void) {
    if (next_baud && reply_sent && !FIELD_GET(bus_read(BUS_STATE), BUS_STATE_SENDING))
        switch_baud(next_baud);
    else if (baud != BAUD &&
             (clock_ms() - last_command_ms > BAUD_TIMEOUT_MS || bus_read(BUS_BREAKS) != breaks))
        switch_baud(BAUD);
}

bool bus_idle(void) { return baud == BAUD && !next_baud && !sync_axes; }

// Not inlined: a poll without a word then saves no registers, and takes a quarter of the time.
static __attribute__((noinline)) void take(uint32_t word) {
    uint8_t data = (uint8_t)FIELD_GET(word, BUS_RECEIVE_DATA);
    if (FIELD_GET(word, BUS_RECEIVE_COMMAND)) {
        command_byte(data);
        return;
    }
    if (!receiving || received == sizeof request) return;
    request[received++] = data;
    if (FIELD_GET(word, BUS_RECEIVE_GOOD)) {
        receiving = false;
        if (received == 1u + request[0] + CRC_BYTES) frame();
    }
}

void bus_poll(void) {
    if (!bus_idle()) {
        update_baud();
        poll_sync();
    }
    for (uint32_t words = 0; words < WORDS_PER_POLL; words++) {
        uint32_t word = bus_read(BUS_RECEIVE);
        if (!FIELD_GET(word, BUS_RECEIVE_PRESENT)) return;
        take(word);
    }
}

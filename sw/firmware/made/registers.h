// SPDX-License-Identifier: Apache-2.0
// The register map as the firmware sees it; made by tables/registers.py from tables/registers.rdl,
// change those.
//
// NODE_x, BUS_x, AXIS_x are byte offsets inside a block. A field is read with
// FIELD_GET(word, AXIS_STATE_QUEUE_FREE) or FIELD_GET_SIGNED, and written with
// FIELD_PUT(AXIS_CONTROL_ENABLE, 1). A value alone in its register has the register's name.
#ifndef MOIRE_REGISTERS_H
#define MOIRE_REGISTERS_H

#include <stdint.h>

#define REGISTERS_BASE 0x80000000u
#define MAP_CRC 0xc9c30ab0u  // CRC-32 of tables/registers.rdl

#define NODE_BASE 0x000u
#define BUS_BASE 0x100u
#define PERIPHERALS_BASE 0x200u
#define LINK_BASE 0x300u
#define AXIS_BASE 0x400u
#define AXIS_STRIDE 0x100u
#define FEEDBACK_BASE 0xc00u
#define FEEDBACK_STRIDE 0x100u
#define ACTUATOR_BASE 0x1400u
#define ACTUATOR_STRIDE 0x100u

#define FIELD_GET(word, field) (((uint32_t)(word) & field##_MASK) >> field##_SHIFT)
#define FIELD_GET_SIGNED(word, field) \
    ((int32_t)((uint32_t)(word) << (32 - field##_SHIFT - field##_WIDTH)) >> (32 - field##_WIDTH))
#define FIELD_PUT(field, value) (((uint32_t)(value) << field##_SHIFT) & field##_MASK)

#ifndef MOIRE_REGISTER_ACCESS  // a host test may bring its own two functions
static inline uint32_t register_read(uint32_t offset) {
    return *(volatile uint32_t *)(uintptr_t)(REGISTERS_BASE + offset);
}
static inline void register_write(uint32_t offset, uint32_t value) {
    *(volatile uint32_t *)(uintptr_t)(REGISTERS_BASE + offset) = value;
}
#else
uint32_t register_read(uint32_t offset);
void register_write(uint32_t offset, uint32_t value);
#endif

// 64 bits: reading the low word latches the high one, writing the high word commits both.
// One low word can wait at a time: these functions write both words at once.
static inline uint64_t register_read_wide(uint32_t offset) {
    uint32_t low = register_read(offset);
    return (uint64_t)register_read(offset + 4) << 32 | low;
}
static inline void register_write_wide(uint32_t offset, uint64_t value) {
    register_write(offset, (uint32_t)value);
    register_write(offset + 4, (uint32_t)(value >> 32));
}

static inline uint32_t node_read(uint32_t offset) {
    return register_read(NODE_BASE + offset);
}
static inline void node_write(uint32_t offset, uint32_t value) {
    register_write(NODE_BASE + offset, value);
}
static inline uint64_t node_read_wide(uint32_t offset) {
    return register_read_wide(NODE_BASE + offset);
}
static inline uint32_t bus_read(uint32_t offset) {
    return register_read(BUS_BASE + offset);
}
static inline void bus_write(uint32_t offset, uint32_t value) {
    register_write(BUS_BASE + offset, value);
}
static inline uint32_t peripherals_read(uint32_t offset) {
    return register_read(PERIPHERALS_BASE + offset);
}
static inline void peripherals_write(uint32_t offset, uint32_t value) {
    register_write(PERIPHERALS_BASE + offset, value);
}
static inline uint64_t peripherals_read_wide(uint32_t offset) {
    return register_read_wide(PERIPHERALS_BASE + offset);
}
static inline uint32_t link_read(uint32_t offset) {
    return register_read(LINK_BASE + offset);
}
static inline void link_write(uint32_t offset, uint32_t value) {
    register_write(LINK_BASE + offset, value);
}
static inline uint32_t axis_read(unsigned axis, uint32_t offset) {
    return register_read(AXIS_BASE + axis * AXIS_STRIDE + offset);
}
static inline void axis_write(unsigned axis, uint32_t offset, uint32_t value) {
    register_write(AXIS_BASE + axis * AXIS_STRIDE + offset, value);
}
static inline uint64_t axis_read_wide(unsigned axis, uint32_t offset) {
    return register_read_wide(AXIS_BASE + axis * AXIS_STRIDE + offset);
}
static inline void axis_write_wide(unsigned axis, uint32_t offset, uint64_t value) {
    register_write_wide(AXIS_BASE + axis * AXIS_STRIDE + offset, value);
}
static inline uint32_t feedback_read(unsigned axis, uint32_t offset) {
    return register_read(FEEDBACK_BASE + axis * FEEDBACK_STRIDE + offset);
}
static inline void feedback_write(unsigned axis, uint32_t offset, uint32_t value) {
    register_write(FEEDBACK_BASE + axis * FEEDBACK_STRIDE + offset, value);
}
static inline uint64_t feedback_read_wide(unsigned axis, uint32_t offset) {
    return register_read_wide(FEEDBACK_BASE + axis * FEEDBACK_STRIDE + offset);
}
static inline void feedback_write_wide(unsigned axis, uint32_t offset, uint64_t value) {
    register_write_wide(FEEDBACK_BASE + axis * FEEDBACK_STRIDE + offset, value);
}
static inline uint32_t actuator_read(unsigned axis, uint32_t offset) {
    return register_read(ACTUATOR_BASE + axis * ACTUATOR_STRIDE + offset);
}
static inline void actuator_write(unsigned axis, uint32_t offset, uint32_t value) {
    register_write(ACTUATOR_BASE + axis * ACTUATOR_STRIDE + offset, value);
}
static inline uint64_t actuator_read_wide(unsigned axis, uint32_t offset) {
    return register_read_wide(ACTUATOR_BASE + axis * ACTUATOR_STRIDE + offset);
}
static inline void actuator_write_wide(unsigned axis, uint32_t offset, uint64_t value) {
    register_write_wide(ACTUATOR_BASE + axis * ACTUATOR_STRIDE + offset, value);
}

// node: identity, time, heartbeat of the soft core
// r: CRC-32 of the register source
#define NODE_MAP_CRC 0x000u
#define NODE_MAP_CRC_MASK 0xffffffffu
#define NODE_MAP_CRC_SHIFT 0
#define NODE_MAP_CRC_WIDTH 32
// r: frequency of clk [Hz]
#define NODE_CLK_HZ 0x004u
#define NODE_CLK_HZ_MASK 0xffffffffu
#define NODE_CLK_HZ_SHIFT 0
#define NODE_CLK_HZ_WIDTH 32
// r: what is built
#define NODE_BUILD 0x008u
#define NODE_BUILD_AXES_MASK 0x0000000fu
#define NODE_BUILD_AXES_SHIFT 0
#define NODE_BUILD_AXES_WIDTH 4
#define NODE_BUILD_ADDRESS_MASK 0x000000f0u
#define NODE_BUILD_ADDRESS_SHIFT 4
#define NODE_BUILD_ADDRESS_WIDTH 4
#define NODE_BUILD_MEMORY_MASK 0x0000ff00u
#define NODE_BUILD_MEMORY_SHIFT 8
#define NODE_BUILD_MEMORY_WIDTH 8
// SCOPE_WORDS: words of the recorder of ticks; 0: there is none, and no excitation
#define NODE_BUILD_SCOPE_MASK 0x01ff0000u
#define NODE_BUILD_SCOPE_SHIFT 16
#define NODE_BUILD_SCOPE_WIDTH 9
// r: cycles since reset; every time stamp is a part of it [cycle]
#define NODE_TIME_STAMP 0x010u
#define NODE_TIME_STAMP_LOW 0x010u
#define NODE_TIME_STAMP_HIGH 0x014u
#define NODE_TIME_STAMP_WIDTH 64
// rw: period of the servo tick; it is the same for all axes [cycle]
#define NODE_TICK_PERIOD 0x018u
#define NODE_TICK_PERIOD_MASK 0x00ffffffu
#define NODE_TICK_PERIOD_SHIFT 0
#define NODE_TICK_PERIOD_WIDTH 24
// rw: period of the samples; it is the same for all ADCs [cycle]
#define NODE_SAMPLE_PERIOD 0x01cu
#define NODE_SAMPLE_PERIOD_MASK 0x0000ffffu
#define NODE_SAMPLE_PERIOD_SHIFT 0
#define NODE_SAMPLE_PERIOD_WIDTH 16
// w: heartbeat of the firmware; while a drive is on, the longest time between two is 20 ms and 1
// 200 000 cycles: kick
#define NODE_HEARTBEAT 0x020u
#define NODE_HEARTBEAT_KICK_MASK 0x00000001u
#define NODE_HEARTBEAT_KICK_SHIFT 0
#define NODE_HEARTBEAT_KICK_WIDTH 1
// w: axes that start, bit n: axis n; they play their queued segments from the same tick on
#define NODE_START_AXES 0x024u
#define NODE_START_AXES_MASK 0x000000ffu
#define NODE_START_AXES_SHIFT 0
#define NODE_START_AXES_WIDTH 8
// w: longest wait of the soft core; writing lets its next access to a register wait for this time,
// or until a word of the bus is received [cycle]
#define NODE_WAIT_TIME 0x028u
#define NODE_WAIT_TIME_MASK 0x00ffffffu
#define NODE_WAIT_TIME_SHIFT 0
#define NODE_WAIT_TIME_WIDTH 24
// rw: tick_count at which the axes are to be at the set-points that are committed next [tick]
#define NODE_SET_POINT_TICK 0x040u
#define NODE_SET_POINT_TICK_MASK 0xffffffffu
#define NODE_SET_POINT_TICK_SHIFT 0
#define NODE_SET_POINT_TICK_WIDTH 32
// rw: axes whose set-points are committed, bit n: axis n; writing queues those of all these axes at
// once, for set_point_tick
#define NODE_SET_POINT_COMMIT 0x044u
#define NODE_SET_POINT_COMMIT_MASK 0x000000ffu
#define NODE_SET_POINT_COMMIT_SHIFT 0
#define NODE_SET_POINT_COMMIT_WIDTH 8
// r: servo ticks since reset; wraps [tick]
#define NODE_TICK_COUNT 0x048u
#define NODE_TICK_COUNT_MASK 0xffffffffu
#define NODE_TICK_COUNT_SHIFT 0
#define NODE_TICK_COUNT_WIDTH 32
// rw: longest extrapolation of a stream whose next set-point is late [tick]
#define NODE_LATE_LIMIT 0x04cu
#define NODE_LATE_LIMIT_MASK 0x0000ffffu
#define NODE_LATE_LIMIT_SHIFT 0
#define NODE_LATE_LIMIT_WIDTH 16
// rw: requests of a host that reaches the registers; the firmware serves them, bit n of each field:
// axis n
#define NODE_AXIS_REQUESTS 0x050u
// 1: the drive is to be on
#define NODE_AXIS_REQUESTS_ENABLE_MASK 0x000000ffu
#define NODE_AXIS_REQUESTS_ENABLE_SHIFT 0
#define NODE_AXIS_REQUESTS_ENABLE_WIDTH 8
// rising: home
#define NODE_AXIS_REQUESTS_HOME_MASK 0x0000ff00u
#define NODE_AXIS_REQUESTS_HOME_SHIFT 8
#define NODE_AXIS_REQUESTS_HOME_WIDTH 8
// 1: the axis is to follow set-points; falling ends its stream
#define NODE_AXIS_REQUESTS_STREAM_MASK 0x00ff0000u
#define NODE_AXIS_REQUESTS_STREAM_SHIFT 16
#define NODE_AXIS_REQUESTS_STREAM_WIDTH 8
// rising: reset the faults
#define NODE_AXIS_REQUESTS_RESET_FAULTS_MASK 0xff000000u
#define NODE_AXIS_REQUESTS_RESET_FAULTS_SHIFT 24
#define NODE_AXIS_REQUESTS_RESET_FAULTS_WIDTH 8
// rw: axes that follow set-points, bit n: axis n; the firmware sets a bit after its checks, and a
// stream that has ended needs it to fall
#define NODE_STREAM_AXES 0x054u
#define NODE_STREAM_AXES_MASK 0x000000ffu
#define NODE_STREAM_AXES_SHIFT 0
#define NODE_STREAM_AXES_WIDTH 8
// rw: waveform that is added to the commands of an axis from the trigger to the end of a recording
#define NODE_EXCITATION 0x060u
// number of the axis
#define NODE_EXCITATION_AXIS_MASK 0x00000007u
#define NODE_EXCITATION_AXIS_SHIFT 0
#define NODE_EXCITATION_AXIS_WIDTH 3
// values of the waveform, one for each tick, 4096 at most; 0: nothing is added [tick]
#define NODE_EXCITATION_PERIOD_MASK 0x0000fff8u
#define NODE_EXCITATION_PERIOD_SHIFT 3
#define NODE_EXCITATION_PERIOD_WIDTH 13
// largest |command| with it, full scale 2^15
#define NODE_EXCITATION_LIMIT_MASK 0x7fff0000u
#define NODE_EXCITATION_LIMIT_SHIFT 16
#define NODE_EXCITATION_LIMIT_WIDTH 15
// w: value of the waveform; writing stores it
#define NODE_EXCITATION_VALUE 0x064u
// full scale 2^15
#define NODE_EXCITATION_VALUE_MASK 0x0000ffffu
#define NODE_EXCITATION_VALUE_SHIFT 0
#define NODE_EXCITATION_VALUE_WIDTH 16
// its number
#define NODE_EXCITATION_VALUE_AT_MASK 0x0fff0000u
#define NODE_EXCITATION_VALUE_AT_SHIFT 16
#define NODE_EXCITATION_VALUE_AT_WIDTH 12
// r: state of the recording
#define NODE_SCOPE_STATE 0x068u
// scope_state
#define NODE_SCOPE_STATE_PHASE_MASK 0x00000003u
#define NODE_SCOPE_STATE_PHASE_SHIFT 0
#define NODE_SCOPE_STATE_PHASE_WIDTH 2
// words that can be read
#define NODE_SCOPE_STATE_AVAILABLE_MASK 0x0007fffcu
#define NODE_SCOPE_STATE_AVAILABLE_SHIFT 2
#define NODE_SCOPE_STATE_AVAILABLE_WIDTH 17
// r: word of the recording; reading advances to the next one
#define NODE_SCOPE_WORD 0x06cu
#define NODE_SCOPE_WORD_MASK 0xffffffffu
#define NODE_SCOPE_WORD_SHIFT 0
#define NODE_SCOPE_WORD_WIDTH 32
// rw: what the recorder of ticks records
#define NODE_SCOPE 0x070u
// number of the axis of the trigger
#define NODE_SCOPE_AXIS_MASK 0x00000007u
#define NODE_SCOPE_AXIS_SHIFT 0
#define NODE_SCOPE_AXIS_WIDTH 3
// number of the last channel
#define NODE_SCOPE_LAST_MASK 0x00000700u
#define NODE_SCOPE_LAST_SHIFT 8
#define NODE_SCOPE_LAST_WIDTH 3
// tick_signal that triggers
#define NODE_SCOPE_TRIGGER_MASK 0x000f0000u
#define NODE_SCOPE_TRIGGER_SHIFT 16
#define NODE_SCOPE_TRIGGER_WIDTH 4
// tick_trigger
#define NODE_SCOPE_MODE_MASK 0x07000000u
#define NODE_SCOPE_MODE_SHIFT 24
#define NODE_SCOPE_MODE_WIDTH 3
// rw: channels 0 to 3, a byte each: tick_signal in bits 3:0, number of its axis in bits 6:4
#define NODE_SCOPE_CHANNELS_0 0x074u
#define NODE_SCOPE_CHANNELS_0_MASK 0xffffffffu
#define NODE_SCOPE_CHANNELS_0_SHIFT 0
#define NODE_SCOPE_CHANNELS_0_WIDTH 32
// rw: channels 4 to 7 in the same way
#define NODE_SCOPE_CHANNELS_4 0x078u
#define NODE_SCOPE_CHANNELS_4_MASK 0xffffffffu
#define NODE_SCOPE_CHANNELS_4_SHIFT 0
#define NODE_SCOPE_CHANNELS_4_WIDTH 32
// rw: samples of a recording
#define NODE_SCOPE_SAMPLES 0x07cu
// samples; 0: no end, and they are read while it goes on
#define NODE_SCOPE_SAMPLES_LENGTH_MASK 0x0000ffffu
#define NODE_SCOPE_SAMPLES_LENGTH_SHIFT 0
#define NODE_SCOPE_SAMPLES_LENGTH_WIDTH 16
// from sample to sample; 0 acts as 1 [tick]
#define NODE_SCOPE_SAMPLES_EVERY_MASK 0xffff0000u
#define NODE_SCOPE_SAMPLES_EVERY_SHIFT 16
#define NODE_SCOPE_SAMPLES_EVERY_WIDTH 16
// rw: where the trigger is in a recording
#define NODE_SCOPE_PLACE 0x080u
// samples from before the trigger, less than length
#define NODE_SCOPE_PLACE_EARLIER_MASK 0x0000ffffu
#define NODE_SCOPE_PLACE_EARLIER_SHIFT 0
#define NODE_SCOPE_PLACE_EARLIER_WIDTH 16
// from the trigger to the first sample, which also waits for the first value of a waveform; 0: the
// sample of the trigger [tick]
#define NODE_SCOPE_PLACE_DELAY_MASK 0xffff0000u
#define NODE_SCOPE_PLACE_DELAY_SHIFT 16
#define NODE_SCOPE_PLACE_DELAY_WIDTH 16
// rw: level of the trigger; writing begins a recording
#define NODE_SCOPE_LEVEL 0x084u
#define NODE_SCOPE_LEVEL_MASK 0xffffffffu
#define NODE_SCOPE_LEVEL_SHIFT 0
#define NODE_SCOPE_LEVEL_WIDTH 32

// RS-485 bus: 9-bit UART, address filter, frame check, watchdog
// rw: duration of one bit [1/16 cycle]
#define BUS_BIT_TIME 0x000u
#define BUS_BIT_TIME_MASK 0x000fffffu
#define BUS_BIT_TIME_SHIFT 0
#define BUS_BIT_TIME_WIDTH 20
// r: oldest received word; reading removes it from the queue
#define BUS_RECEIVE 0x004u
#define BUS_RECEIVE_DATA_MASK 0x000000ffu
#define BUS_RECEIVE_DATA_SHIFT 0
#define BUS_RECEIVE_DATA_WIDTH 8
// 9th bit: the byte is a command for this node
#define BUS_RECEIVE_COMMAND_MASK 0x00000100u
#define BUS_RECEIVE_COMMAND_SHIFT 8
#define BUS_RECEIVE_COMMAND_WIDTH 1
// last byte of a good frame, whose length and CRC-32 are right
#define BUS_RECEIVE_GOOD_MASK 0x00000200u
#define BUS_RECEIVE_GOOD_SHIFT 9
#define BUS_RECEIVE_GOOD_WIDTH 1
// 1: a word was read; 0: the queue was empty
#define BUS_RECEIVE_PRESENT_MASK 0x00000400u
#define BUS_RECEIVE_PRESENT_SHIFT 10
#define BUS_RECEIVE_PRESENT_WIDTH 1
// w: word to send; writing puts it into the queue
#define BUS_TRANSMIT 0x008u
#define BUS_TRANSMIT_DATA_MASK 0x000000ffu
#define BUS_TRANSMIT_DATA_SHIFT 0
#define BUS_TRANSMIT_DATA_WIDTH 8
#define BUS_TRANSMIT_COMMAND_MASK 0x00000100u
#define BUS_TRANSMIT_COMMAND_SHIFT 8
#define BUS_TRANSMIT_COMMAND_WIDTH 1
// r: state of the queues
#define BUS_STATE 0x00cu
#define BUS_STATE_TRANSMIT_FREE_MASK 0x000000ffu
#define BUS_STATE_TRANSMIT_FREE_SHIFT 0
#define BUS_STATE_TRANSMIT_FREE_WIDTH 8
#define BUS_STATE_SENDING_MASK 0x00000100u
#define BUS_STATE_SENDING_SHIFT 8
#define BUS_STATE_SENDING_WIDTH 1
// rw: good frames; writing clears the count
#define BUS_FRAMES_GOOD 0x010u
#define BUS_FRAMES_GOOD_MASK 0xffffffffu
#define BUS_FRAMES_GOOD_SHIFT 0
#define BUS_FRAMES_GOOD_WIDTH 32
// rw: bad frames, for this node with a wrong CRC-32 or length; writing clears the count
#define BUS_FRAMES_BAD 0x014u
#define BUS_FRAMES_BAD_MASK 0xffffffffu
#define BUS_FRAMES_BAD_SHIFT 0
#define BUS_FRAMES_BAD_WIDTH 32
// rw: characters without a stop bit; writing clears the count
#define BUS_FRAMING_ERRORS 0x018u
#define BUS_FRAMING_ERRORS_MASK 0xffffffffu
#define BUS_FRAMING_ERRORS_SHIFT 0
#define BUS_FRAMING_ERRORS_WIDTH 32
// rw: start bits that were only glitches; writing clears the count
#define BUS_START_GLITCHES 0x01cu
#define BUS_START_GLITCHES_MASK 0xffffffffu
#define BUS_START_GLITCHES_SHIFT 0
#define BUS_START_GLITCHES_WIDTH 32
// rw: words lost because the receive queue was full; writing clears the count
#define BUS_OVERRUNS 0x020u
#define BUS_OVERRUNS_MASK 0xffffffffu
#define BUS_OVERRUNS_SHIFT 0
#define BUS_OVERRUNS_WIDTH 32
// w: byte for the CRC-32 of a frame to send; writing adds it to the CRC-32: data
#define BUS_CRC_BYTE 0x024u
#define BUS_CRC_BYTE_DATA_MASK 0x000000ffu
#define BUS_CRC_BYTE_DATA_SHIFT 0
#define BUS_CRC_BYTE_DATA_WIDTH 8
// w: starts the CRC-32 again: start
#define BUS_CRC_START 0x028u
#define BUS_CRC_START_START_MASK 0x00000001u
#define BUS_CRC_START_START_SHIFT 0
#define BUS_CRC_START_START_WIDTH 1
// r: CRC-32 of the bytes so far, after the final inversion
#define BUS_CRC 0x02cu
#define BUS_CRC_MASK 0xffffffffu
#define BUS_CRC_SHIFT 0
#define BUS_CRC_WIDTH 32
// rw: longest silence of the master while a drive is enabled; 0: no limit [0.001 s]
#define BUS_WATCHDOG_TIME 0x030u
#define BUS_WATCHDOG_TIME_MASK 0x0000ffffu
#define BUS_WATCHDOG_TIME_SHIFT 0
#define BUS_WATCHDOG_TIME_WIDTH 16
// rw: breaks: the bus was low for 2 ms; writing clears the count
#define BUS_BREAKS 0x034u
#define BUS_BREAKS_MASK 0xffffffffu
#define BUS_BREAKS_SHIFT 0
#define BUS_BREAKS_WIDTH 32
// rw: transmit time-outs: the bus driver was on for 1024 bits and has been cut off; writing clears
// the count
#define BUS_TRANSMIT_TIMEOUTS 0x038u
#define BUS_TRANSMIT_TIMEOUTS_MASK 0xffffffffu
#define BUS_TRANSMIT_TIMEOUTS_SHIFT 0
#define BUS_TRANSMIT_TIMEOUTS_WIDTH 32
// rw: sync pulses: good frames for all nodes; writing clears the count
#define BUS_SYNCS 0x03cu
#define BUS_SYNCS_MASK 0xffffffffu
#define BUS_SYNCS_SHIFT 0
#define BUS_SYNCS_WIDTH 32
// rw: axes that start with sync, bit n: axis n; they play their queued segments from the next sync
// pulse on
#define BUS_SYNC_AXES 0x040u
#define BUS_SYNC_AXES_MASK 0x000000ffu
#define BUS_SYNC_AXES_SHIFT 0
#define BUS_SYNC_AXES_WIDTH 8

// peripherals: I2C, PS/2 pass-through, peer port, angle sensor, numeric display, status inputs
// r: which peripherals are built; 0: its pins are idle and its registers do nothing
#define PERIPHERALS_BUILT 0x000u
#define PERIPHERALS_BUILT_I2C_MASK 0x00000001u
#define PERIPHERALS_BUILT_I2C_SHIFT 0
#define PERIPHERALS_BUILT_I2C_WIDTH 1
#define PERIPHERALS_BUILT_PS2_MASK 0x00000002u
#define PERIPHERALS_BUILT_PS2_SHIFT 1
#define PERIPHERALS_BUILT_PS2_WIDTH 1
#define PERIPHERALS_BUILT_PEER_MASK 0x00000004u
#define PERIPHERALS_BUILT_PEER_SHIFT 2
#define PERIPHERALS_BUILT_PEER_WIDTH 1
#define PERIPHERALS_BUILT_SENSOR_MASK 0x00000008u
#define PERIPHERALS_BUILT_SENSOR_SHIFT 3
#define PERIPHERALS_BUILT_SENSOR_WIDTH 1
#define PERIPHERALS_BUILT_DISPLAY_MASK 0x00000010u
#define PERIPHERALS_BUILT_DISPLAY_SHIFT 4
#define PERIPHERALS_BUILT_DISPLAY_WIDTH 1
#define PERIPHERALS_BUILT_EDM_MASK 0x00000020u
#define PERIPHERALS_BUILT_EDM_SHIFT 5
#define PERIPHERALS_BUILT_EDM_WIDTH 1
// w: command to queue
#define PERIPHERALS_I2C 0x004u
// byte of a write
#define PERIPHERALS_I2C_DATA_MASK 0x000000ffu
#define PERIPHERALS_I2C_DATA_SHIFT 0
#define PERIPHERALS_I2C_DATA_WIDTH 8
// 0 start, 1 stop, 2 write, 3 read, 4 recover; a start may be repeated, recover clocks a stuck
// device free
#define PERIPHERALS_I2C_COMMAND_MASK 0x00000700u
#define PERIPHERALS_I2C_COMMAND_SHIFT 8
#define PERIPHERALS_I2C_COMMAND_WIDTH 3
// of a read: more bytes follow
#define PERIPHERALS_I2C_ACKNOWLEDGE_MASK 0x00000800u
#define PERIPHERALS_I2C_ACKNOWLEDGE_SHIFT 11
#define PERIPHERALS_I2C_ACKNOWLEDGE_WIDTH 1
// r: oldest result; reading removes it from the queue
#define PERIPHERALS_I2C_ANSWER 0x008u
// byte of a read
#define PERIPHERALS_I2C_ANSWER_DATA_MASK 0x000000ffu
#define PERIPHERALS_I2C_ANSWER_DATA_SHIFT 0
#define PERIPHERALS_I2C_ANSWER_DATA_WIDTH 8
// 0 ok, 1 not acknowledged, 2 bus lost or not owned, 3 no bus; without a bus a line stays low
#define PERIPHERALS_I2C_ANSWER_RESULT_MASK 0x00000300u
#define PERIPHERALS_I2C_ANSWER_RESULT_SHIFT 8
#define PERIPHERALS_I2C_ANSWER_RESULT_WIDTH 2
// 1: a word was read; 0: the queue was empty
#define PERIPHERALS_I2C_ANSWER_PRESENT_MASK 0x00000400u
#define PERIPHERALS_I2C_ANSWER_PRESENT_SHIFT 10
#define PERIPHERALS_I2C_ANSWER_PRESENT_WIDTH 1
// r: state of the I2C bus
#define PERIPHERALS_I2C_STATE 0x00cu
// commands that can be queued, 128 at most; the queue of results holds as many, more are lost
#define PERIPHERALS_I2C_STATE_FREE_MASK 0x000000ffu
#define PERIPHERALS_I2C_STATE_FREE_SHIFT 0
#define PERIPHERALS_I2C_STATE_FREE_WIDTH 8
// a command is in work or waits
#define PERIPHERALS_I2C_STATE_BUSY_MASK 0x00000100u
#define PERIPHERALS_I2C_STATE_BUSY_SHIFT 8
#define PERIPHERALS_I2C_STATE_BUSY_WIDTH 1
// the master owns the bus, from start to stop
#define PERIPHERALS_I2C_STATE_OWNED_MASK 0x00000200u
#define PERIPHERALS_I2C_STATE_OWNED_SHIFT 9
#define PERIPHERALS_I2C_STATE_OWNED_WIDTH 1
// level of the line
#define PERIPHERALS_I2C_STATE_SCL_MASK 0x00000400u
#define PERIPHERALS_I2C_STATE_SCL_SHIFT 10
#define PERIPHERALS_I2C_STATE_SCL_WIDTH 1
// level of the line
#define PERIPHERALS_I2C_STATE_SDA_MASK 0x00000800u
#define PERIPHERALS_I2C_STATE_SDA_SHIFT 11
#define PERIPHERALS_I2C_STATE_SDA_WIDTH 1
// rw: silence of keyboard and machine before an injection; less than 20 acts as 20 [0.001 s]
#define PERIPHERALS_PS2_IDLE 0x010u
#define PERIPHERALS_PS2_IDLE_MASK 0x0000ffffu
#define PERIPHERALS_PS2_IDLE_SHIFT 0
#define PERIPHERALS_PS2_IDLE_WIDTH 16
// w: scan code to inject; a sequence holds the keyboard from its first byte to its last, so queue
// it completely
#define PERIPHERALS_PS2_INJECT 0x014u
// scan code
#define PERIPHERALS_PS2_INJECT_DATA_MASK 0x000000ffu
#define PERIPHERALS_PS2_INJECT_DATA_SHIFT 0
#define PERIPHERALS_PS2_INJECT_DATA_WIDTH 8
// 1: last one of its sequence
#define PERIPHERALS_PS2_INJECT_LAST_MASK 0x00000100u
#define PERIPHERALS_PS2_INJECT_LAST_SHIFT 8
#define PERIPHERALS_PS2_INJECT_LAST_WIDTH 1
// rw: state of PS/2; everything queued has been sent when free is 32, and injecting and busy are 0
#define PERIPHERALS_PS2_STATE 0x018u
// scan codes that can be queued, 32 at most
#define PERIPHERALS_PS2_STATE_FREE_MASK 0x0000003fu
#define PERIPHERALS_PS2_STATE_FREE_SHIFT 0
#define PERIPHERALS_PS2_STATE_FREE_WIDTH 6
// a sequence is being injected
#define PERIPHERALS_PS2_STATE_INJECTING_MASK 0x00000040u
#define PERIPHERALS_PS2_STATE_INJECTING_SHIFT 6
#define PERIPHERALS_PS2_STATE_INJECTING_WIDTH 1
// a frame is on its way on either side
#define PERIPHERALS_PS2_STATE_BUSY_MASK 0x00000080u
#define PERIPHERALS_PS2_STATE_BUSY_SHIFT 7
#define PERIPHERALS_PS2_STATE_BUSY_WIDTH 1
// removes what is queued; a sequence that has begun is completed
#define PERIPHERALS_PS2_STATE_DROP_MASK 0x00000100u
#define PERIPHERALS_PS2_STATE_DROP_SHIFT 8
#define PERIPHERALS_PS2_STATE_DROP_WIDTH 1
// rw: typed bytes: they answer no command; writing clears the count
#define PERIPHERALS_PS2_TYPED 0x01cu
#define PERIPHERALS_PS2_TYPED_MASK 0x0000ffffu
#define PERIPHERALS_PS2_TYPED_SHIFT 0
#define PERIPHERALS_PS2_TYPED_WIDTH 16
// rw: errors of PS/2; writing clears all counts
#define PERIPHERALS_PS2_ERRORS 0x020u
// damaged bytes of the keyboard
#define PERIPHERALS_PS2_ERRORS_KEYBOARD_DAMAGED_MASK 0x000000ffu
#define PERIPHERALS_PS2_ERRORS_KEYBOARD_DAMAGED_SHIFT 0
#define PERIPHERALS_PS2_ERRORS_KEYBOARD_DAMAGED_WIDTH 8
// damaged commands of the machine
#define PERIPHERALS_PS2_ERRORS_COMMAND_DAMAGED_MASK 0x0000ff00u
#define PERIPHERALS_PS2_ERRORS_COMMAND_DAMAGED_SHIFT 8
#define PERIPHERALS_PS2_ERRORS_COMMAND_DAMAGED_WIDTH 8
// commands that the keyboard did not take
#define PERIPHERALS_PS2_ERRORS_UNSENT_MASK 0x00ff0000u
#define PERIPHERALS_PS2_ERRORS_UNSENT_SHIFT 16
#define PERIPHERALS_PS2_ERRORS_UNSENT_WIDTH 8
// frames that the machine cut short
#define PERIPHERALS_PS2_ERRORS_ABORTED_MASK 0xff000000u
#define PERIPHERALS_PS2_ERRORS_ABORTED_SHIFT 24
#define PERIPHERALS_PS2_ERRORS_ABORTED_WIDTH 8
// rw: pulses of less than 1 us on the lines; writing clears the count
#define PERIPHERALS_PS2_GLITCHES 0x024u
#define PERIPHERALS_PS2_GLITCHES_MASK 0x000000ffu
#define PERIPHERALS_PS2_GLITCHES_SHIFT 0
#define PERIPHERALS_PS2_GLITCHES_WIDTH 8
// rw: duration of one bit of the peer port [1/16 cycle]
#define PERIPHERALS_PEER_BIT_TIME 0x028u
#define PERIPHERALS_PEER_BIT_TIME_MASK 0x000fffffu
#define PERIPHERALS_PEER_BIT_TIME_SHIFT 0
#define PERIPHERALS_PEER_BIT_TIME_WIDTH 20
// r: oldest received byte; reading removes it from the queue of 64
#define PERIPHERALS_PEER_RECEIVE 0x02cu
#define PERIPHERALS_PEER_RECEIVE_DATA_MASK 0x000000ffu
#define PERIPHERALS_PEER_RECEIVE_DATA_SHIFT 0
#define PERIPHERALS_PEER_RECEIVE_DATA_WIDTH 8
// 1: a word was read; 0: the queue was empty
#define PERIPHERALS_PEER_RECEIVE_PRESENT_MASK 0x00000100u
#define PERIPHERALS_PEER_RECEIVE_PRESENT_SHIFT 8
#define PERIPHERALS_PEER_RECEIVE_PRESENT_WIDTH 1
// w: byte to send; writing puts it into the queue
#define PERIPHERALS_PEER_TRANSMIT 0x030u
#define PERIPHERALS_PEER_TRANSMIT_MASK 0x000000ffu
#define PERIPHERALS_PEER_TRANSMIT_SHIFT 0
#define PERIPHERALS_PEER_TRANSMIT_WIDTH 8
// r: state of the peer port
#define PERIPHERALS_PEER_STATE 0x034u
// bytes that can be queued, 64 at most
#define PERIPHERALS_PEER_STATE_TRANSMIT_FREE_MASK 0x0000007fu
#define PERIPHERALS_PEER_STATE_TRANSMIT_FREE_SHIFT 0
#define PERIPHERALS_PEER_STATE_TRANSMIT_FREE_WIDTH 7
#define PERIPHERALS_PEER_STATE_SENDING_MASK 0x00000080u
#define PERIPHERALS_PEER_STATE_SENDING_SHIFT 7
#define PERIPHERALS_PEER_STATE_SENDING_WIDTH 1
// rw: errors of the peer port; writing clears all counts
#define PERIPHERALS_PEER_ERRORS 0x038u
// characters without a stop bit
#define PERIPHERALS_PEER_ERRORS_FRAMING_MASK 0x000000ffu
#define PERIPHERALS_PEER_ERRORS_FRAMING_SHIFT 0
#define PERIPHERALS_PEER_ERRORS_FRAMING_WIDTH 8
// bytes lost because the receive queue was full
#define PERIPHERALS_PEER_ERRORS_OVERRUNS_MASK 0x0000ff00u
#define PERIPHERALS_PEER_ERRORS_OVERRUNS_SHIFT 8
#define PERIPHERALS_PEER_ERRORS_OVERRUNS_WIDTH 8
// rw: duration of one bit of the sensor [1/16 cycle]
#define PERIPHERALS_SENSOR_BIT_TIME 0x03cu
#define PERIPHERALS_SENSOR_BIT_TIME_MASK 0x000fffffu
#define PERIPHERALS_SENSOR_BIT_TIME_SHIFT 0
#define PERIPHERALS_SENSOR_BIT_TIME_WIDTH 20
// rw: longest pause between the ends of two bytes of a frame [cycle]
#define PERIPHERALS_SENSOR_GAP 0x040u
#define PERIPHERALS_SENSOR_GAP_MASK 0x00ffffffu
#define PERIPHERALS_SENSOR_GAP_SHIFT 0
#define PERIPHERALS_SENSOR_GAP_WIDTH 24
// rw: time without a good frame after which the sensor is stale; 0: never [cycle]
#define PERIPHERALS_SENSOR_STALE_AFTER 0x044u
#define PERIPHERALS_SENSOR_STALE_AFTER_MASK 0xffffffffu
#define PERIPHERALS_SENSOR_STALE_AFTER_SHIFT 0
#define PERIPHERALS_SENSOR_STALE_AFTER_WIDTH 32
// r: last good frame; low word: angle, 2^32 per turn; high word: its age at the read in cycles,
// which stops at its largest value
#define PERIPHERALS_SENSOR_READING 0x048u
#define PERIPHERALS_SENSOR_READING_LOW 0x048u
#define PERIPHERALS_SENSOR_READING_HIGH 0x04cu
#define PERIPHERALS_SENSOR_READING_WIDTH 64
// r: the last good frame
#define PERIPHERALS_SENSOR_STATE 0x050u
// its sequence number; read it before sensor_reading
#define PERIPHERALS_SENSOR_STATE_SEQUENCE_NUMBER_MASK 0x000000ffu
#define PERIPHERALS_SENSOR_STATE_SEQUENCE_NUMBER_SHIFT 0
#define PERIPHERALS_SENSOR_STATE_SEQUENCE_NUMBER_WIDTH 8
// stale: no frame yet, or older than sensor_stale_after
#define PERIPHERALS_SENSOR_STATE_STALE_MASK 0x00000100u
#define PERIPHERALS_SENSOR_STATE_STALE_SHIFT 8
#define PERIPHERALS_SENSOR_STATE_STALE_WIDTH 1
// rw: missing frames; each count stops at its largest value
#define PERIPHERALS_SENSOR_ERRORS 0x054u
// frames with a wrong CRC-16
#define PERIPHERALS_SENSOR_ERRORS_CRC_MASK 0x000000ffu
#define PERIPHERALS_SENSOR_ERRORS_CRC_SHIFT 0
#define PERIPHERALS_SENSOR_ERRORS_CRC_WIDTH 8
// broken frames, with a pause or a framing error inside
#define PERIPHERALS_SENSOR_ERRORS_BROKEN_MASK 0x0000ff00u
#define PERIPHERALS_SENSOR_ERRORS_BROKEN_SHIFT 8
#define PERIPHERALS_SENSOR_ERRORS_BROKEN_WIDTH 8
// missed frames, by the gaps in the sequence numbers; damaged frames are included
#define PERIPHERALS_SENSOR_ERRORS_MISSED_MASK 0x00ff0000u
#define PERIPHERALS_SENSOR_ERRORS_MISSED_SHIFT 16
#define PERIPHERALS_SENSOR_ERRORS_MISSED_WIDTH 8
// clears the three counts
#define PERIPHERALS_SENSOR_ERRORS_CLEAR_MASK 0x01000000u
#define PERIPHERALS_SENSOR_ERRORS_CLEAR_SHIFT 24
#define PERIPHERALS_SENSOR_ERRORS_CLEAR_WIDTH 1
// rw: good frames; writing clears the count
#define PERIPHERALS_SENSOR_FRAMES 0x058u
#define PERIPHERALS_SENSOR_FRAMES_MASK 0x0000ffffu
#define PERIPHERALS_SENSOR_FRAMES_SHIFT 0
#define PERIPHERALS_SENSOR_FRAMES_WIDTH 16
// w: word to the display: register in the high byte, value in the low one
#define PERIPHERALS_DISPLAY 0x05cu
#define PERIPHERALS_DISPLAY_MASK 0x0000ffffu
#define PERIPHERALS_DISPLAY_SHIFT 0
#define PERIPHERALS_DISPLAY_WIDTH 16
// r: state of the display
#define PERIPHERALS_DISPLAY_STATE 0x060u
// words that can be queued, 16 at most
#define PERIPHERALS_DISPLAY_STATE_FREE_MASK 0x0000001fu
#define PERIPHERALS_DISPLAY_STATE_FREE_SHIFT 0
#define PERIPHERALS_DISPLAY_STATE_FREE_WIDTH 5
#define PERIPHERALS_DISPLAY_STATE_SENDING_MASK 0x00000020u
#define PERIPHERALS_DISPLAY_STATE_SENDING_SHIFT 5
#define PERIPHERALS_DISPLAY_STATE_SENDING_WIDTH 1
// rw: time that a status input must be stable; the change passes at most 1 ms later [0.001 s]
#define PERIPHERALS_EDM_FILTER 0x064u
#define PERIPHERALS_EDM_FILTER_MASK 0x0000ffffu
#define PERIPHERALS_EDM_FILTER_SHIFT 0
#define PERIPHERALS_EDM_FILTER_WIDTH 16
// rw: status inputs, filtered, and changes since they were cleared; write 1 to clear
#define PERIPHERALS_EDM_STATUS 0x068u
// bit n: level of input n
#define PERIPHERALS_EDM_STATUS_INPUTS_MASK 0x00000003u
#define PERIPHERALS_EDM_STATUS_INPUTS_SHIFT 0
#define PERIPHERALS_EDM_STATUS_INPUTS_WIDTH 2
// input 0 went high
#define PERIPHERALS_EDM_STATUS_ROSE_0_MASK 0x00000004u
#define PERIPHERALS_EDM_STATUS_ROSE_0_SHIFT 2
#define PERIPHERALS_EDM_STATUS_ROSE_0_WIDTH 1
// input 1 went high
#define PERIPHERALS_EDM_STATUS_ROSE_1_MASK 0x00000008u
#define PERIPHERALS_EDM_STATUS_ROSE_1_SHIFT 3
#define PERIPHERALS_EDM_STATUS_ROSE_1_WIDTH 1
// input 0 went low
#define PERIPHERALS_EDM_STATUS_FELL_0_MASK 0x00000010u
#define PERIPHERALS_EDM_STATUS_FELL_0_SHIFT 4
#define PERIPHERALS_EDM_STATUS_FELL_0_WIDTH 1
// input 1 went low
#define PERIPHERALS_EDM_STATUS_FELL_1_MASK 0x00000020u
#define PERIPHERALS_EDM_STATUS_FELL_1_SHIFT 5
#define PERIPHERALS_EDM_STATUS_FELL_1_WIDTH 1

// real-time link: packets of process data, in hardware (docs/link.md)
// w: number of the session, which the host has drawn; change it, and all below, while `enable` is 0
#define LINK_SESSION 0x000u
#define LINK_SESSION_MASK 0x00ffffffu
#define LINK_SESSION_SHIFT 0
#define LINK_SESSION_WIDTH 24
// w: entries of the lists
#define LINK_LISTS 0x004u
// values that a request writes, at most 121
#define LINK_LISTS_WRITES_MASK 0x0000007fu
#define LINK_LISTS_WRITES_SHIFT 0
#define LINK_LISTS_WRITES_WIDTH 7
// values that a reply has, at most 121
#define LINK_LISTS_READS_MASK 0x00007f00u
#define LINK_LISTS_READS_SHIFT 8
#define LINK_LISTS_READS_WIDTH 7
// w: number of the entry of the lists that `entry` stores
#define LINK_ENTRY_NUMBER 0x008u
#define LINK_ENTRY_NUMBER_MASK 0x0000007fu
#define LINK_ENTRY_NUMBER_SHIFT 0
#define LINK_ENTRY_NUMBER_WIDTH 7
// w: entry of the lists; writing stores it while the link is off and not busy
#define LINK_ENTRY 0x00cu
// byte address of the register that is written
#define LINK_ENTRY_WRITE_MASK 0x0000ffffu
#define LINK_ENTRY_WRITE_SHIFT 0
#define LINK_ENTRY_WRITE_WIDTH 16
// byte address of the register that is read
#define LINK_ENTRY_READ_MASK 0xffff0000u
#define LINK_ENTRY_READ_SHIFT 16
#define LINK_ENTRY_READ_WIDTH 16
// w: largest difference between the time in a request and that of the node; 0: not checked [cycle]
#define LINK_TIME_WINDOW 0x010u
#define LINK_TIME_WINDOW_MASK 0x00ffffffu
#define LINK_TIME_WINDOW_SHIFT 0
#define LINK_TIME_WINDOW_WIDTH 24
// w: longest time without a good request while the link is on; 0: no limit [0.001 s]
#define LINK_WATCHDOG_TIME 0x014u
#define LINK_WATCHDOG_TIME_MASK 0x0000ffffu
#define LINK_WATCHDOG_TIME_SHIFT 0
#define LINK_WATCHDOG_TIME_WIDTH 16
// w: duration of one bit of the serial line; at least 4 cycles [1/16 cycle]
#define LINK_BIT_TIME 0x018u
#define LINK_BIT_TIME_MASK 0x000fffffu
#define LINK_BIT_TIME_SHIFT 0
#define LINK_BIT_TIME_WIDTH 20
// w: switches the link on; while it is 0, every packet is refused
#define LINK_ENABLE 0x01cu
#define LINK_ENABLE_MASK 0x00000001u
#define LINK_ENABLE_SHIFT 0
#define LINK_ENABLE_WIDTH 1
// r: state of the link; all bits are 0 in a node without one
#define LINK_STATE 0x020u
// the node has a link
#define LINK_STATE_BUILT_MASK 0x00000001u
#define LINK_STATE_BUILT_SHIFT 0
#define LINK_STATE_BUILT_WIDTH 1
// the link is on
#define LINK_STATE_ON_MASK 0x00000002u
#define LINK_STATE_ON_SHIFT 1
#define LINK_STATE_ON_WIDTH 1
// a request is being played or answered
#define LINK_STATE_BUSY_MASK 0x00000004u
#define LINK_STATE_BUSY_SHIFT 2
#define LINK_STATE_BUSY_WIDTH 1
// no good request for `watchdog_time`
#define LINK_STATE_EXPIRED_MASK 0x00000008u
#define LINK_STATE_EXPIRED_SHIFT 3
#define LINK_STATE_EXPIRED_WIDTH 1
// session of the host that has switched the link on
#define LINK_STATE_SESSION_MASK 0xffffff00u
#define LINK_STATE_SESSION_SHIFT 8
#define LINK_STATE_SESSION_WIDTH 24
// r: refused packets; each count wraps at 256
#define LINK_REFUSED 0x024u
#define LINK_REFUSED_DAMAGED_MASK 0x000000ffu
#define LINK_REFUSED_DAMAGED_SHIFT 0
#define LINK_REFUSED_DAMAGED_WIDTH 8
#define LINK_REFUSED_FOREIGN_MASK 0x0000ff00u
#define LINK_REFUSED_FOREIGN_SHIFT 8
#define LINK_REFUSED_FOREIGN_WIDTH 8
#define LINK_REFUSED_WRONG_LENGTH_MASK 0x00ff0000u
#define LINK_REFUSED_WRONG_LENGTH_SHIFT 16
#define LINK_REFUSED_WRONG_LENGTH_WIDTH 8
#define LINK_REFUSED_REPLAYED_MASK 0xff000000u
#define LINK_REFUSED_REPLAYED_SHIFT 24
#define LINK_REFUSED_REPLAYED_WIDTH 8
// r: packets refused for their moment; each count wraps at 256
#define LINK_REFUSED_NOW 0x028u
#define LINK_REFUSED_NOW_OUT_OF_TIME_MASK 0x000000ffu
#define LINK_REFUSED_NOW_OUT_OF_TIME_SHIFT 0
#define LINK_REFUSED_NOW_OUT_OF_TIME_WIDTH 8
#define LINK_REFUSED_NOW_BUSY_MASK 0x0000ff00u
#define LINK_REFUSED_NOW_BUSY_SHIFT 8
#define LINK_REFUSED_NOW_BUSY_WIDTH 8
// rw: losses on the carrier: serial, bytes without a stop bit; SPI, transfers that ended within the
// request or the reply; 0 for UDP, where a damaged datagram counts as a refused packet. Writing
// clears the count
#define LINK_FRAMING_ERRORS 0x02cu
#define LINK_FRAMING_ERRORS_MASK 0x0000ffffu
#define LINK_FRAMING_ERRORS_SHIFT 0
#define LINK_FRAMING_ERRORS_WIDTH 16
// w: PLL: time from one request to the next, as the host has set it, at least 2048 cycles; 0: off.
// Change it while `enable` is 0 [cycle]
#define LINK_PLL_PERIOD 0x030u
#define LINK_PLL_PERIOD_MASK 0x000fffffu
#define LINK_PLL_PERIOD_SHIFT 0
#define LINK_PLL_PERIOD_WIDTH 20
// w: PLL: time from a capture of the read list to the expected request, at most 3/8 of
// `pll_period`. Change it while `enable` is 0 [cycle]
#define LINK_CAPTURE_LEAD 0x034u
#define LINK_CAPTURE_LEAD_MASK 0x0007ffffu
#define LINK_CAPTURE_LEAD_SHIFT 0
#define LINK_CAPTURE_LEAD_WIDTH 19
// r: state of the PLL; all bits are 0 in a node without one
#define LINK_PLL_STATE 0x038u
// the link has a PLL
#define LINK_PLL_STATE_BUILT_MASK 0x00000001u
#define LINK_PLL_STATE_BUILT_SHIFT 0
#define LINK_PLL_STATE_BUILT_WIDTH 1
// it is locked: a capture is made before each expected request
#define LINK_PLL_STATE_LOCKED_MASK 0x00000002u
#define LINK_PLL_STATE_LOCKED_SHIFT 1
#define LINK_PLL_STATE_LOCKED_WIDTH 1
// as a value of a reply: it was read for a capture, not when the request came
#define LINK_PLL_STATE_CAPTURED_MASK 0x00000004u
#define LINK_PLL_STATE_CAPTURED_SHIFT 2
#define LINK_PLL_STATE_CAPTURED_WIDTH 1
// how much later than expected the last request came; 0 at the first one [cycle]
#define LINK_PLL_STATE_PHASE_ERROR_MASK 0xffffff00u
#define LINK_PLL_STATE_PHASE_ERROR_SHIFT 8
#define LINK_PLL_STATE_PHASE_ERROR_WIDTH 24
// r: time of the node, low word, when the reading of the read list began; 0 in a node without a PLL
// [cycle]
#define LINK_READ_TIME 0x03cu
#define LINK_READ_TIME_MASK 0xffffffffu
#define LINK_READ_TIME_SHIFT 0
#define LINK_READ_TIME_WIDTH 32

// axis: position, servo, profile, drive-enable interlock
// rw: requests; the interlock decides; a field of two bits holds if both are 1, so no single
// flipped bit switches on
#define AXIS_CONTROL 0x000u
// 3 requests the drive; the interlock grants it only without a latched fault
#define AXIS_CONTROL_ENABLE_MASK 0x00000003u
#define AXIS_CONTROL_ENABLE_SHIFT 0
#define AXIS_CONTROL_ENABLE_WIDTH 2
// 1: the servo commands the drive, 0: open_command does
#define AXIS_CONTROL_CLOSED_LOOP_MASK 0x00000004u
#define AXIS_CONTROL_CLOSED_LOOP_SHIFT 2
#define AXIS_CONTROL_CLOSED_LOOP_WIDTH 1
// homing; 3: a limit switch only blocks motion towards it, else it is a fault
#define AXIS_CONTROL_HOMING_MASK 0x00000018u
#define AXIS_CONTROL_HOMING_SHIFT 3
#define AXIS_CONTROL_HOMING_WIDTH 2
// 1: the fine stage holds; the main command keeps its value. 0: the fine stage returns to its
// middle
#define AXIS_CONTROL_FINE_MASK 0x00000020u
#define AXIS_CONTROL_FINE_SHIFT 5
#define AXIS_CONTROL_FINE_WIDTH 1
// w: strobes
#define AXIS_STROBES 0x004u
// clears latched faults whose cause is gone; needs enable = 0
#define AXIS_STROBES_RESET_FAULTS_MASK 0x00000001u
#define AXIS_STROBES_RESET_FAULTS_SHIFT 0
#define AXIS_STROBES_RESET_FAULTS_WIDTH 1
// sets the target to the position, and empties the profile queue
#define AXIS_STROBES_SET_TARGET_TO_POSITION_MASK 0x00000002u
#define AXIS_STROBES_SET_TARGET_TO_POSITION_SHIFT 1
#define AXIS_STROBES_SET_TARGET_TO_POSITION_WIDTH 1
// plays the queued segments
#define AXIS_STROBES_START_MASK 0x00000004u
#define AXIS_STROBES_START_SHIFT 2
#define AXIS_STROBES_START_WIDTH 1
// controlled stop: empties the queue, and stops the target within stop_deceleration and stop_jerk
#define AXIS_STROBES_CONTROLLED_STOP_MASK 0x00000008u
#define AXIS_STROBES_CONTROLLED_STOP_SHIFT 3
#define AXIS_STROBES_CONTROLLED_STOP_WIDTH 1
// plays the queued segments when the time stamp reaches start_at
#define AXIS_STROBES_ARM_MASK 0x00000010u
#define AXIS_STROBES_ARM_SHIFT 4
#define AXIS_STROBES_ARM_WIDTH 1
// r: state of the axis
#define AXIS_STATE 0x008u
// the drive is on
#define AXIS_STATE_ENABLED_MASK 0x00000001u
#define AXIS_STATE_ENABLED_SHIFT 0
#define AXIS_STATE_ENABLED_WIDTH 1
// switch at the low end, 1: pressed; filtered
#define AXIS_STATE_LIMIT_LOW_MASK 0x00000002u
#define AXIS_STATE_LIMIT_LOW_SHIFT 1
#define AXIS_STATE_LIMIT_LOW_WIDTH 1
// switch at the high end, 1: pressed; filtered
#define AXIS_STATE_LIMIT_HIGH_MASK 0x00000004u
#define AXIS_STATE_LIMIT_HIGH_SHIFT 2
#define AXIS_STATE_LIMIT_HIGH_WIDTH 1
// emergency stop, 1: pressed
#define AXIS_STATE_ESTOP_MASK 0x00000008u
#define AXIS_STATE_ESTOP_SHIFT 3
#define AXIS_STATE_ESTOP_WIDTH 1
// drive fault, 1: the drive reports a fault
#define AXIS_STATE_DRIVE_FAULT_MASK 0x00000010u
#define AXIS_STATE_DRIVE_FAULT_SHIFT 4
#define AXIS_STATE_DRIVE_FAULT_WIDTH 1
// a profile is being played
#define AXIS_STATE_MOVING_MASK 0x00000020u
#define AXIS_STATE_MOVING_SHIFT 5
#define AXIS_STATE_MOVING_WIDTH 1
// the command is at its limit
#define AXIS_STATE_SATURATED_MASK 0x00000040u
#define AXIS_STATE_SATURATED_SHIFT 6
#define AXIS_STATE_SATURATED_WIDTH 1
// segments that can be queued
#define AXIS_STATE_QUEUE_FREE_MASK 0x00000f80u
#define AXIS_STATE_QUEUE_FREE_SHIFT 7
#define AXIS_STATE_QUEUE_FREE_WIDTH 5
// a profile waits for start_at
#define AXIS_STATE_ARMED_MASK 0x00001000u
#define AXIS_STATE_ARMED_SHIFT 12
#define AXIS_STATE_ARMED_WIDTH 1
// fine stage at its limit
#define AXIS_STATE_FINE_SATURATED_MASK 0x00002000u
#define AXIS_STATE_FINE_SATURATED_SHIFT 13
#define AXIS_STATE_FINE_SATURATED_WIDTH 1
// HAS_CAPTURE: levels of the touch probes, 0 and 1
#define AXIS_STATE_PROBE_MASK 0x0000c000u
#define AXIS_STATE_PROBE_SHIFT 14
#define AXIS_STATE_PROBE_WIDTH 2
// r: latched faults
#define AXIS_FAULTS 0x00cu
#define AXIS_FAULTS_LIMIT_LOW_MASK 0x00000001u
#define AXIS_FAULTS_LIMIT_LOW_SHIFT 0
#define AXIS_FAULTS_LIMIT_LOW_WIDTH 1
#define AXIS_FAULTS_LIMIT_HIGH_MASK 0x00000002u
#define AXIS_FAULTS_LIMIT_HIGH_SHIFT 1
#define AXIS_FAULTS_LIMIT_HIGH_WIDTH 1
#define AXIS_FAULTS_ESTOP_MASK 0x00000004u
#define AXIS_FAULTS_ESTOP_SHIFT 2
#define AXIS_FAULTS_ESTOP_WIDTH 1
#define AXIS_FAULTS_FOLLOWING_ERROR_MASK 0x00000008u
#define AXIS_FAULTS_FOLLOWING_ERROR_SHIFT 3
#define AXIS_FAULTS_FOLLOWING_ERROR_WIDTH 1
#define AXIS_FAULTS_ENCODER_MASK 0x00000010u
#define AXIS_FAULTS_ENCODER_SHIFT 4
#define AXIS_FAULTS_ENCODER_WIDTH 1
#define AXIS_FAULTS_BUS_WATCHDOG_MASK 0x00000020u
#define AXIS_FAULTS_BUS_WATCHDOG_SHIFT 5
#define AXIS_FAULTS_BUS_WATCHDOG_WIDTH 1
#define AXIS_FAULTS_DRIVE_MASK 0x00000040u
#define AXIS_FAULTS_DRIVE_SHIFT 6
#define AXIS_FAULTS_DRIVE_WIDTH 1
#define AXIS_FAULTS_CPU_MASK 0x00000080u
#define AXIS_FAULTS_CPU_SHIFT 7
#define AXIS_FAULTS_CPU_WIDTH 1
#define AXIS_FAULTS_PROFILE_UNDERRUN_MASK 0x00000100u
#define AXIS_FAULTS_PROFILE_UNDERRUN_SHIFT 8
#define AXIS_FAULTS_PROFILE_UNDERRUN_WIDTH 1
#define AXIS_FAULTS_STEP_OVERRUN_MASK 0x00000200u
#define AXIS_FAULTS_STEP_OVERRUN_SHIFT 9
#define AXIS_FAULTS_STEP_OVERRUN_WIDTH 1
#define AXIS_FAULTS_SERVO_OVERRUN_MASK 0x00000400u
#define AXIS_FAULTS_SERVO_OVERRUN_SHIFT 10
#define AXIS_FAULTS_SERVO_OVERRUN_WIDTH 1
#define AXIS_FAULTS_SAMPLE_OVERRUN_MASK 0x00000800u
#define AXIS_FAULTS_SAMPLE_OVERRUN_SHIFT 11
#define AXIS_FAULTS_SAMPLE_OVERRUN_WIDTH 1
#define AXIS_FAULTS_LINK_WATCHDOG_MASK 0x00001000u
#define AXIS_FAULTS_LINK_WATCHDOG_SHIFT 12
#define AXIS_FAULTS_LINK_WATCHDOG_WIDTH 1
// r: causes present now, same bits as faults
#define AXIS_CAUSES_NOW 0x010u
#define AXIS_CAUSES_NOW_MASK 0x00001fffu
#define AXIS_CAUSES_NOW_SHIFT 0
#define AXIS_CAUSES_NOW_WIDTH 13
// r: cause that came first, same bits as faults; one bit
#define AXIS_FIRST_FAULT 0x014u
#define AXIS_FIRST_FAULT_MASK 0x00001fffu
#define AXIS_FIRST_FAULT_SHIFT 0
#define AXIS_FIRST_FAULT_WIDTH 13
// r: position when the first fault was latched [1/65536 period]
#define AXIS_FAULT_POSITION 0x018u
#define AXIS_FAULT_POSITION_LOW 0x018u
#define AXIS_FAULT_POSITION_HIGH 0x01cu
#define AXIS_FAULT_POSITION_WIDTH 48
// rw: largest |target - position| in closed loop; 0: not checked [1/65536 period]
#define AXIS_FOLLOWING_LIMIT 0x020u
#define AXIS_FOLLOWING_LIMIT_MASK 0xffffffffu
#define AXIS_FOLLOWING_LIMIT_SHIFT 0
#define AXIS_FOLLOWING_LIMIT_WIDTH 32
// rw: the axis as the firmware has it, for a host that reaches the registers
#define AXIS_SUPERVISION 0x024u
// state of the axis, as in the reply of status
#define AXIS_SUPERVISION_STATE_MASK 0x0000000fu
#define AXIS_SUPERVISION_STATE_SHIFT 0
#define AXIS_SUPERVISION_STATE_WIDTH 4
// 1: homed
#define AXIS_SUPERVISION_HOMED_MASK 0x00000010u
#define AXIS_SUPERVISION_HOMED_SHIFT 4
#define AXIS_SUPERVISION_HOMED_WIDTH 1
// how the last motion has ended, a cause of the bus
#define AXIS_SUPERVISION_ENDED_MASK 0x0000ff00u
#define AXIS_SUPERVISION_ENDED_SHIFT 8
#define AXIS_SUPERVISION_ENDED_WIDTH 8
// why the last request of axis_requests was refused, a cause of the bus; 0: it was not
#define AXIS_SUPERVISION_REFUSAL_MASK 0x00ff0000u
#define AXIS_SUPERVISION_REFUSAL_SHIFT 16
#define AXIS_SUPERVISION_REFUSAL_WIDTH 8
// r: position [1/65536 period]
#define AXIS_POSITION 0x028u
#define AXIS_POSITION_LOW 0x028u
#define AXIS_POSITION_HIGH 0x02cu
#define AXIS_POSITION_WIDTH 48
// r: target of the servo [1/65536 period]
#define AXIS_TARGET 0x030u
#define AXIS_TARGET_LOW 0x030u
#define AXIS_TARGET_HIGH 0x034u
#define AXIS_TARGET_WIDTH 48
// r: velocity [1/65536 period/tick]
#define AXIS_VELOCITY 0x038u
#define AXIS_VELOCITY_MASK 0xffffffffu
#define AXIS_VELOCITY_SHIFT 0
#define AXIS_VELOCITY_WIDTH 32
// rw: shift of the origin: position and target both grow by this many whole periods, in one cycle
// [period]
#define AXIS_SHIFT_ORIGIN 0x03cu
#define AXIS_SHIFT_ORIGIN_MASK 0xffffffffu
#define AXIS_SHIFT_ORIGIN_SHIFT 0
#define AXIS_SHIFT_ORIGIN_WIDTH 32
// rw: crossing of the absolute zero
#define AXIS_ZERO_CROSSING 0x040u
// crossed going up; write 1 to clear
#define AXIS_ZERO_CROSSING_UP_MASK 0x00000001u
#define AXIS_ZERO_CROSSING_UP_SHIFT 0
#define AXIS_ZERO_CROSSING_UP_WIDTH 1
// crossed going down; write 1 to clear
#define AXIS_ZERO_CROSSING_DOWN_MASK 0x00000002u
#define AXIS_ZERO_CROSSING_DOWN_SHIFT 1
#define AXIS_ZERO_CROSSING_DOWN_WIDTH 1
// rw: settings of the input filters
#define AXIS_SENSING 0x044u
// samples in a row that a, b and z must have the same level; one in each edge_filter.skip + 1
// cycles [sample]
#define AXIS_SENSING_DEGLITCH_MASK 0x0000003fu
#define AXIS_SENSING_DEGLITCH_SHIFT 0
#define AXIS_SENSING_DEGLITCH_WIDTH 6
// outlier filter: largest step between two samples, full scale 2^(W-1); 0: off
#define AXIS_SENSING_OUTLIER_STEP_MASK 0x00ff0000u
#define AXIS_SENSING_OUTLIER_STEP_SHIFT 16
#define AXIS_SENSING_OUTLIER_STEP_WIDTH 8
// most samples held in a row, by the outlier filter
#define AXIS_SENSING_OUTLIER_HOLD_MASK 0xff000000u
#define AXIS_SENSING_OUTLIER_HOLD_SHIFT 24
#define AXIS_SENSING_OUTLIER_HOLD_WIDTH 8
// rw: amplitude window; full scale 2^(W-1)
#define AXIS_AMPLITUDE_WINDOW 0x048u
#define AXIS_AMPLITUDE_WINDOW_LOW_MASK 0x0000ffffu
#define AXIS_AMPLITUDE_WINDOW_LOW_SHIFT 0
#define AXIS_AMPLITUDE_WINDOW_LOW_WIDTH 16
#define AXIS_AMPLITUDE_WINDOW_HIGH_MASK 0xffff0000u
#define AXIS_AMPLITUDE_WINDOW_HIGH_SHIFT 16
#define AXIS_AMPLITUDE_WINDOW_HIGH_WIDTH 16
// rw: largest difference between interpolated position and quadrature count; 0: not checked
// [1/65536 period]
#define AXIS_DISAGREEMENT_LIMIT 0x04cu
#define AXIS_DISAGREEMENT_LIMIT_MASK 0x000fffffu
#define AXIS_DISAGREEMENT_LIMIT_SHIFT 0
#define AXIS_DISAGREEMENT_LIMIT_WIDTH 20
// r: last sample, after the outlier filter; full scale 2^(W-1)
#define AXIS_SAMPLE 0x050u
#define AXIS_SAMPLE_SIN_MASK 0x0000ffffu
#define AXIS_SAMPLE_SIN_SHIFT 0
#define AXIS_SAMPLE_SIN_WIDTH 16
#define AXIS_SAMPLE_COS_MASK 0xffff0000u
#define AXIS_SAMPLE_COS_SHIFT 16
#define AXIS_SAMPLE_COS_WIDTH 16
// r: phase and amplitude of the last sample
#define AXIS_PHASE 0x054u
#define AXIS_PHASE_PHASE_MASK 0x0000ffffu
#define AXIS_PHASE_PHASE_SHIFT 0
#define AXIS_PHASE_PHASE_WIDTH 16
// amplitude, full scale 2^(W-1)
#define AXIS_PHASE_AMPLITUDE_MASK 0xffff0000u
#define AXIS_PHASE_AMPLITUDE_SHIFT 16
#define AXIS_PHASE_AMPLITUDE_WIDTH 16
// r: count of the quadrature decoder [1/4 period]
#define AXIS_QUADRATURE_COUNT 0x058u
#define AXIS_QUADRATURE_COUNT_MASK 0xffffffffu
#define AXIS_QUADRATURE_COUNT_SHIFT 0
#define AXIS_QUADRATURE_COUNT_WIDTH 32
// rw: encoder events; each one stays until 1 is written to it
#define AXIS_ENCODER_EVENTS 0x05cu
// a and b changed at once
#define AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_MASK 0x00000001u
#define AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_SHIFT 0
#define AXIS_ENCODER_EVENTS_ILLEGAL_EDGE_WIDTH 1
// phase jump: the phase is more than a quarter period away from the predicted one, or a sample was
// lost
#define AXIS_ENCODER_EVENTS_OVERSPEED_MASK 0x00000002u
#define AXIS_ENCODER_EVENTS_OVERSPEED_SHIFT 1
#define AXIS_ENCODER_EVENTS_OVERSPEED_WIDTH 1
#define AXIS_ENCODER_EVENTS_AMPLITUDE_LOW_MASK 0x00000004u
#define AXIS_ENCODER_EVENTS_AMPLITUDE_LOW_SHIFT 2
#define AXIS_ENCODER_EVENTS_AMPLITUDE_LOW_WIDTH 1
#define AXIS_ENCODER_EVENTS_AMPLITUDE_HIGH_MASK 0x00000008u
#define AXIS_ENCODER_EVENTS_AMPLITUDE_HIGH_SHIFT 3
#define AXIS_ENCODER_EVENTS_AMPLITUDE_HIGH_WIDTH 1
// interpolated position and quadrature count differ
#define AXIS_ENCODER_EVENTS_DISAGREEMENT_MASK 0x00000010u
#define AXIS_ENCODER_EVENTS_DISAGREEMENT_SHIFT 4
#define AXIS_ENCODER_EVENTS_DISAGREEMENT_WIDTH 1
// lost step: in decoder_mode 3 a pulse of a, or the gap between two, was too short for the filter
// and was not counted
#define AXIS_ENCODER_EVENTS_PULSE_TOO_SHORT_MASK 0x00000020u
#define AXIS_ENCODER_EVENTS_PULSE_TOO_SHORT_SHIFT 5
#define AXIS_ENCODER_EVENTS_PULSE_TOO_SHORT_WIDTH 1
// rw: encoder events that are a fault; same bits as encoder_events
#define AXIS_ENCODER_FAULT_MASK 0x060u
#define AXIS_ENCODER_FAULT_MASK_MASK 0x0000003fu
#define AXIS_ENCODER_FAULT_MASK_SHIFT 0
#define AXIS_ENCODER_FAULT_MASK_WIDTH 6
// rw: pulses of a, b or z that the filter rejected; writing clears the count, which stops at its
// largest value
#define AXIS_REJECTED_PULSES 0x064u
#define AXIS_REJECTED_PULSES_MASK 0x0000ffffu
#define AXIS_REJECTED_PULSES_SHIFT 0
#define AXIS_REJECTED_PULSES_WIDTH 16
// rw: samples that the outlier filter rejected; writing clears the count
#define AXIS_REJECTED_SAMPLES 0x068u
#define AXIS_REJECTED_SAMPLES_MASK 0x0000ffffu
#define AXIS_REJECTED_SAMPLES_SHIFT 0
#define AXIS_REJECTED_SAMPLES_WIDTH 16
// r: what is built; 1: the axis has it
#define AXIS_BUILT 0x06cu
// HAS_SINE: sine and cosine; 0: the position is made of counts
#define AXIS_BUILT_SINE_MASK 0x00000001u
#define AXIS_BUILT_SINE_SHIFT 0
#define AXIS_BUILT_SINE_WIDTH 1
// HAS_MONITOR: signal monitor, amplitude
#define AXIS_BUILT_MONITOR_MASK 0x00000002u
#define AXIS_BUILT_MONITOR_SHIFT 1
#define AXIS_BUILT_MONITOR_WIDTH 1
// HAS_HARMONICS: harmonic correction
#define AXIS_BUILT_HARMONICS_MASK 0x00000004u
#define AXIS_BUILT_HARMONICS_SHIFT 2
#define AXIS_BUILT_HARMONICS_WIDTH 1
// HAS_RECORDER: recorder of bursts, for the auto-calibration
#define AXIS_BUILT_RECORDER_MASK 0x00000008u
#define AXIS_BUILT_RECORDER_SHIFT 3
#define AXIS_BUILT_RECORDER_WIDTH 1
// HAS_CAPTURE: queue of captures; 0: one index at a time
#define AXIS_BUILT_CAPTURE_MASK 0x00000010u
#define AXIS_BUILT_CAPTURE_SHIFT 4
#define AXIS_BUILT_CAPTURE_WIDTH 1
// HAS_COMPARE: compare pulses
#define AXIS_BUILT_COMPARE_MASK 0x00000020u
#define AXIS_BUILT_COMPARE_SHIFT 5
#define AXIS_BUILT_COMPARE_WIDTH 1
// HAS_ENCODER_CHECK: check of counts per revolution, count at the index, time of the last edge
#define AXIS_BUILT_ENCODER_CHECK_MASK 0x00000040u
#define AXIS_BUILT_ENCODER_CHECK_SHIFT 6
#define AXIS_BUILT_ENCODER_CHECK_WIDTH 1
// HAS_VELOCITY: measured velocity
#define AXIS_BUILT_VELOCITY_MASK 0x00000080u
#define AXIS_BUILT_VELOCITY_SHIFT 7
#define AXIS_BUILT_VELOCITY_WIDTH 1
// HAS_DRIVE: profile, servo, interlock; 0: the axis only measures
#define AXIS_BUILT_DRIVE_MASK 0x00000100u
#define AXIS_BUILT_DRIVE_SHIFT 8
#define AXIS_BUILT_DRIVE_WIDTH 1
// HAS_BRIDGE: bridge
#define AXIS_BUILT_BRIDGE_MASK 0x00000200u
#define AXIS_BUILT_BRIDGE_SHIFT 9
#define AXIS_BUILT_BRIDGE_WIDTH 1
// HAS_STEPPER: step generator
#define AXIS_BUILT_STEPPER_MASK 0x00000400u
#define AXIS_BUILT_STEPPER_SHIFT 10
#define AXIS_BUILT_STEPPER_WIDTH 1
// HAS_DAC: DAC
#define AXIS_BUILT_DAC_MASK 0x00000800u
#define AXIS_BUILT_DAC_SHIFT 11
#define AXIS_BUILT_DAC_WIDTH 1
// HAS_FINE_STAGE: fine stage
#define AXIS_BUILT_FINE_STAGE_MASK 0x00001000u
#define AXIS_BUILT_FINE_STAGE_SHIFT 12
#define AXIS_BUILT_FINE_STAGE_WIDTH 1
// FILTERS: biquads of the servo; 0: none
#define AXIS_BUILT_FILTERS_MASK 0x0000e000u
#define AXIS_BUILT_FILTERS_SHIFT 13
#define AXIS_BUILT_FILTERS_WIDTH 3
// SEGMENTS: most segments of the table; 0: none
#define AXIS_BUILT_SEGMENTS_MASK 0x00ff0000u
#define AXIS_BUILT_SEGMENTS_SHIFT 16
#define AXIS_BUILT_SEGMENTS_WIDTH 8
// HAS_SET_POINTS: player of streamed set-points
#define AXIS_BUILT_SET_POINTS_MASK 0x01000000u
#define AXIS_BUILT_SET_POINTS_SHIFT 24
#define AXIS_BUILT_SET_POINTS_WIDTH 1
// HAS_BACKLASH: compensation of backlash
#define AXIS_BUILT_BACKLASH_MASK 0x02000000u
#define AXIS_BUILT_BACKLASH_SHIFT 25
#define AXIS_BUILT_BACKLASH_WIDTH 1
// rw: largest |integral term|; full scale 2^15
#define AXIS_INTEGRAL_LIMIT 0x070u
#define AXIS_INTEGRAL_LIMIT_MASK 0x00007fffu
#define AXIS_INTEGRAL_LIMIT_SHIFT 0
#define AXIS_INTEGRAL_LIMIT_WIDTH 15
// rw: largest |velocity| of a stream [2^-24 period/tick]
#define AXIS_STREAM_VELOCITY_LIMIT 0x074u
#define AXIS_STREAM_VELOCITY_LIMIT_MASK 0x7fffffffu
#define AXIS_STREAM_VELOCITY_LIMIT_SHIFT 0
#define AXIS_STREAM_VELOCITY_LIMIT_WIDTH 31
// r: state of the stream
#define AXIS_STREAM_STATE 0x078u
// 0 off, 1 prepared, without a set-point yet, 2 streaming, 3 extrapolating, 4 ended
#define AXIS_STREAM_STATE_MODE_MASK 0x00000007u
#define AXIS_STREAM_STATE_MODE_SHIFT 0
#define AXIS_STREAM_STATE_MODE_WIDTH 3
// how the last stream ended: 0 not, 1 released at rest, 2 stopped, 3 set-point late, 4 fault
#define AXIS_STREAM_STATE_ENDED_MASK 0x00000038u
#define AXIS_STREAM_STATE_ENDED_SHIFT 3
#define AXIS_STREAM_STATE_ENDED_WIDTH 3
// why the last set-point was refused: 0 none was, 1 late, 2 limits, 3 out of travel, 4 queue full,
// 5 incomplete, 6 not streamed, 7 more than 255 ticks ahead
#define AXIS_STREAM_STATE_REFUSAL_MASK 0x000001c0u
#define AXIS_STREAM_STATE_REFUSAL_SHIFT 6
#define AXIS_STREAM_STATE_REFUSAL_WIDTH 3
// set-points that can be committed
#define AXIS_STREAM_STATE_ROOM_MASK 0x00003e00u
#define AXIS_STREAM_STATE_ROOM_SHIFT 9
#define AXIS_STREAM_STATE_ROOM_WIDTH 5
// ticks extrapolated since the stream began; wraps [tick]
#define AXIS_STREAM_STATE_EXTRAPOLATED_MASK 0xffff0000u
#define AXIS_STREAM_STATE_EXTRAPOLATED_SHIFT 16
#define AXIS_STREAM_STATE_EXTRAPOLATED_WIDTH 16
// r: set-points since the stream began; the counts wrap
#define AXIS_STREAM_COUNTS 0x07cu
#define AXIS_STREAM_COUNTS_ACCEPTED_MASK 0x0000ffffu
#define AXIS_STREAM_COUNTS_ACCEPTED_SHIFT 0
#define AXIS_STREAM_COUNTS_ACCEPTED_WIDTH 16
// late ones
#define AXIS_STREAM_COUNTS_LATE_MASK 0x00ff0000u
#define AXIS_STREAM_COUNTS_LATE_SHIFT 16
#define AXIS_STREAM_COUNTS_LATE_WIDTH 8
// those refused for another cause
#define AXIS_STREAM_COUNTS_REFUSED_MASK 0xff000000u
#define AXIS_STREAM_COUNTS_REFUSED_SHIFT 24
#define AXIS_STREAM_COUNTS_REFUSED_WIDTH 8
// rw: proportional gain on the error [1/65536 command/(period/65536)]
#define AXIS_KP 0x080u
#define AXIS_KP_MASK 0x00ffffffu
#define AXIS_KP_SHIFT 0
#define AXIS_KP_WIDTH 24
// rw: integral gain, each tick [1/16777216 command/(period/65536)]
#define AXIS_KI 0x084u
#define AXIS_KI_MASK 0x00ffffffu
#define AXIS_KI_SHIFT 0
#define AXIS_KI_WIDTH 24
// rw: derivative gain, on the velocity error [1/65536 command/(period/65536/tick)]
#define AXIS_KD 0x088u
#define AXIS_KD_MASK 0x00ffffffu
#define AXIS_KD_SHIFT 0
#define AXIS_KD_WIDTH 24
// rw: velocity feed-forward, on the target velocity [1/65536 command/(period/65536/tick)]
#define AXIS_KV 0x08cu
#define AXIS_KV_MASK 0x00ffffffu
#define AXIS_KV_SHIFT 0
#define AXIS_KV_WIDTH 24
// rw: acceleration feed-forward, on the target acceleration [1/256 command/(period/65536/tick2)]
#define AXIS_KA 0x090u
#define AXIS_KA_MASK 0x00ffffffu
#define AXIS_KA_SHIFT 0
#define AXIS_KA_WIDTH 24
// rw: largest |command|; full scale 2^15
#define AXIS_OUTPUT_LIMIT 0x094u
#define AXIS_OUTPUT_LIMIT_MASK 0x00007fffu
#define AXIS_OUTPUT_LIMIT_SHIFT 0
#define AXIS_OUTPUT_LIMIT_WIDTH 15
// rw: dead band: the integrator holds while |error| is not above this and no profile is played
// [1/65536 period]
#define AXIS_DEAD_BAND 0x098u
#define AXIS_DEAD_BAND_MASK 0x0000ffffu
#define AXIS_DEAD_BAND_SHIFT 0
#define AXIS_DEAD_BAND_WIDTH 16
// r: target - position, limited to 32 bits [1/65536 period]
#define AXIS_FOLLOWING_ERROR 0x09cu
#define AXIS_FOLLOWING_ERROR_MASK 0xffffffffu
#define AXIS_FOLLOWING_ERROR_SHIFT 0
#define AXIS_FOLLOWING_ERROR_WIDTH 32
// r: command to the drive, full scale 2^15, after the interlock
#define AXIS_COMMAND 0x0a0u
#define AXIS_COMMAND_MASK 0x0000ffffu
#define AXIS_COMMAND_SHIFT 0
#define AXIS_COMMAND_WIDTH 16
// rw: command while closed_loop = 0
#define AXIS_OPEN_COMMAND 0x0a4u
#define AXIS_OPEN_COMMAND_MASK 0x0000ffffu
#define AXIS_OPEN_COMMAND_SHIFT 0
#define AXIS_OPEN_COMMAND_WIDTH 16
// rw: number of a value of a filter: filter * 8 + 0: b0, 1: b1, 2: b2, 3: -a1, 4: -a2, 5: whether
// it filters, 0: no
#define AXIS_FILTER_ADDRESS 0x0a8u
#define AXIS_FILTER_ADDRESS_MASK 0x0000001fu
#define AXIS_FILTER_ADDRESS_SHIFT 0
#define AXIS_FILTER_ADDRESS_WIDTH 5
// rw: value of a filter; writing stores it at filter_address
#define AXIS_FILTER_VALUE 0x0acu
#define AXIS_FILTER_VALUE_MASK 0xffffffffu
#define AXIS_FILTER_VALUE_SHIFT 0
#define AXIS_FILTER_VALUE_WIDTH 32
// rw: velocity at the start of the segment [2^-40 period/tick]
#define AXIS_SEGMENT_VELOCITY 0x0b0u
#define AXIS_SEGMENT_VELOCITY_LOW 0x0b0u
#define AXIS_SEGMENT_VELOCITY_HIGH 0x0b4u
#define AXIS_SEGMENT_VELOCITY_WIDTH 64
// rw: acceleration at the start of the segment [2^-40 period/tick2]
#define AXIS_SEGMENT_ACCELERATION 0x0b8u
#define AXIS_SEGMENT_ACCELERATION_LOW 0x0b8u
#define AXIS_SEGMENT_ACCELERATION_HIGH 0x0bcu
#define AXIS_SEGMENT_ACCELERATION_WIDTH 64
// rw: jerk of the segment [2^-40 period/tick3]
#define AXIS_SEGMENT_JERK 0x0c0u
#define AXIS_SEGMENT_JERK_MASK 0xffffffffu
#define AXIS_SEGMENT_JERK_SHIFT 0
#define AXIS_SEGMENT_JERK_WIDTH 32
// rw: duration of the segment; writing queues it
#define AXIS_SEGMENT_TICKS 0x0c4u
#define AXIS_SEGMENT_TICKS_MASK 0x00ffffffu
#define AXIS_SEGMENT_TICKS_SHIFT 0
#define AXIS_SEGMENT_TICKS_WIDTH 24
// 1: last segment of the profile; 0: another must follow, else it is an underrun
#define AXIS_SEGMENT_TICKS_LAST_MASK 0x01000000u
#define AXIS_SEGMENT_TICKS_LAST_SHIFT 24
#define AXIS_SEGMENT_TICKS_LAST_WIDTH 1
// rw: largest deceleration of a controlled stop [2^-32 period/tick2]
#define AXIS_STOP_DECELERATION 0x0c8u
#define AXIS_STOP_DECELERATION_MASK 0xffffffffu
#define AXIS_STOP_DECELERATION_SHIFT 0
#define AXIS_STOP_DECELERATION_WIDTH 32
// rw: largest jerk of a controlled stop; 0: not limited [2^-40 period/tick3]
#define AXIS_STOP_JERK 0x0ccu
#define AXIS_STOP_JERK_MASK 0xffffffffu
#define AXIS_STOP_JERK_SHIFT 0
#define AXIS_STOP_JERK_WIDTH 32
// rw: feed override: fraction of full speed, 65536 at most, at which profiles are played; 0: pause
#define AXIS_FEED_OVERRIDE 0x0d0u
#define AXIS_FEED_OVERRIDE_MASK 0x0001ffffu
#define AXIS_FEED_OVERRIDE_SHIFT 0
#define AXIS_FEED_OVERRIDE_WIDTH 17
// rw: largest change of the override; 0: not limited [2^-32 1/tick]
#define AXIS_FEED_OVERRIDE_SLOPE 0x0d4u
#define AXIS_FEED_OVERRIDE_SLOPE_MASK 0xffffffffu
#define AXIS_FEED_OVERRIDE_SLOPE_SHIFT 0
#define AXIS_FEED_OVERRIDE_SLOPE_WIDTH 32
// rw: largest change of that slope; 0: not limited [2^-32 1/tick2]
#define AXIS_FEED_OVERRIDE_CURVE 0x0d8u
#define AXIS_FEED_OVERRIDE_CURVE_MASK 0xffffffffu
#define AXIS_FEED_OVERRIDE_CURVE_SHIFT 0
#define AXIS_FEED_OVERRIDE_CURVE_WIDTH 32
// rw: time stamp of an armed start [cycle]
#define AXIS_START_AT 0x0dcu
#define AXIS_START_AT_MASK 0xffffffffu
#define AXIS_START_AT_SHIFT 0
#define AXIS_START_AT_WIDTH 32
// rw: position of the next set-point [1/65536 period]
#define AXIS_SET_POINT_POSITION 0x0e0u
#define AXIS_SET_POINT_POSITION_LOW 0x0e0u
#define AXIS_SET_POINT_POSITION_HIGH 0x0e4u
#define AXIS_SET_POINT_POSITION_WIDTH 48
// rw: lowest position of a stream [1/65536 period]
#define AXIS_STREAM_TRAVEL_LOW 0x0e8u
#define AXIS_STREAM_TRAVEL_LOW_LOW 0x0e8u
#define AXIS_STREAM_TRAVEL_LOW_HIGH 0x0ecu
#define AXIS_STREAM_TRAVEL_LOW_WIDTH 48
// rw: highest position of a stream [1/65536 period]
#define AXIS_STREAM_TRAVEL_HIGH 0x0f0u
#define AXIS_STREAM_TRAVEL_HIGH_LOW 0x0f0u
#define AXIS_STREAM_TRAVEL_HIGH_HIGH 0x0f4u
#define AXIS_STREAM_TRAVEL_HIGH_WIDTH 48
// rw: velocity of the next set-point [2^-24 period/tick]
#define AXIS_SET_POINT_VELOCITY 0x0f8u
#define AXIS_SET_POINT_VELOCITY_MASK 0xffffffffu
#define AXIS_SET_POINT_VELOCITY_SHIFT 0
#define AXIS_SET_POINT_VELOCITY_WIDTH 32
// rw: largest |acceleration| of a stream [2^-32 period/tick2]
#define AXIS_STREAM_ACCELERATION_LIMIT 0x0fcu
#define AXIS_STREAM_ACCELERATION_LIMIT_MASK 0xffffffffu
#define AXIS_STREAM_ACCELERATION_LIMIT_SHIFT 0
#define AXIS_STREAM_ACCELERATION_LIMIT_WIDTH 32

// feedback channel: edge filter, index, signal correction, calibration, signal faults, capture,
// compare
// rw: filter of a, b and z; axis.sensing.deglitch is the number of equal samples that it requires
#define FEEDBACK_EDGE_FILTER 0x000u
// cycles left out between two samples [cycle]
#define FEEDBACK_EDGE_FILTER_SKIP_MASK 0x0000ffffu
#define FEEDBACK_EDGE_FILTER_SKIP_SHIFT 0
#define FEEDBACK_EDGE_FILTER_SKIP_WIDTH 16
// tolerated samples, of the old level: N of N + tolerated must agree
#define FEEDBACK_EDGE_FILTER_TOLERATED_MASK 0x000f0000u
#define FEEDBACK_EDGE_FILTER_TOLERATED_SHIFT 16
#define FEEDBACK_EDGE_FILTER_TOLERATED_WIDTH 4
// rw: 0 x4, 1 x2, 2 x1, 3 step and direction; all but x4 need disagreement_limit = 0
#define FEEDBACK_DECODER_MODE 0x004u
#define FEEDBACK_DECODER_MODE_MASK 0x00000003u
#define FEEDBACK_DECODER_MODE_SHIFT 0
#define FEEDBACK_DECODER_MODE_WIDTH 2
// rw: which index is used
#define FEEDBACK_INDEX 0x008u
// 1: the index is active low
#define FEEDBACK_INDEX_ACTIVE_LOW_MASK 0x00000001u
#define FEEDBACK_INDEX_ACTIVE_LOW_SHIFT 0
#define FEEDBACK_INDEX_ACTIVE_LOW_WIDTH 1
// {b, a}, 1: it must equal gate
#define FEEDBACK_INDEX_GATE_MASK_MASK 0x00000006u
#define FEEDBACK_INDEX_GATE_MASK_SHIFT 1
#define FEEDBACK_INDEX_GATE_MASK_WIDTH 2
// {b, a}, levels at the index
#define FEEDBACK_INDEX_GATE_MASK 0x00000018u
#define FEEDBACK_INDEX_GATE_SHIFT 3
#define FEEDBACK_INDEX_GATE_WIDTH 2
// 1: use an index going up
#define FEEDBACK_INDEX_UP_MASK 0x00000020u
#define FEEDBACK_INDEX_UP_SHIFT 5
#define FEEDBACK_INDEX_UP_WIDTH 1
// 1: use an index going down
#define FEEDBACK_INDEX_DOWN_MASK 0x00000040u
#define FEEDBACK_INDEX_DOWN_SHIFT 6
#define FEEDBACK_INDEX_DOWN_WIDTH 1
// 1: every index; 0: one for each arm_index
#define FEEDBACK_INDEX_EACH_MASK 0x00000080u
#define FEEDBACK_INDEX_EACH_SHIFT 7
#define FEEDBACK_INDEX_EACH_WIDTH 1
// rw: edges between two indexes; 0: not checked
#define FEEDBACK_COUNTS_PER_REVOLUTION 0x00cu
#define FEEDBACK_COUNTS_PER_REVOLUTION_MASK 0xffffffffu
#define FEEDBACK_COUNTS_PER_REVOLUTION_SHIFT 0
#define FEEDBACK_COUNTS_PER_REVOLUTION_WIDTH 32
// w: strobes
#define FEEDBACK_STROBES 0x010u
// arms the index, so that the next one is used
#define FEEDBACK_STROBES_ARM_INDEX_MASK 0x00000001u
#define FEEDBACK_STROBES_ARM_INDEX_SHIFT 0
#define FEEDBACK_STROBES_ARM_INDEX_WIDTH 1
// loads the correction, that is the four values, for all samples from here on
#define FEEDBACK_STROBES_LOAD_CORRECTION_MASK 0x00000002u
#define FEEDBACK_STROBES_LOAD_CORRECTION_SHIFT 1
#define FEEDBACK_STROBES_LOAD_CORRECTION_WIDTH 1
// uses the new harmonic table, which was written before
#define FEEDBACK_STROBES_SWAP_HARMONICS_MASK 0x00000004u
#define FEEDBACK_STROBES_SWAP_HARMONICS_SHIFT 2
#define FEEDBACK_STROBES_SWAP_HARMONICS_WIDTH 1
// records a new burst
#define FEEDBACK_STROBES_RECORD_MASK 0x00000008u
#define FEEDBACK_STROBES_RECORD_SHIFT 3
#define FEEDBACK_STROBES_RECORD_WIDTH 1
// clears the first signal fault
#define FEEDBACK_STROBES_CLEAR_SIGNAL_FAULTS_MASK 0x00000010u
#define FEEDBACK_STROBES_CLEAR_SIGNAL_FAULTS_SHIFT 4
#define FEEDBACK_STROBES_CLEAR_SIGNAL_FAULTS_WIDTH 1
// captures now
#define FEEDBACK_STROBES_CAPTURE_NOW_MASK 0x00000020u
#define FEEDBACK_STROBES_CAPTURE_NOW_SHIFT 5
#define FEEDBACK_STROBES_CAPTURE_NOW_WIDTH 1
// drops the oldest capture
#define FEEDBACK_STROBES_CAPTURE_NEXT_MASK 0x00000040u
#define FEEDBACK_STROBES_CAPTURE_NEXT_SHIFT 6
#define FEEDBACK_STROBES_CAPTURE_NEXT_WIDTH 1
// drops all captures
#define FEEDBACK_STROBES_CAPTURE_CLEAR_MASK 0x00000080u
#define FEEDBACK_STROBES_CAPTURE_CLEAR_SHIFT 7
#define FEEDBACK_STROBES_CAPTURE_CLEAR_WIDTH 1
// arms compare at its first point
#define FEEDBACK_STROBES_COMPARE_ARM_MASK 0x00000100u
#define FEEDBACK_STROBES_COMPARE_ARM_SHIFT 8
#define FEEDBACK_STROBES_COMPARE_ARM_WIDTH 1
// disarms compare
#define FEEDBACK_STROBES_COMPARE_DISARM_MASK 0x00000200u
#define FEEDBACK_STROBES_COMPARE_DISARM_SHIFT 9
#define FEEDBACK_STROBES_COMPARE_DISARM_WIDTH 1
// rw: index events; write 1 to clear
#define FEEDBACK_INDEX_EVENTS 0x014u
#define FEEDBACK_INDEX_EVENTS_FOUND_MASK 0x00000001u
#define FEEDBACK_INDEX_EVENTS_FOUND_SHIFT 0
#define FEEDBACK_INDEX_EVENTS_FOUND_WIDTH 1
// wrong count since the index before, neither 0 nor counts_per_revolution
#define FEEDBACK_INDEX_EVENTS_REVOLUTION_WRONG_MASK 0x00000002u
#define FEEDBACK_INDEX_EVENTS_REVOLUTION_WRONG_SHIFT 1
#define FEEDBACK_INDEX_EVENTS_REVOLUTION_WRONG_WIDTH 1
#define FEEDBACK_INDEX_EVENTS_ARMED_MASK 0x00000004u
#define FEEDBACK_INDEX_EVENTS_ARMED_SHIFT 2
#define FEEDBACK_INDEX_EVENTS_ARMED_WIDTH 1
// r: quadrature count at the last index [1/4 period]
#define FEEDBACK_INDEX_COUNT 0x018u
#define FEEDBACK_INDEX_COUNT_MASK 0xffffffffu
#define FEEDBACK_INDEX_COUNT_SHIFT 0
#define FEEDBACK_INDEX_COUNT_WIDTH 32
// r: time of the last counted edge [cycle]
#define FEEDBACK_EDGE_TIME 0x01cu
#define FEEDBACK_EDGE_TIME_MASK 0xffffffffu
#define FEEDBACK_EDGE_TIME_SHIFT 0
#define FEEDBACK_EDGE_TIME_WIDTH 32
// rw: offsets, full scale 2^15
#define FEEDBACK_CORRECTION_OFFSET 0x020u
#define FEEDBACK_CORRECTION_OFFSET_SIN_MASK 0x0000ffffu
#define FEEDBACK_CORRECTION_OFFSET_SIN_SHIFT 0
#define FEEDBACK_CORRECTION_OFFSET_SIN_WIDTH 16
#define FEEDBACK_CORRECTION_OFFSET_COS_MASK 0xffff0000u
#define FEEDBACK_CORRECTION_OFFSET_COS_SHIFT 16
#define FEEDBACK_CORRECTION_OFFSET_COS_WIDTH 16
// rw: gain of the sine
#define FEEDBACK_CORRECTION_GAIN 0x024u
#define FEEDBACK_CORRECTION_GAIN_MASK 0x0001ffffu
#define FEEDBACK_CORRECTION_GAIN_SHIFT 0
#define FEEDBACK_CORRECTION_GAIN_WIDTH 17
// rw: quadrature error: part of the cosine in the sine
#define FEEDBACK_CORRECTION_QUADRATURE_ERROR 0x028u
#define FEEDBACK_CORRECTION_QUADRATURE_ERROR_MASK 0x0001ffffu
#define FEEDBACK_CORRECTION_QUADRATURE_ERROR_SHIFT 0
#define FEEDBACK_CORRECTION_QUADRATURE_ERROR_WIDTH 17
// rw: 1: the harmonic table is subtracted
#define FEEDBACK_HARMONIC_ENABLE 0x02cu
#define FEEDBACK_HARMONIC_ENABLE_MASK 0x00000001u
#define FEEDBACK_HARMONIC_ENABLE_SHIFT 0
#define FEEDBACK_HARMONIC_ENABLE_WIDTH 1
// rw: point of the harmonic table that is not in use; writing stores it
#define FEEDBACK_HARMONIC_POINT 0x030u
#define FEEDBACK_HARMONIC_POINT_MASK 0x0003ffffu
#define FEEDBACK_HARMONIC_POINT_SHIFT 0
#define FEEDBACK_HARMONIC_POINT_WIDTH 18
#define FEEDBACK_HARMONIC_POINT_POINT_MASK 0x03fc0000u
#define FEEDBACK_HARMONIC_POINT_POINT_SHIFT 18
#define FEEDBACK_HARMONIC_POINT_POINT_WIDTH 8
// rw: what the recorder stores
#define FEEDBACK_RECORDER 0x034u
// one sample out of so many
#define FEEDBACK_RECORDER_DECIMATION_MASK 0x0000ffffu
#define FEEDBACK_RECORDER_DECIMATION_SHIFT 0
#define FEEDBACK_RECORDER_DECIMATION_WIDTH 16
// 1: phases, 0: samples
#define FEEDBACK_RECORDER_PHASES_MASK 0x00010000u
#define FEEDBACK_RECORDER_PHASES_SHIFT 16
#define FEEDBACK_RECORDER_PHASES_WIDTH 1
// r: state of the burst
#define FEEDBACK_RECORDER_STATE 0x038u
// the burst is complete
#define FEEDBACK_RECORDER_STATE_FULL_MASK 0x00000001u
#define FEEDBACK_RECORDER_STATE_FULL_SHIFT 0
#define FEEDBACK_RECORDER_STATE_FULL_WIDTH 1
// the signal was disturbed, out of its amplitude window or too fast
#define FEEDBACK_RECORDER_STATE_INVALID_MASK 0x00000002u
#define FEEDBACK_RECORDER_STATE_INVALID_SHIFT 1
#define FEEDBACK_RECORDER_STATE_INVALID_WIDTH 1
// r: word of the burst; reading advances to the next one
#define FEEDBACK_RECORDER_WORD 0x03cu
#define FEEDBACK_RECORDER_WORD_MASK 0xffffffffu
#define FEEDBACK_RECORDER_WORD_SHIFT 0
#define FEEDBACK_RECORDER_WORD_WIDTH 32
// r: signal faults present now
#define FEEDBACK_SIGNAL_FAULTS 0x040u
#define FEEDBACK_SIGNAL_FAULTS_MASK 0x00007fffu
#define FEEDBACK_SIGNAL_FAULTS_SHIFT 0
#define FEEDBACK_SIGNAL_FAULTS_WIDTH 15
// r: first signal faults
#define FEEDBACK_FIRST_SIGNAL_FAULTS 0x044u
#define FEEDBACK_FIRST_SIGNAL_FAULTS_MASK 0x00007fffu
#define FEEDBACK_FIRST_SIGNAL_FAULTS_SHIFT 0
#define FEEDBACK_FIRST_SIGNAL_FAULTS_WIDTH 15
// rw: faults that stop the drive; bits as in signal_faults
#define FEEDBACK_SIGNAL_FAULT_MASK 0x048u
#define FEEDBACK_SIGNAL_FAULT_MASK_MASK 0x00007fffu
#define FEEDBACK_SIGNAL_FAULT_MASK_SHIFT 0
#define FEEDBACK_SIGNAL_FAULT_MASK_WIDTH 15
// rw: ADC counts; clipping and the circle of the signals
#define FEEDBACK_LISSAJOUS_LIMITS 0x04cu
#define FEEDBACK_LISSAJOUS_LIMITS_CLIP_LEVEL_MASK 0x0000ffffu
#define FEEDBACK_LISSAJOUS_LIMITS_CLIP_LEVEL_SHIFT 0
#define FEEDBACK_LISSAJOUS_LIMITS_CLIP_LEVEL_WIDTH 16
#define FEEDBACK_LISSAJOUS_LIMITS_TOLERANCE_MASK 0xffff0000u
#define FEEDBACK_LISSAJOUS_LIMITS_TOLERANCE_SHIFT 16
#define FEEDBACK_LISSAJOUS_LIMITS_TOLERANCE_WIDTH 16
// rw: ADC counts; jumps and missing noise
#define FEEDBACK_JUMP_LIMITS 0x050u
#define FEEDBACK_JUMP_LIMITS_JUMP_MASK 0x0000ffffu
#define FEEDBACK_JUMP_LIMITS_JUMP_SHIFT 0
#define FEEDBACK_JUMP_LIMITS_JUMP_WIDTH 16
// samples with one code; 0: any number
#define FEEDBACK_JUMP_LIMITS_NO_NOISE_SAMPLES_MASK 0xffff0000u
#define FEEDBACK_JUMP_LIMITS_NO_NOISE_SAMPLES_SHIFT 16
#define FEEDBACK_JUMP_LIMITS_NO_NOISE_SAMPLES_WIDTH 16
// rw: ADC counts; a channel that does not change
#define FEEDBACK_CHANNEL_LIMITS 0x054u
#define FEEDBACK_CHANNEL_LIMITS_SPAN_MASK 0x0000ffffu
#define FEEDBACK_CHANNEL_LIMITS_SPAN_SHIFT 0
#define FEEDBACK_CHANNEL_LIMITS_SPAN_WIDTH 16
#define FEEDBACK_CHANNEL_LIMITS_BAND_MASK 0x00ff0000u
#define FEEDBACK_CHANNEL_LIMITS_BAND_SHIFT 16
#define FEEDBACK_CHANNEL_LIMITS_BAND_WIDTH 8
// rw: ADC counts; drift of offset and balance
#define FEEDBACK_DRIFT_LIMITS 0x058u
#define FEEDBACK_DRIFT_LIMITS_OFFSET_MASK 0x0000ffffu
#define FEEDBACK_DRIFT_LIMITS_OFFSET_SHIFT 0
#define FEEDBACK_DRIFT_LIMITS_OFFSET_WIDTH 16
#define FEEDBACK_DRIFT_LIMITS_BALANCE_MASK 0xffff0000u
#define FEEDBACK_DRIFT_LIMITS_BALANCE_SHIFT 16
#define FEEDBACK_DRIFT_LIMITS_BALANCE_WIDTH 16
// rw: ADC counts; phase error and comparators
#define FEEDBACK_QUADRATURE_LIMITS 0x05cu
#define FEEDBACK_QUADRATURE_LIMITS_QUADRATURE_ERROR_MASK 0x0000ffffu
#define FEEDBACK_QUADRATURE_LIMITS_QUADRATURE_ERROR_SHIFT 0
#define FEEDBACK_QUADRATURE_LIMITS_QUADRATURE_ERROR_WIDTH 16
#define FEEDBACK_QUADRATURE_LIMITS_SIGN_THRESHOLD_MASK 0xffff0000u
#define FEEDBACK_QUADRATURE_LIMITS_SIGN_THRESHOLD_SHIFT 16
#define FEEDBACK_QUADRATURE_LIMITS_SIGN_THRESHOLD_WIDTH 16
// rw: sources that capture; bit 0 index, 1 tick, 2 software or sync pulse, 3 and 4 rising probe 0
// and 1, 5 and 6 falling probe 0 and 1
#define FEEDBACK_CAPTURE_SOURCES 0x060u
#define FEEDBACK_CAPTURE_SOURCES_MASK 0x0000007fu
#define FEEDBACK_CAPTURE_SOURCES_SHIFT 0
#define FEEDBACK_CAPTURE_SOURCES_WIDTH 7
// rw: state of the captures; without HAS_CAPTURE there is one, of the index
#define FEEDBACK_CAPTURE_STATE 0x064u
// capture waits in captured_*
#define FEEDBACK_CAPTURE_STATE_PRESENT_MASK 0x00000001u
#define FEEDBACK_CAPTURE_STATE_PRESENT_SHIFT 0
#define FEEDBACK_CAPTURE_STATE_PRESENT_WIDTH 1
// captures that still fit
#define FEEDBACK_CAPTURE_STATE_FREE_MASK 0x0000003eu
#define FEEDBACK_CAPTURE_STATE_FREE_SHIFT 1
#define FEEDBACK_CAPTURE_STATE_FREE_WIDTH 5
// an event was dropped; write 1 to clear
#define FEEDBACK_CAPTURE_STATE_OVERRUN_MASK 0x00000040u
#define FEEDBACK_CAPTURE_STATE_OVERRUN_SHIFT 6
#define FEEDBACK_CAPTURE_STATE_OVERRUN_WIDTH 1
// r: oldest capture
#define FEEDBACK_CAPTURED 0x068u
#define FEEDBACK_CAPTURED_SOURCES_MASK 0x0000007fu
#define FEEDBACK_CAPTURED_SOURCES_SHIFT 0
#define FEEDBACK_CAPTURED_SOURCES_WIDTH 7
// time since its sample; for a position made of counts: since the last count [cycle]
#define FEEDBACK_CAPTURED_AGE_MASK 0x007fff80u
#define FEEDBACK_CAPTURED_AGE_SHIFT 7
#define FEEDBACK_CAPTURED_AGE_WIDTH 16
// r: time of the oldest capture [cycle]
#define FEEDBACK_CAPTURED_TIME 0x06cu
#define FEEDBACK_CAPTURED_TIME_MASK 0xffffffffu
#define FEEDBACK_CAPTURED_TIME_SHIFT 0
#define FEEDBACK_CAPTURED_TIME_WIDTH 32
// r: position of the oldest capture [1/65536 period]
#define FEEDBACK_CAPTURED_POSITION 0x070u
#define FEEDBACK_CAPTURED_POSITION_LOW 0x070u
#define FEEDBACK_CAPTURED_POSITION_HIGH 0x074u
#define FEEDBACK_CAPTURED_POSITION_WIDTH 48
// rw: first compare point [1/65536 period]
#define FEEDBACK_COMPARE_START 0x078u
#define FEEDBACK_COMPARE_START_LOW 0x078u
#define FEEDBACK_COMPARE_START_HIGH 0x07cu
#define FEEDBACK_COMPARE_START_WIDTH 48
// rw: distance between two points; its sign is the direction [1/65536 period]
#define FEEDBACK_COMPARE_STEP 0x080u
#define FEEDBACK_COMPARE_STEP_LOW 0x080u
#define FEEDBACK_COMPARE_STEP_HIGH 0x084u
#define FEEDBACK_COMPARE_STEP_WIDTH 48
// rw: number of points; 0: no end
#define FEEDBACK_COMPARE_COUNT 0x088u
#define FEEDBACK_COMPARE_COUNT_MASK 0xffffffffu
#define FEEDBACK_COMPARE_COUNT_SHIFT 0
#define FEEDBACK_COMPARE_COUNT_WIDTH 32
// rw: length of a pulse [cycle]
#define FEEDBACK_COMPARE_PULSE 0x08cu
#define FEEDBACK_COMPARE_PULSE_MASK 0x00ffffffu
#define FEEDBACK_COMPARE_PULSE_SHIFT 0
#define FEEDBACK_COMPARE_PULSE_WIDTH 24
// rw: shortest gap between two pulses [cycle]
#define FEEDBACK_COMPARE_GAP 0x090u
#define FEEDBACK_COMPARE_GAP_MASK 0x00ffffffu
#define FEEDBACK_COMPARE_GAP_SHIFT 0
#define FEEDBACK_COMPARE_GAP_WIDTH 24
// rw: state of compare
#define FEEDBACK_COMPARE_STATE 0x094u
#define FEEDBACK_COMPARE_STATE_ARMED_MASK 0x00000001u
#define FEEDBACK_COMPARE_STATE_ARMED_SHIFT 0
#define FEEDBACK_COMPARE_STATE_ARMED_WIDTH 1
// a pulse had to wait for the one before it; write 1 to clear
#define FEEDBACK_COMPARE_STATE_LATE_MASK 0x00000002u
#define FEEDBACK_COMPARE_STATE_LATE_SHIFT 1
#define FEEDBACK_COMPARE_STATE_LATE_WIDTH 1
// r: points passed, since compare_arm
#define FEEDBACK_COMPARE_PASSED 0x098u
#define FEEDBACK_COMPARE_PASSED_MASK 0xffffffffu
#define FEEDBACK_COMPARE_PASSED_SHIFT 0
#define FEEDBACK_COMPARE_PASSED_WIDTH 32
// rw: smallest step of the position; 0: the velocity is the distance of one tick [1/65536 period]
#define FEEDBACK_VELOCITY_QUANTUM 0x09cu
#define FEEDBACK_VELOCITY_QUANTUM_MASK 0x0000ffffu
#define FEEDBACK_VELOCITY_QUANTUM_SHIFT 0
#define FEEDBACK_VELOCITY_QUANTUM_WIDTH 16
// rw: what the position is made of
#define FEEDBACK_POSITION_SOURCE 0x0a8u
// 1: counts of a and b, 0: phases, if sine and cosine are built; a count is a quarter period
#define FEEDBACK_POSITION_SOURCE_COUNTS_MASK 0x00000001u
#define FEEDBACK_POSITION_SOURCE_COUNTS_SHIFT 0
#define FEEDBACK_POSITION_SOURCE_COUNTS_WIDTH 1
// 1: own steps of the axis replace the pins a and b
#define FEEDBACK_POSITION_SOURCE_STEPS_MASK 0x00000002u
#define FEEDBACK_POSITION_SOURCE_STEPS_SHIFT 1
#define FEEDBACK_POSITION_SOURCE_STEPS_WIDTH 1
// rw: shift of position and phase, -2 to 2 counts, in the mode of counts; the target does not
// follow [1/4 period]
#define FEEDBACK_ALIGN 0x0acu
#define FEEDBACK_ALIGN_MASK 0x00000007u
#define FEEDBACK_ALIGN_SHIFT 0
#define FEEDBACK_ALIGN_WIDTH 3
// w: use of the segment table; a change moves position and target together
#define FEEDBACK_SEGMENT_USE 0x0b0u
// 1: positions are corrected
#define FEEDBACK_SEGMENT_USE_ENABLE_MASK 0x00000001u
#define FEEDBACK_SEGMENT_USE_ENABLE_SHIFT 0
#define FEEDBACK_SEGMENT_USE_ENABLE_WIDTH 1
// 1: straight lines between borders; 0: a segment has the mean of its borders
#define FEEDBACK_SEGMENT_USE_LINEAR_MASK 0x00000002u
#define FEEDBACK_SEGMENT_USE_LINEAR_SHIFT 1
#define FEEDBACK_SEGMENT_USE_LINEAR_WIDTH 1
#define FEEDBACK_SEGMENT_USE_SEGMENTS_MASK 0x000003fcu
#define FEEDBACK_SEGMENT_USE_SEGMENTS_SHIFT 2
#define FEEDBACK_SEGMENT_USE_SEGMENTS_WIDTH 8
// r: state of the segment table
#define FEEDBACK_SEGMENT_STATE 0x0b4u
// positions are corrected
#define FEEDBACK_SEGMENT_STATE_IN_FORCE_MASK 0x00000001u
#define FEEDBACK_SEGMENT_STATE_IN_FORCE_SHIFT 0
#define FEEDBACK_SEGMENT_STATE_IN_FORCE_WIDTH 1
// beyond the table, where the error of its border is used
#define FEEDBACK_SEGMENT_STATE_OUTSIDE_MASK 0x00000002u
#define FEEDBACK_SEGMENT_STATE_OUTSIDE_SHIFT 1
#define FEEDBACK_SEGMENT_STATE_OUTSIDE_WIDTH 1
// 1: segment_stored is valid, for the border in segment_read
#define FEEDBACK_SEGMENT_STATE_KNOWN_MASK 0x00000004u
#define FEEDBACK_SEGMENT_STATE_KNOWN_SHIFT 2
#define FEEDBACK_SEGMENT_STATE_KNOWN_WIDTH 1
// w: position of the first border; it moves with the origin after it is written [1/65536 period]
#define FEEDBACK_SEGMENT_ORIGIN 0x0b8u
#define FEEDBACK_SEGMENT_ORIGIN_LOW 0x0b8u
#define FEEDBACK_SEGMENT_ORIGIN_HIGH 0x0bcu
#define FEEDBACK_SEGMENT_ORIGIN_WIDTH 48
// w: length of a segment [1/65536 period]
#define FEEDBACK_SEGMENT_LENGTH 0x0c0u
#define FEEDBACK_SEGMENT_LENGTH_LOW 0x0c0u
#define FEEDBACK_SEGMENT_LENGTH_HIGH 0x0c4u
#define FEEDBACK_SEGMENT_LENGTH_WIDTH 48
// w: position at a border less the true position, that is its error; writing stores it
#define FEEDBACK_SEGMENT_POINT 0x0c8u
#define FEEDBACK_SEGMENT_POINT_MASK 0x00ffffffu
#define FEEDBACK_SEGMENT_POINT_SHIFT 0
#define FEEDBACK_SEGMENT_POINT_WIDTH 24
// border of the point
#define FEEDBACK_SEGMENT_POINT_BORDER_MASK 0xff000000u
#define FEEDBACK_SEGMENT_POINT_BORDER_SHIFT 24
#define FEEDBACK_SEGMENT_POINT_BORDER_WIDTH 8
// w: border to read back: border
#define FEEDBACK_SEGMENT_READ 0x0ccu
#define FEEDBACK_SEGMENT_READ_BORDER_MASK 0x000000ffu
#define FEEDBACK_SEGMENT_READ_BORDER_SHIFT 0
#define FEEDBACK_SEGMENT_READ_BORDER_WIDTH 8
// r: error at that border, valid while segment_state.known is 1 [1/65536 period]
#define FEEDBACK_SEGMENT_STORED 0x0d0u
#define FEEDBACK_SEGMENT_STORED_MASK 0x00ffffffu
#define FEEDBACK_SEGMENT_STORED_SHIFT 0
#define FEEDBACK_SEGMENT_STORED_WIDTH 24
// r: error subtracted from the position now [1/65536 period]
#define FEEDBACK_SEGMENT_ERROR 0x0d4u
#define FEEDBACK_SEGMENT_ERROR_MASK 0x00ffffffu
#define FEEDBACK_SEGMENT_ERROR_SHIFT 0
#define FEEDBACK_SEGMENT_ERROR_WIDTH 24
// rw: backlash between motor and table: how far the motor turns after a reversal until the table
// moves [1/65536 period]
#define FEEDBACK_BACKLASH 0x0d8u
#define FEEDBACK_BACKLASH_MASK 0x00ffffffu
#define FEEDBACK_BACKLASH_SHIFT 0
#define FEEDBACK_BACKLASH_WIDTH 24
// rw: how the backlash is taken up
#define FEEDBACK_BACKLASH_RATE 0x0dcu
// velocity of the motor beyond that of the target; 0: at once [1/65536 period/tick]
#define FEEDBACK_BACKLASH_RATE_MASK 0x00ffffffu
#define FEEDBACK_BACKLASH_RATE_SHIFT 0
#define FEEDBACK_BACKLASH_RATE_WIDTH 24
// how far the target must move back until that is a reversal [1/256 period]
#define FEEDBACK_BACKLASH_RATE_HYSTERESIS_MASK 0x7f000000u
#define FEEDBACK_BACKLASH_RATE_HYSTERESIS_SHIFT 24
#define FEEDBACK_BACKLASH_RATE_HYSTERESIS_WIDTH 7
// 1: the sensor is on the motor's side, and the position of the axis is that of the table; 0: it is
// on the table
#define FEEDBACK_BACKLASH_RATE_MOTOR_SIDE_MASK 0x80000000u
#define FEEDBACK_BACKLASH_RATE_MOTOR_SIDE_SHIFT 31
#define FEEDBACK_BACKLASH_RATE_MOTOR_SIDE_WIDTH 1

// actuator: bridge, stepper driver or DAC, and the fine stage
// rw: kind of drive: 0 bridge, 1 stepper, 2 DAC
#define ACTUATOR_DRIVE 0x000u
#define ACTUATOR_DRIVE_MASK 0x00000003u
#define ACTUATOR_DRIVE_SHIFT 0
#define ACTUATOR_DRIVE_WIDTH 2
// rw: PWM period of the bridge [cycle]
#define ACTUATOR_PWM_PERIOD 0x004u
#define ACTUATOR_PWM_PERIOD_MASK 0x0000ffffu
#define ACTUATOR_PWM_PERIOD_SHIFT 0
#define ACTUATOR_PWM_PERIOD_WIDTH 16
// rw: shortest times of a step pulse
#define ACTUATOR_STEP_PULSE 0x008u
#define ACTUATOR_STEP_PULSE_HIGH_MASK 0x00003fffu
#define ACTUATOR_STEP_PULSE_HIGH_SHIFT 0
#define ACTUATOR_STEP_PULSE_HIGH_WIDTH 14
#define ACTUATOR_STEP_PULSE_LOW_MASK 0x0fffc000u
#define ACTUATOR_STEP_PULSE_LOW_SHIFT 14
#define ACTUATOR_STEP_PULSE_LOW_WIDTH 14
// rw: shortest times of the direction before and after a step pulse
#define ACTUATOR_STEP_DIRECTION 0x00cu
#define ACTUATOR_STEP_DIRECTION_SETUP_MASK 0x00003fffu
#define ACTUATOR_STEP_DIRECTION_SETUP_SHIFT 0
#define ACTUATOR_STEP_DIRECTION_SETUP_WIDTH 14
#define ACTUATOR_STEP_DIRECTION_HOLD_MASK 0x0fffc000u
#define ACTUATOR_STEP_DIRECTION_HOLD_SHIFT 14
#define ACTUATOR_STEP_DIRECTION_HOLD_WIDTH 14
// rw: how steps are output; a change acts while the drive is off
#define ACTUATOR_STEP_OUTPUT 0x010u
// 0 step and direction, 1 quadrature, 2 pulses up and pulses down
#define ACTUATOR_STEP_OUTPUT_MODE_MASK 0x00000003u
#define ACTUATOR_STEP_OUTPUT_MODE_SHIFT 0
#define ACTUATOR_STEP_OUTPUT_MODE_WIDTH 2
// 1: step is active low
#define ACTUATOR_STEP_OUTPUT_STEP_LOW_MASK 0x00000004u
#define ACTUATOR_STEP_OUTPUT_STEP_LOW_SHIFT 2
#define ACTUATOR_STEP_OUTPUT_STEP_LOW_WIDTH 1
// 1: direction is low going up
#define ACTUATOR_STEP_OUTPUT_DIRECTION_LOW_MASK 0x00000008u
#define ACTUATOR_STEP_OUTPUT_DIRECTION_LOW_SHIFT 3
#define ACTUATOR_STEP_OUTPUT_DIRECTION_LOW_WIDTH 1
// rw: motion of the target for one count of the command [1/65536 period]
#define ACTUATOR_STEP_TRIM 0x014u
#define ACTUATOR_STEP_TRIM_MASK 0x0000ffffu
#define ACTUATOR_STEP_TRIM_SHIFT 0
#define ACTUATOR_STEP_TRIM_WIDTH 16
// rw: steps in one period; a negative sign reverses the direction [2^-32 step/period]
#define ACTUATOR_STEP_RATIO 0x018u
#define ACTUATOR_STEP_RATIO_LOW 0x018u
#define ACTUATOR_STEP_RATIO_HIGH 0x01cu
#define ACTUATOR_STEP_RATIO_WIDTH 48
// r: steps sent since reset [step]
#define ACTUATOR_STEPS 0x020u
#define ACTUATOR_STEPS_MASK 0xffffffffu
#define ACTUATOR_STEPS_SHIFT 0
#define ACTUATOR_STEPS_WIDTH 32
// rw: words to the DAC
#define ACTUATOR_DAC 0x024u
// half a period of its clock; 0 acts as 1 [cycle]
#define ACTUATOR_DAC_HALF_PERIOD_MASK 0x000000ffu
#define ACTUATOR_DAC_HALF_PERIOD_SHIFT 0
#define ACTUATOR_DAC_HALF_PERIOD_WIDTH 8
// time after which the last word is sent again [cycle]
#define ACTUATOR_DAC_REFRESH_MASK 0x00ffff00u
#define ACTUATOR_DAC_REFRESH_SHIFT 8
#define ACTUATOR_DAC_REFRESH_WIDTH 16
// rw: offset added to each word
#define ACTUATOR_DAC_TRIM 0x028u
#define ACTUATOR_DAC_TRIM_MASK 0x0000ffffu
#define ACTUATOR_DAC_TRIM_SHIFT 0
#define ACTUATOR_DAC_TRIM_WIDTH 16
// rw: proportional gain of the fine stage [1/65536 command/(period/65536)]
#define ACTUATOR_FINE_KP 0x030u
#define ACTUATOR_FINE_KP_MASK 0x00ffffffu
#define ACTUATOR_FINE_KP_SHIFT 0
#define ACTUATOR_FINE_KP_WIDTH 24
// rw: integral gain of the fine stage, each tick [1/16777216 command/(period/65536)]
#define ACTUATOR_FINE_KI 0x034u
#define ACTUATOR_FINE_KI_MASK 0x00ffffffu
#define ACTUATOR_FINE_KI_SHIFT 0
#define ACTUATOR_FINE_KI_WIDTH 24
// rw: largest |command| of the fine stage
#define ACTUATOR_FINE_LIMIT 0x038u
#define ACTUATOR_FINE_LIMIT_MASK 0x00007fffu
#define ACTUATOR_FINE_LIMIT_SHIFT 0
#define ACTUATOR_FINE_LIMIT_WIDTH 15
// r: command of the fine stage
#define ACTUATOR_FINE_COMMAND 0x03cu
#define ACTUATOR_FINE_COMMAND_MASK 0x0000ffffu
#define ACTUATOR_FINE_COMMAND_SHIFT 0
#define ACTUATOR_FINE_COMMAND_WIDTH 16
// rw: derivative gain of the fine stage [1/65536 command/(period/65536/tick)]
#define ACTUATOR_FINE_KD 0x040u
#define ACTUATOR_FINE_KD_MASK 0x00ffffffu
#define ACTUATOR_FINE_KD_SHIFT 0
#define ACTUATOR_FINE_KD_WIDTH 24

#endif

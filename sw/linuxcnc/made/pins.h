// SPDX-License-Identifier: GPL-2.0-or-later
// Made by tables/linuxcnc.py from linuxcnc.toml and bus.toml: do not edit.
#ifndef MOIRE_LINUXCNC_PINS_H
#define MOIRE_LINUXCNC_PINS_H

#include <stdint.h>

#include <stddef.h>

#include <hal.h>

struct moire_pin {
    const char* name;
    hal_type_t type;
    hal_pin_dir_t direction;
    size_t place;  // of the pointer in its structure
};

struct node_pins {
    hal_bit_t* enable;
    hal_bit_t* reset;
    hal_float_t* packet_read_timeout;
    hal_float_t* set_point_delay;
    hal_bit_t* io_error;
    hal_bit_t* watchdog_has_bit;
    hal_bit_t* packet_error;
    hal_s32_t* packet_error_level;
    hal_bit_t* packet_error_exceeded;
    hal_u32_t* packet_error_total;
    hal_u32_t* replies_damaged;
    hal_u32_t* requests_refused;
    hal_u32_t* refused_cause;
    hal_float_t* latency;
    hal_float_t* lateness;
    hal_bit_t* pll_locked;
    hal_float_t* pll_phase_error;
    hal_float_t* capture_age;
    hal_float_t* drift;
    hal_bit_t* estop;
    hal_bit_t* fault;
    hal_u32_t* fault_cause;
    hal_bit_t* probe;
    hal_bit_t* ok;
};

static const struct moire_pin NODE_PINS[] = {
    {"enable", HAL_BIT, HAL_IN, offsetof(struct node_pins, enable)},
    {"reset", HAL_BIT, HAL_IN, offsetof(struct node_pins, reset)},
    {"packet-read-timeout", HAL_FLOAT, HAL_IN, offsetof(struct node_pins, packet_read_timeout)},
    {"set-point-delay", HAL_FLOAT, HAL_IN, offsetof(struct node_pins, set_point_delay)},
    {"io-error", HAL_BIT, HAL_IO, offsetof(struct node_pins, io_error)},
    {"watchdog.has-bit", HAL_BIT, HAL_IO, offsetof(struct node_pins, watchdog_has_bit)},
    {"packet-error", HAL_BIT, HAL_OUT, offsetof(struct node_pins, packet_error)},
    {"packet-error-level", HAL_S32, HAL_OUT, offsetof(struct node_pins, packet_error_level)},
    {"packet-error-exceeded", HAL_BIT, HAL_OUT, offsetof(struct node_pins, packet_error_exceeded)},
    {"packet-error-total", HAL_U32, HAL_OUT, offsetof(struct node_pins, packet_error_total)},
    {"replies-damaged", HAL_U32, HAL_OUT, offsetof(struct node_pins, replies_damaged)},
    {"requests-refused", HAL_U32, HAL_OUT, offsetof(struct node_pins, requests_refused)},
    {"refused-cause", HAL_U32, HAL_OUT, offsetof(struct node_pins, refused_cause)},
    {"latency", HAL_FLOAT, HAL_OUT, offsetof(struct node_pins, latency)},
    {"lateness", HAL_FLOAT, HAL_OUT, offsetof(struct node_pins, lateness)},
    {"pll-locked", HAL_BIT, HAL_OUT, offsetof(struct node_pins, pll_locked)},
    {"pll-phase-error", HAL_FLOAT, HAL_OUT, offsetof(struct node_pins, pll_phase_error)},
    {"capture-age", HAL_FLOAT, HAL_OUT, offsetof(struct node_pins, capture_age)},
    {"drift", HAL_FLOAT, HAL_OUT, offsetof(struct node_pins, drift)},
    {"estop", HAL_BIT, HAL_OUT, offsetof(struct node_pins, estop)},
    {"fault", HAL_BIT, HAL_OUT, offsetof(struct node_pins, fault)},
    {"fault-cause", HAL_U32, HAL_OUT, offsetof(struct node_pins, fault_cause)},
    {"probe", HAL_BIT, HAL_OUT, offsetof(struct node_pins, probe)},
    {"ok", HAL_BIT, HAL_OUT, offsetof(struct node_pins, ok)},
};

struct axis_pins {
    hal_float_t* scale;
    hal_bit_t* enable;
    hal_float_t* position_cmd;
    hal_bit_t* index_enable;
    hal_float_t* position_fb;
    hal_float_t* velocity_cmd;
    hal_float_t* velocity_fb;
    hal_float_t* f_error;
    hal_float_t* position;
    hal_float_t* position_latch;
    hal_s32_t* rawcounts;
    hal_bit_t* enabled;
    hal_bit_t* homed;
    hal_bit_t* streaming;
    hal_bit_t* limit_low;
    hal_bit_t* limit_high;
    hal_bit_t* saturated;
    hal_bit_t* fault;
    hal_u32_t* fault_cause;
    hal_u32_t* set_points_late;
    hal_u32_t* set_points_refused;
    hal_u32_t* ticks_extrapolated;
};

static const struct moire_pin AXIS_PINS[] = {
    {"scale", HAL_FLOAT, HAL_IN, offsetof(struct axis_pins, scale)},
    {"enable", HAL_BIT, HAL_IN, offsetof(struct axis_pins, enable)},
    {"position-cmd", HAL_FLOAT, HAL_IN, offsetof(struct axis_pins, position_cmd)},
    {"index-enable", HAL_BIT, HAL_IO, offsetof(struct axis_pins, index_enable)},
    {"position-fb", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, position_fb)},
    {"velocity-cmd", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, velocity_cmd)},
    {"velocity-fb", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, velocity_fb)},
    {"f-error", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, f_error)},
    {"position", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, position)},
    {"position-latch", HAL_FLOAT, HAL_OUT, offsetof(struct axis_pins, position_latch)},
    {"rawcounts", HAL_S32, HAL_OUT, offsetof(struct axis_pins, rawcounts)},
    {"enabled", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, enabled)},
    {"homed", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, homed)},
    {"streaming", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, streaming)},
    {"limit-low", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, limit_low)},
    {"limit-high", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, limit_high)},
    {"saturated", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, saturated)},
    {"fault", HAL_BIT, HAL_OUT, offsetof(struct axis_pins, fault)},
    {"fault-cause", HAL_U32, HAL_OUT, offsetof(struct axis_pins, fault_cause)},
    {"set-points-late", HAL_U32, HAL_OUT, offsetof(struct axis_pins, set_points_late)},
    {"set-points-refused", HAL_U32, HAL_OUT, offsetof(struct axis_pins, set_points_refused)},
    {"ticks-extrapolated", HAL_U32, HAL_OUT, offsetof(struct axis_pins, ticks_extrapolated)},
};

struct encoder_pins {
    hal_float_t* scale;
    hal_bit_t* reset;
    hal_bit_t* index_enable;
    hal_float_t* position;
    hal_float_t* velocity;
    hal_s32_t* count;
    hal_s32_t* rawcounts;
};

static const struct moire_pin ENCODER_PINS[] = {
    {"scale", HAL_FLOAT, HAL_IN, offsetof(struct encoder_pins, scale)},
    {"reset", HAL_BIT, HAL_IN, offsetof(struct encoder_pins, reset)},
    {"index-enable", HAL_BIT, HAL_IO, offsetof(struct encoder_pins, index_enable)},
    {"position", HAL_FLOAT, HAL_OUT, offsetof(struct encoder_pins, position)},
    {"velocity", HAL_FLOAT, HAL_OUT, offsetof(struct encoder_pins, velocity)},
    {"count", HAL_S32, HAL_OUT, offsetof(struct encoder_pins, count)},
    {"rawcounts", HAL_S32, HAL_OUT, offsetof(struct encoder_pins, rawcounts)},
};

struct digin_pins {
    hal_bit_t* in;
    hal_bit_t* in_not;
};

static const struct moire_pin DIGIN_PINS[] = {
    {"in", HAL_BIT, HAL_OUT, offsetof(struct digin_pins, in)},
    {"in-not", HAL_BIT, HAL_OUT, offsetof(struct digin_pins, in_not)},
};

#define CAUSE_LIMIT_LOW 1u
#define CAUSE_LIMIT_HIGH 2u
#define CAUSE_ESTOP 3u
#define CAUSE_FOLLOWING_ERROR 4u
#define CAUSE_ENCODER 5u
#define CAUSE_BUS_WATCHDOG 6u
#define CAUSE_DRIVE 7u
#define CAUSE_CPU 8u
#define CAUSE_PROFILE_UNDERRUN 9u
#define CAUSE_STEP_OVERRUN 10u
#define CAUSE_SERVO_OVERRUN 11u
#define CAUSE_SAMPLE_OVERRUN 12u
#define CAUSE_LINK_WATCHDOG 13u
#define CAUSE_LINK_LOST 32u
#define CAUSE_WATCHDOG 33u
#define CAUSE_NOT_ENABLED 34u
#define CAUSE_HOMING_FAILED 35u
#define CAUSE_NOT_PREPARED 36u
#define CAUSE_SET_POINT_LATE 37u
#define CAUSE_NOT_ALLOWED 39u
#define CAUSE_STREAM_ENDED 38u

static const char* const CAUSE_TEXTS[] = {
    [1] = "limit switch at the low end",
    [2] = "limit switch at the high end",
    [3] = "emergency stop",
    [4] = "following error too large",
    [5] = "encoder fault",
    [6] = "the bus is silent",
    [7] = "the drive reports a fault",
    [8] = "the soft core stopped or hangs",
    [9] = "the profile ran out of segments",
    [10] = "too many steps are pending: too fast for the step timing, or blocked",
    [11] = "a servo tick came before the motion engine had served the last one",
    [12] = "a sample came before the shared interpolation chain had served the last one",
    [13] = "no good packet came over the real-time link in time",
    [32] = "packets were lost for too long",
    [33] = "the watchdog of the link has expired",
    [34] = "the drive did not switch on in time",
    [35] = "the node could not home the axis",
    [36] = "the node did not begin the stream in time",
    [37] = "set-points were late for longer than the node extrapolates",
    [39] = "the pin enable of the node is 0",
    [38] = "the node has ended the stream",
};
#define CAUSE_TEXTS_END 40u

#define STATE_OFF 0u
#define STATE_HOLDING 1u
#define STATE_HOMING 2u
#define STATE_MOVING 3u
#define STATE_SETTLING 4u
#define STATE_STOPPING 5u
#define STATE_FAULTED 6u
#define STATE_PREPARED 7u
#define STATE_EXCITED 8u

#endif

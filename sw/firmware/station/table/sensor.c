// SPDX-License-Identifier: Apache-2.0
// sensor -- the absolute angle of the table, from the frames of a time-grating sensor.
//
// sensor_work must be called more often than frames come, every 10 ms: then it sees each good frame
// once and knows its age.
#include "station/table/sensor.h"

#include "core/clock.h"
#include "core/hardware.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "station/settings.h"

#define BAUD 115200u
#define GAP_CHARACTERS 3u  // longest pause within a frame
#define CHARACTER_BITS 10u

static uint32_t cycles_per_ms;
static uint32_t frames;    // good ones since the start
static uint32_t fresh_ms;  // when the last of them was sent; at first, the start
static uint32_t word;      // its angle, 2^-32 turn
static uint32_t changes;
static uint32_t wrong_crc, broken, missed;

static struct measurement {
    uint32_t since_ms;
    uint32_t first;  // 2^-32 turn
    int64_t sum;     // of the differences of the others from it
    uint32_t required, got;
} measurement;

bool sensor_built(void) {
    return peripherals_read(PERIPHERALS_BUILT) & PERIPHERALS_BUILT_SENSOR_MASK;
}

void sensor_start(unsigned axes) {
    uint32_t clk_hz = node_read(NODE_CLK_HZ);
    (void)axes;
    cycles_per_ms = clk_hz / 1000u;
    fresh_ms = clock_ms();
    frames = word = changes = wrong_crc = broken = missed = 0;
    measurement = (struct measurement){0};
    peripherals_write(PERIPHERALS_SENSOR_BIT_TIME,
                      (uint32_t)((16 * (uint64_t)clk_hz + BAUD / 2) / BAUD));
    peripherals_write(PERIPHERALS_SENSOR_GAP, clk_hz / BAUD * CHARACTER_BITS * GAP_CHARACTERS);
    peripherals_write(PERIPHERALS_SENSOR_ERRORS, PERIPHERALS_SENSOR_ERRORS_CLEAR_MASK);
    peripherals_write(PERIPHERALS_SENSOR_FRAMES, 0);
}

// Must be called before the counters of the hardware saturate.
static void count_errors(void) {
    uint32_t errors = peripherals_read(PERIPHERALS_SENSOR_ERRORS);
    if (errors == 0) return;
    peripherals_write(PERIPHERALS_SENSOR_ERRORS, PERIPHERALS_SENSOR_ERRORS_CLEAR_MASK);
    wrong_crc += FIELD_GET(errors, PERIPHERALS_SENSOR_ERRORS_CRC);
    broken += FIELD_GET(errors, PERIPHERALS_SENSOR_ERRORS_BROKEN);
    missed += FIELD_GET(errors, PERIPHERALS_SENSOR_ERRORS_MISSED);
}

static void measure(void) {
    struct measurement* m = &measurement;
    if (m->got == m->required || (int32_t)(fresh_ms - m->since_ms) <= 0) return;
    if (m->got == 0) m->first = word;
    m->sum += (int32_t)(word - m->first);
    m->got++;
}

void sensor_work(void) {
    uint32_t arrived = peripherals_read(PERIPHERALS_SENSOR_FRAMES);
    if (arrived == 0) return;
    peripherals_write(PERIPHERALS_SENSOR_FRAMES, 0);  // the count of the hardware saturates
    uint64_t reading = peripherals_read_wide(PERIPHERALS_SENSOR_READING);
    frames += arrived;
    changes += word != (uint32_t)reading;
    word = (uint32_t)reading;
    fresh_ms = clock_ms() - (uint32_t)(reading >> 32) / cycles_per_ms;
    count_errors();
    measure();
}

bool sensor_timed_out(void) {
    return clock_ms() - fresh_ms > (uint32_t)settings_get(BUS_SETTING_SENSOR_TIMEOUT);
}

uint32_t sensor_changes(void) { return changes; }

void sensor_measure(uint32_t required) {
    measurement = (struct measurement){.since_ms = clock_ms(), .required = required};
}

bool sensor_measured(void) { return measurement.got == measurement.required; }

// From 2^-32 turn to 0.01 arcsec above sensor_zero.
static uint32_t angle_of(uint32_t turn) {
    uint32_t angle = (uint32_t)(((uint64_t)turn * SENSOR_TURN + (1u << 31)) >> 32),
             zero = (uint32_t)settings_get(BUS_SETTING_SENSOR_ZERO);
    angle += angle < zero ? SENSOR_TURN - zero : 0u - zero;
    return angle == SENSOR_TURN ? 0 : angle;
}

uint32_t sensor_mean(void) {
    return angle_of(measurement.first +
                    (uint32_t)(int32_t)(measurement.sum / (int32_t)measurement.required));
}

uint8_t sensor_operation(uint8_t operation) {
    if (operation != BUS_OPERATION_SENSOR || !sensor_built()) return BUS_CAUSE_NOT_BUILT;
    count_errors();
    bus_reply_field(BUS_SENSOR_REPLY_ANGLE, angle_of(word), 4);
    bus_reply_field(BUS_SENSOR_REPLY_AGE, peripherals_read_wide(PERIPHERALS_SENSOR_READING) >> 32,
                    4);
    bus_reply_field(BUS_SENSOR_REPLY_TIMED_OUT, sensor_timed_out(), 1);
    bus_reply_field(BUS_SENSOR_REPLY_FRAMES, frames, 4);
    bus_reply_field(BUS_SENSOR_REPLY_WRONG_CRC, wrong_crc, 4);
    bus_reply_field(BUS_SENSOR_REPLY_BROKEN, broken, 4);
    bus_reply_field(BUS_SENSOR_REPLY_MISSED, missed, 4);
    return BUS_CAUSE_OK;
}

// SPDX-License-Identifier: Apache-2.0
// sensor -- each good frame once, its age known, as long as it is asked for more often than frames come.
#include "sensor.h"

#include "clock.h"
#include "hardware.h"
#include "line.h"
#include "line_protocol.h"
#include "settings.h"

#define BAUD 115200u
#define GAP_CHARACTERS 3u                       // longest pause within a frame
#define CHARACTER_BITS 10u

static uint32_t clk_per_ms;
static uint32_t frames;                         // good ones
static uint32_t fresh_ms;                       // when the last of them was sent; at first, when the wait for it began
static uint32_t word;                           // its angle, 2^-32 turn
static uint32_t changes;
static uint32_t wrong_crc, broken, missed;

static struct measurement {
    uint32_t since_ms;
    uint32_t first;                             // 2^-32 turn
    int64_t sum;                                // of what the others differ
    uint32_t wanted, got;
} measurement;

bool sensor_built(void)
{
    return links_read(LINKS_BUILT) & LINKS_BUILT_SENSOR_MASK;
}

void sensor_start(unsigned axes)
{
    uint32_t clk_hz = node_read(NODE_CLK_HZ);
    (void)axes;
    clk_per_ms = clk_hz / 1000u;
    frames = links_read(LINKS_SENSOR_FRAMES);
    fresh_ms = clock_ms();
    word = changes = wrong_crc = broken = missed = 0;
    measurement = (struct measurement){0};
    links_write(LINKS_SENSOR_BIT_TIME, (uint32_t)((16 * (uint64_t)clk_hz + BAUD / 2) / BAUD));
    links_write(LINKS_SENSOR_GAP, clk_hz / BAUD * CHARACTER_BITS * GAP_CHARACTERS);
    links_write(LINKS_SENSOR_ERRORS, LINKS_SENSOR_ERRORS_CLEAR_MASK);
}

static void count_errors(void)                  // before they reach their end
{
    uint32_t errors = links_read(LINKS_SENSOR_ERRORS);
    if (errors == 0) return;
    links_write(LINKS_SENSOR_ERRORS, LINKS_SENSOR_ERRORS_CLEAR_MASK);
    wrong_crc += FIELD_GET(errors, LINKS_SENSOR_ERRORS_CRC);
    broken += FIELD_GET(errors, LINKS_SENSOR_ERRORS_BROKEN);
    missed += FIELD_GET(errors, LINKS_SENSOR_ERRORS_MISSED);
}

static void measure(void)
{
    struct measurement *m = &measurement;
    if (m->got == m->wanted || (int32_t)(fresh_ms - m->since_ms) <= 0) return;
    if (m->got == 0) m->first = word;
    m->sum += (int32_t)(word - m->first);
    m->got++;
}

void sensor_work(void)
{
    uint32_t now = links_read(LINKS_SENSOR_FRAMES);
    if (now == frames) return;
    uint64_t reading = links_read_wide(LINKS_SENSOR_READING);
    frames = now;
    changes += word != (uint32_t)reading;
    word = (uint32_t)reading;
    fresh_ms = clock_ms() - (uint32_t)(reading >> 32) / clk_per_ms;
    count_errors();
    measure();
}

bool sensor_dead(void)
{
    return clock_ms() - fresh_ms > (uint32_t)settings_get(LINE_SETTING_SENSOR_PATIENCE);
}

uint32_t sensor_changes(void)
{
    return changes;
}

void sensor_measure(uint32_t wanted)
{
    measurement = (struct measurement){.since_ms = clock_ms(), .wanted = wanted};
}

bool sensor_measured(void)
{
    return measurement.got == measurement.wanted;
}

// From 2^-32 turn, above sensor_zero.
static uint32_t angle_of(uint32_t turn)
{
    uint32_t angle = (uint32_t)(((uint64_t)turn * SENSOR_TURN + (1u << 31)) >> 32), zero = (uint32_t)settings_get(LINE_SETTING_SENSOR_ZERO);
    angle += angle < zero ? SENSOR_TURN - zero : 0u - zero;
    return angle == SENSOR_TURN ? 0 : angle;
}

uint32_t sensor_mean(void)
{
    return angle_of(measurement.first + (uint32_t)(int32_t)(measurement.sum / (int32_t)measurement.wanted));
}

uint8_t sensor_operation(uint8_t operation)
{
    if (operation != LINE_OPERATION_SENSOR || !sensor_built()) return LINE_CAUSE_NOT_BUILT;
    count_errors();
    line_answer(LINE_SENSOR_REPLY_ANGLE, angle_of(word), 4);
    line_answer(LINE_SENSOR_REPLY_AGE, links_read_wide(LINKS_SENSOR_READING) >> 32, 4);
    line_answer(LINE_SENSOR_REPLY_DEAD, sensor_dead(), 1);
    line_answer(LINE_SENSOR_REPLY_FRAMES, frames, 4);
    line_answer(LINE_SENSOR_REPLY_WRONG_CRC, wrong_crc, 4);
    line_answer(LINE_SENSOR_REPLY_BROKEN, broken, 4);
    line_answer(LINE_SENSOR_REPLY_MISSED, missed, 4);
    return LINE_CAUSE_OK;
}

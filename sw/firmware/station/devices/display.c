// SPDX-License-Identifier: Apache-2.0
// display -- four lines of 20 characters: HD44780 behind an I2C port PCF8574.
//
// It is wired as on the common boards: P0 RS, P1 RW, P2 E, P3 back light, P4..P7 data. The display
// takes data when E falls and needs at most 37 us for it; a byte on the bus takes 90 us. Half lines
// are written when they change. After the display was absent all of them are written, and without a
// change one of them each second, which shows whether the display is still present.
#include "station/devices/display.h"

#include "core/clock.h"
#include "station/devices/i2c.h"

#define DEVICE 0x27u
#define RS 1u
#define E 4u
#define LIGHT 8u
#define SET_UP_MS 50u  // from power-up, and after clearing
#define RETRY_MS 1000u
#define PART (DISPLAY_COLUMNS / 2u)  // characters written at a time
#define PARTS (2u * DISPLAY_LINES)

static const uint8_t cell_address[PARTS] = {0x00, 0x0A, 0x40, 0x4A, 0x14, 0x1E, 0x54, 0x5E};
// To 8 bits from any state, once more in case the first came too soon, then to 4 bits.
static const uint8_t wake_up[] = {0x3, 0x3, 0x3, 0x3, 0x2};
static const uint8_t set_up[] = {0x28, 0x01, 0x06, 0x0C};  // two rows, clear, to the right, on

static char text[DISPLAY_LINES][DISPLAY_COLUMNS];
static bool changed[PARTS];
static bool present, under_way;
static uint8_t step;  // of setting up: wake_up, then set_up
static uint8_t out[2u + 4u * (1u + PART)], used;
static uint32_t last_ms;
static struct i2c_transfer transfer;

#define WAKE_STEPS (sizeof wake_up)
#define SET_UP_STEPS (sizeof wake_up + sizeof set_up)

static void put_nibble(unsigned nibble, unsigned rs) {
    uint8_t level = (uint8_t)(nibble << 4 | LIGHT | rs);
    out[used++] = level | E;
    out[used++] = level;
}

static void put_byte(unsigned byte, unsigned rs) {
    put_nibble(byte >> 4, rs);
    put_nibble(byte & 15u, rs);
}

static void send(void) {
    transfer = (struct i2c_transfer){.address = DEVICE, .write = out, .write_count = used};
    i2c_begin(I2C_DISPLAY, &transfer);
    under_way = true;
    last_ms = clock_ms();
}

// Sets RS before E rises.
static void begin(void) {
    used = 0;
    out[used++] = LIGHT;
}

static void set_up_step(void) {
    begin();
    if (step < WAKE_STEPS)
        put_nibble(wake_up[step], 0);
    else
        put_byte(set_up[step - WAKE_STEPS], 0);
    send();
}

static void write_part(unsigned part) {
    const char* character = &text[part / 2u][part % 2u * PART];
    begin();
    put_byte(0x80u | cell_address[part], 0);
    out[used++] = LIGHT | RS;
    for (unsigned n = 0; n < PART; n++) put_byte((uint8_t)character[n], RS);
    changed[part] = false;
    send();
}

static void ended(enum i2c_outcome outcome) {
    present = outcome == I2C_OK;
    if (!present)
        step = 0;
    else if (step < SET_UP_STEPS)
        step++;
    if (step == 0)
        for (unsigned part = 0; part < PARTS; part++) changed[part] = true;
}

void display_start(unsigned axes) {
    (void)axes;
    present = under_way = false;
    step = 0;
    last_ms = clock_ms();
    for (unsigned line = 0; line < DISPLAY_LINES; line++) display_show(line, "");
}

void display_work(void) {
    enum i2c_outcome outcome = i2c_outcome(I2C_DISPLAY);
    if (outcome == I2C_BUSY) return;
    if (under_way) ended(outcome);
    under_way = false;
    if (step < SET_UP_STEPS) {
        if (clock_ms() - last_ms >= (step == 0 ? RETRY_MS : SET_UP_MS)) set_up_step();
        return;
    }
    for (unsigned part = 0; part < PARTS; part++)
        if (changed[part]) return write_part(part);
    if (clock_ms() - last_ms >= RETRY_MS) write_part(0);
}

bool display_present(void) { return present; }

void display_show(unsigned line, const char* shown) {
    for (unsigned column = 0; column < DISPLAY_COLUMNS; column++) {
        char character = *shown ? *shown++ : ' ';
        if (text[line][column] != character) changed[2u * line + column / PART] = true;
        text[line][column] = character;
    }
}

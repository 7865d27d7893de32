// SPDX-License-Identifier: Apache-2.0
// keypad -- 34 keys on a key-pad controller TCA8418: 5 rows of 7, the last one short.
//
// The controller debounces the keys and queues up to ten events; reading its event register takes
// the oldest one. It is set up again whenever its registers are not as they were left, because it
// was absent or lost its power. Keys that were pressed before the node started do not count.
#include "station/devices/keypad.h"

#include "core/clock.h"
#include "station/devices/i2c.h"

#define DEVICE 0x34u
#define CONFIGURATION 0x01u
#define EVENT 0x04u
#define ROWS 0x1Du           // which lines of the controller belong to keys
#define NEWEST_EVENTS 0x20u  // of the configuration: when full, the oldest event goes
#define ROW_LINES 0x1Fu
#define COLUMN_LINES 0x7Fu
#define COLUMNS 7u
#define PRESSED 0x80u
#define CODES_PER_ROW 10u  // of the controller, which begin with 1
#define POLL_MS 20u
#define CHECK_MS 1000u
#define QUEUE 8u

enum step { CHECK, SET_ROWS, SET_COLUMNS, SET_CONFIGURATION, POLL };

static uint8_t step, value, out[2];
static bool present, under_way, fresh;  // fresh: all earlier events were discarded
static uint32_t last_ms, checked_ms;
static uint8_t keys[QUEUE], first, count;
static struct i2c_transfer transfer;

static void transfer_begin(uint8_t at, uint8_t data, bool writes) {
    out[0] = at;
    out[1] = data;
    transfer = (struct i2c_transfer){.address = DEVICE,
                                     .write = out,
                                     .write_count = writes ? 2 : 1,
                                     .read = &value,
                                     .read_count = !writes};
    i2c_begin(I2C_KEYPAD, &transfer);
    under_way = true;
    last_ms = clock_ms();
}

static void pressed(void) {
    unsigned code = (value & ~PRESSED) - 1u, row = code / CODES_PER_ROW,
             column = code % CODES_PER_ROW, key = row * COLUMNS + column;
    fresh = fresh || value == 0;
    if (!fresh || !(value & PRESSED) || column >= COLUMNS || key >= KEYPAD_KEYS || count == QUEUE)
        return;
    keys[(first + count++) % QUEUE] = (uint8_t)key;
}

static void ended(enum i2c_outcome outcome) {
    present = outcome == I2C_OK;
    if (!present) {
        step = CHECK;
        return;
    }
    switch (step) {
    case CHECK:
        step = value == ROW_LINES ? POLL : SET_ROWS;
        checked_ms = clock_ms();
        break;
    case POLL:
        pressed();
        if (clock_ms() - checked_ms > CHECK_MS) step = CHECK;
        break;
    default: step++; break;
    }
}

void keypad_start(unsigned axes) {
    (void)axes;
    step = CHECK;
    present = under_way = fresh = false;
    count = 0;
    last_ms = clock_ms();
}

void keypad_work(void) {
    enum i2c_outcome outcome = i2c_outcome(I2C_KEYPAD);
    if (outcome == I2C_BUSY) return;
    if (under_way) ended(outcome);
    under_way = false;
    switch (step) {
    case SET_ROWS: return transfer_begin(ROWS, ROW_LINES, true);
    case SET_COLUMNS: return transfer_begin(ROWS + 1, COLUMN_LINES, true);
    case SET_CONFIGURATION: return transfer_begin(CONFIGURATION, NEWEST_EVENTS, true);
    case POLL:
        if (clock_ms() - last_ms >= POLL_MS) transfer_begin(EVENT, 0, false);
        return;
    default:
        if (present || clock_ms() - last_ms >= CHECK_MS) transfer_begin(ROWS, 0, false);
        return;
    }
}

bool keypad_present(void) { return present; }

uint8_t keypad_take(void) {
    if (count == 0) return KEYPAD_NONE;
    uint8_t key = keys[first];
    first = (uint8_t)((first + 1u) % QUEUE);
    count--;
    return key;
}

// SPDX-License-Identifier: Apache-2.0
// i2c -- transfers on the I2C bus, one after the other, for the devices that share it.
//
// The hardware takes commands (start, a byte, stop) into a queue and answers each. At most AHEAD
// commands are in the queue. Those after an address wait until it was acknowledged: so a device
// that is busy or absent costs no more than its address.
#include "station/devices/i2c.h"

#include <stddef.h>

#include "core/hardware.h"

#define AHEAD 16u    // commands in the queue
#define PER_POLL 8u  // commands, and answers, in one call

enum { START, STOP, WRITE, READ, RECOVER };  // commands
enum { DONE, NOT_ACKNOWLEDGED };             // answers; others: the bus was lost, or stays low

static const struct i2c_transfer* transfers[I2C_CLIENTS];  // waiting or under way
static uint8_t outcomes[I2C_CLIENTS];
static uint8_t serving;           // client; I2C_CLIENTS: the bus is free or being cleared
static uint16_t asked, answered;  // commands of this transfer
static bool closing;              // it failed: the last command is under way

static uint32_t byte_command(unsigned command, uint8_t data) {
    return FIELD_PUT(PERIPHERALS_I2C_COMMAND, command) | FIELD_PUT(PERIPHERALS_I2C_DATA, data);
}

// The commands of one direction: start, address, bytes.
static unsigned direction_length(unsigned count) { return count ? 2u + count : 0; }

static unsigned command_count(const struct i2c_transfer* t) {
    unsigned both = direction_length(t->write_count) + direction_length(t->read_count);
    return (both ? both : 2u) + 1u;  // without bytes: is the device present?
}

static uint32_t command_at(const struct i2c_transfer* t, unsigned n) {
    bool reads = n >= direction_length(t->write_count) && t->read_count;
    if (n + 1 == command_count(t)) return byte_command(STOP, 0);
    if (reads) n -= direction_length(t->write_count);
    if (n == 0) return byte_command(START, 0);
    if (n == 1) return byte_command(WRITE, (uint8_t)(t->address << 1 | reads));
    if (!reads) return byte_command(WRITE, t->write[n - 2]);
    return byte_command(READ, 0) | FIELD_PUT(PERIPHERALS_I2C_ACKNOWLEDGE, n - 1u < t->read_count);
}

static void end_transfer(void) {
    transfers[serving] = NULL;
    serving = I2C_CLIENTS;
}

static void next_client(void) {
    for (unsigned client = 0; client < I2C_CLIENTS && serving == I2C_CLIENTS; client++)
        if (transfers[client]) serving = (uint8_t)client;
    asked = answered = 0;
    closing = false;
    if (serving < I2C_CLIENTS) outcomes[serving] = I2C_OK;
}

static void take_answer(const struct i2c_transfer* t, uint32_t word) {
    unsigned result = FIELD_GET(word, PERIPHERALS_I2C_ANSWER_RESULT),
             head = direction_length(t->write_count) + 2u, n = answered++;
    if (closing) return;
    if (result == DONE) {
        if (t->read_count && n >= head && n - head < t->read_count)
            t->read[n - head] = (uint8_t)FIELD_GET(word, PERIPHERALS_I2C_ANSWER_DATA);
    } else if (outcomes[serving] == I2C_OK) {
        outcomes[serving] = result == NOT_ACKNOWLEDGED && n == 1 ? I2C_ABSENT : I2C_FAILED;
    }
}

static void send_next(const struct i2c_transfer* t) {
    unsigned most = answered < 2u ? 2u : answered + AHEAD;
    for (unsigned n = 0; n < PER_POLL && asked < most && asked < command_count(t); n++)
        peripherals_write(PERIPHERALS_I2C, command_at(t, asked++));
}

void i2c_start(unsigned axes) {
    (void)axes;
    for (unsigned n = 0; n < I2C_CLIENTS; n++) {
        transfers[n] = NULL;
        outcomes[n] = I2C_OK;
    }
    serving = I2C_CLIENTS;
    peripherals_write(
        PERIPHERALS_I2C,
        byte_command(RECOVER, 0));  // a device may have been left in the middle of a byte
}

void i2c_begin(enum i2c_client client, const struct i2c_transfer* transfer) {
    transfers[client] = transfer;
}

enum i2c_outcome i2c_outcome(enum i2c_client client) {
    return transfers[client] ? I2C_BUSY : outcomes[client];
}

void i2c_work(void) {
    if (serving == I2C_CLIENTS) {
        // Answers to commands from before a restart are discarded.
        if (peripherals_read(PERIPHERALS_I2C_ANSWER) & PERIPHERALS_I2C_ANSWER_PRESENT_MASK ||
            peripherals_read(PERIPHERALS_I2C_STATE) & PERIPHERALS_I2C_STATE_BUSY_MASK)
            return;
        next_client();
        if (serving == I2C_CLIENTS) return;
        if (!(peripherals_read(PERIPHERALS_BUILT) & PERIPHERALS_BUILT_I2C_MASK)) {
            outcomes[serving] = I2C_ABSENT;
            return end_transfer();
        }
    }
    const struct i2c_transfer* t = transfers[serving];
    for (unsigned n = 0; n < PER_POLL && answered < asked; n++) {
        uint32_t word = peripherals_read(PERIPHERALS_I2C_ANSWER);
        if (!(word & PERIPHERALS_I2C_ANSWER_PRESENT_MASK)) break;
        take_answer(t, word);
    }
    if (outcomes[serving] == I2C_OK) {
        if (answered == command_count(t)) return end_transfer();
        return send_next(t);
    }
    if (answered < asked) return;
    if (closing) return end_transfer();
    closing = true;  // makes the device release the bus
    peripherals_write(PERIPHERALS_I2C,
                      byte_command(outcomes[serving] == I2C_ABSENT ? STOP : RECOVER, 0));
    asked++;
}

// SPDX-License-Identifier: Apache-2.0
// i2c -- transfers on the I2C bus, one after the other, for the devices that share it.
#ifndef MOIRE_I2C_H
#define MOIRE_I2C_H

#include <stdint.h>

enum i2c_client {
    I2C_STORE,
    I2C_KEYPAD,
    I2C_DISPLAY,
    I2C_CLIENTS
};  // each has one transfer at a time; an earlier one goes first
enum i2c_outcome { I2C_OK, I2C_ABSENT, I2C_FAILED, I2C_BUSY };

// Must stay as it is until the transfer has ended.
struct i2c_transfer {
    uint8_t address;                  // 7 bits
    uint8_t write_count, read_count;  // bytes written first, then bytes read; both may be 0
    const uint8_t* write;
    uint8_t* read;
};

void i2c_start(unsigned axes);
void i2c_work(void);
void i2c_begin(enum i2c_client client, const struct i2c_transfer* transfer);

// Of the last transfer of a client: absent if no device acknowledged the address, failed if the
// device or the bus broke it off.
enum i2c_outcome i2c_outcome(enum i2c_client client);

#endif

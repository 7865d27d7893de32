// SPDX-License-Identifier: Apache-2.0
// flash -- the serial flash of a node, through the port of rtl/cpu/serial_core.sv. The core takes
// longer for an instruction than the port for a byte, so nothing here waits for the port.
#include "update/flash.h"

#include "core/hardware.h"

#define PORT 0x10000u  // behind the register map
#define ENDS 0x100u
#define CONTROL 0x10004u
#define RUN 4u
#define TRIAL 8u

#define PROGRAM 0x02u
#define READ 0x03u
#define STATUS 0x05u
#define WRITE_ENABLE 0x06u
#define ERASE 0x20u
#define BUSY 1u
#define MOST_POLLS 2000u  // of the status, 10 instructions each: more than 3 ms up to 200 MHz

uint32_t flash_start(void) { return register_read(CONTROL); }

unsigned flash_image(void) { return register_read(PORT) >> 8 & 3; }

static uint8_t exchange(uint32_t byte) {
    register_write(PORT, byte);
    return (uint8_t)register_read(PORT);
}

static void command(uint32_t code, uint32_t address, uint32_t ends) {
    exchange(code);
    exchange(address >> 16 & 0xFF);
    exchange(address >> 8 & 0xFF);
    exchange((address & 0xFF) | ends);
}

void flash_read(uint32_t address, void* to, uint32_t bytes) {
    uint8_t* next = to;
    command(READ, address, 0);
    while (bytes--) *next++ = exchange(bytes ? 0 : ENDS);
}

void flash_erase(uint32_t address) {
    exchange(WRITE_ENABLE | ENDS);
    command(ERASE, address, ENDS);
}

void flash_program(uint32_t address, const void* from, uint32_t bytes) {
    const uint8_t* next = from;
    exchange(WRITE_ENABLE | ENDS);
    command(PROGRAM, address, 0);
    while (bytes--) exchange(*next++ | (bytes ? 0 : ENDS));
}

bool flash_busy(void) {
    exchange(STATUS);
    return exchange(ENDS) & BUSY;
}

bool flash_wait(void) {
    for (unsigned polls = 0; polls < MOST_POLLS; polls++)
        if (!flash_busy()) return true;
    return false;
}

void flash_run(unsigned image, bool trial) {
    register_write(CONTROL, RUN | image | (trial ? TRIAL : 0));
}

void flash_keep(void) { register_write(CONTROL, 0); }

// SPDX-License-Identifier: Apache-2.0
// register_bridge -- the registers of the compiled firmware, read and written by two functions of
// Python.
#include <stdint.h>

#include "core/hardware.h"

static uint32_t (*read_function)(uint32_t);
static void (*write_function)(uint32_t, uint32_t);

void register_bridge(uint32_t (*read)(uint32_t), void (*write)(uint32_t, uint32_t)) {
    read_function = read;
    write_function = write;
}

uint32_t register_read(uint32_t offset) { return read_function(offset); }

void register_write(uint32_t offset, uint32_t value) { write_function(offset, value); }

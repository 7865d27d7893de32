// SPDX-License-Identifier: Apache-2.0
// code -- the part of the firmware that the soft core executes from its flash, whose length and
// CRC-32 build.py writes into the memory.
#include "core/code.h"
#include "core/crc32.h"

#if HARDWARE_CODE
#define CODE ((const void*)0x20000000u)  // of rtl/cpu/soft_core.sv

const volatile struct {
    uint32_t bytes, crc;
} code_check = {0, 0};

bool code_intact(void) {
    return ~crc32_continue(UINT32_MAX, CODE, code_check.bytes) == code_check.crc;
}
#endif

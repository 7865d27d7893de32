// SPDX-License-Identifier: Apache-2.0
// memory -- the two functions that GCC calls to copy and clear structs; zig has its own.
#if defined(__riscv) && !defined(__clang__)
#include <stddef.h>

void* memset(void* to, int value, size_t bytes);
void* memcpy(void* restrict to, const void* restrict from, size_t bytes);

void* memset(void* to, int value, size_t bytes) {
    for (unsigned char* byte = to; bytes--; byte++) *byte = (unsigned char)value;
    return to;
}

void* memcpy(void* restrict to, const void* restrict from, size_t bytes) {
    const unsigned char* source = from;
    for (unsigned char* byte = to; bytes--; byte++) *byte = *source++;
    return to;
}
#endif

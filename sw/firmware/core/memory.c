// SPDX-License-Identifier: Apache-2.0
// memory -- the two functions that the compiler calls to fill and copy structs, by words where
// addresses and size are those of words. They are smaller than those of zig's library, and GCC has
// none without a library.
#ifdef __riscv
#include <stddef.h>
#include <stdint.h>

typedef uint32_t __attribute__((may_alias)) word;

void* memset(void* to, int value, size_t bytes);
void* memcpy(void* restrict to, const void* restrict from, size_t bytes);

void* memset(void* to, int value, size_t bytes) {
    uint8_t* byte = to;
    const uint8_t* end = byte + bytes;
    uint32_t two = (uint8_t)value | (uint32_t)(uint8_t)value << 8;
    if (((uintptr_t)to | bytes) % sizeof(word) == 0)
        for (; byte != end; byte += sizeof(word)) *(word*)byte = two << 16 | two;
    while (byte != end) *byte++ = (uint8_t)value;
    return to;
}

void* memcpy(void* restrict to, const void* restrict from, size_t bytes) {
    uint8_t* byte = to;
    const uint8_t *source = from, *end = source + bytes;
    if (((uintptr_t)to | (uintptr_t)from | bytes) % sizeof(word) == 0)
        for (; source != end; source += sizeof(word), byte += sizeof(word))
            *(word*)byte = *(const word*)source;
    while (source != end) *byte++ = *source++;
    return to;
}
#endif

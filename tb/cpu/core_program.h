/* SPDX-License-Identifier: Apache-2.0
 * What the programs that test the cores have in common: the registers that they use, the accesses
 * of each width to the memory, and the wrong accesses that both cores refuse.
 */
typedef unsigned int u32;
typedef unsigned short u16;
typedef unsigned char u8;

#define REGISTERS 0x80000000u
#ifndef BEHIND
#define BEHIND 0x80010000u /* the first address behind the registers that is wrong */
#endif
#define REGISTER(offset) (*(volatile u32*)(REGISTERS + (offset)))
#define A REGISTER(0x000)
#define B REGISTER(0x004)
#define ORDER REGISTER(0x008)
#define STACK REGISTER(0x00C)
#define STARTS REGISTER(0x010)
#define RESULT REGISTER(0xFFFC)
#define TWO(mnemonic)                                                        \
    do {                                                                     \
        u32 r;                                                               \
        __asm__ volatile(mnemonic " %0, %1, %2" : "=r"(r) : "r"(a), "r"(b)); \
        RESULT = r;                                                          \
    } while (0)

volatile u32 here[2];

/* The operations of rv32i with two operands. */
static inline void operate(u32 a, u32 b) {
    TWO("add");
    TWO("sub");
    TWO("and");
    TWO("or");
    TWO("xor");
    TWO("sll");
    TWO("srl");
    TWO("sra");
    TWO("slt");
    TWO("sltu");
}

/* Writes both words with each width, reads them with each width, and shows them. */
static inline void access_memory(u32 a, u32 b) {
    volatile u8* bytes = (volatile u8*)here;
    volatile u16* halves = (volatile u16*)here;
    here[0] = a;
    here[1] = b;
    for (int n = 0; n < 8; n++) RESULT = bytes[n];
    for (int n = 0; n < 8; n++) RESULT = (u32)((volatile signed char*)here)[n];
    for (int n = 0; n < 4; n++) RESULT = halves[n];
    for (int n = 0; n < 4; n++) RESULT = (u32)((volatile short*)here)[n];
    for (int n = 0; n < 4; n++) bytes[n] = (u8)(b >> 8 * n);
    for (int n = 0; n < 2; n++) halves[2 + n] = (u16)(a >> 16 * n);
    RESULT = here[0];
    RESULT = here[1];
    bytes[2] = 0x5A;
    halves[3] = 0xA55A;
    RESULT = here[0];
    RESULT = here[1];
}

/* The wrong accesses that all cores have in common; 0: none. */
static inline void access_wrongly(u32 order) {
    switch (order) {
    case 0: break;
    case 1: RESULT = *(volatile u32*)MEMORY_BYTES; break;
    case 2: *(volatile u32*)MEMORY_BYTES = 1; break;
    case 3: *(volatile u32*)BEHIND = 1; break;
    case 4: RESULT = *(volatile u32*)0xFFFFFFFCu; break;
    case 5: *(volatile u8*)REGISTERS = 1; break;
    case 6: *(volatile u16*)(REGISTERS + 2) = 1; break;
    default: break;
    }
}

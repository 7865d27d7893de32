/* SPDX-License-Identifier: Apache-2.0
 * The program that tb/cpu/test_soft_core.py runs on the soft core. It takes two operands from the
 * registers, applies every instruction of rv32im that a compiler uses and each width of memory
 * access to them, and writes the results to the registers, one after the other. Then it executes
 * the wrong access that the register ORDER selects; all orders above 0 must trap.
 */
typedef unsigned int u32;
typedef unsigned short u16;
typedef unsigned char u8;

#define REGISTERS 0x80000000u
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

__asm__(
    ".section .start, \"ax\"\n"
    ".globl _start\n"
    "_start:\n"
    "    lui t0, 0x80000\n"
    "    sw sp, 12(t0)\n"
    "    j main\n");

u32 starts = 0x1000; /* a reset does not clear the memory */
volatile u32 here[2];

void main(void) {
    STARTS = ++starts;
    for (;;) {
        u32 a = A, b = B;
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
        TWO("mul");
        TWO("mulh");
        TWO("mulhsu");
        TWO("mulhu");
        TWO("div");
        TWO("divu");
        TWO("rem");
        TWO("remu");

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
        RESULT = ((volatile u8*)REGISTERS)[1]; /* a byte of a register may be read */

        switch (ORDER) {
        case 0: break;
        case 1: RESULT = *(volatile u32*)MEMORY_BYTES; break;
        case 2: *(volatile u32*)MEMORY_BYTES = 1; break;
        case 3: *(volatile u32*)(REGISTERS + 0x10000) = 1; break;
        case 4: RESULT = *(volatile u32*)0xFFFFFFFCu; break;
        case 5: *(volatile u8*)REGISTERS = 1; break;
        case 6: *(volatile u16*)(REGISTERS + 2) = 1; break;
        case 7: __asm__ volatile("lw t0, 2(%0)" : : "r"(here) : "t0"); break;
        case 8: __asm__ volatile("sh t0, 1(%0)" : : "r"(here)); break;
        case 9: __asm__ volatile(".word 0"); break;
        case 10: __asm__ volatile("ebreak"); break;
        case 11: ((void (*)(void))REGISTERS)(); break;
        case 12: ((void (*)(void))0x40000000)(); break;
        case 13: __asm__ volatile("jr %0" : : "r"(2)); break;
        default: break;
        }
    }
}

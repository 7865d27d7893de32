/* SPDX-License-Identifier: Apache-2.0
 * The program that tb/cpu/test_soft_core.py runs on the soft core. It takes two operands from the
 * registers, applies every instruction of rv32imc that a compiler uses and each width of memory
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

/* Compressed instructions: `code` computes a0 from a0 (operand a) and a1 (operand b). It may change
 * a2 and a3, and a4 is the address of two words. */
#define COMPRESSED(code)                                                             \
    do {                                                                             \
        register u32 x __asm__("a0") = a;                                            \
        register u32 y __asm__("a1") = b;                                            \
        register volatile u32* z __asm__("a4") = here;                               \
        __asm__ volatile(code : "+r"(x), "+r"(y), "+r"(z) : : "a2", "a3", "memory"); \
        RESULT = x;                                                                  \
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

        COMPRESSED("c.add a0, a1");
        COMPRESSED("c.sub a0, a1");
        COMPRESSED("c.and a0, a1");
        COMPRESSED("c.or a0, a1");
        COMPRESSED("c.xor a0, a1");
        COMPRESSED("c.mv a0, a1");
        COMPRESSED("c.addi a0, -32");
        COMPRESSED("c.andi a0, 21");
        COMPRESSED("c.slli a0, 7");
        COMPRESSED("c.srli a0, 31");
        COMPRESSED("c.srai a0, 3");
        COMPRESSED("c.li a0, -7");
        COMPRESSED("c.lui a0, 0xfffe1");
        COMPRESSED("c.sw a0, 4(a4)\n c.sw a1, 0(a4)\n c.lw a0, 0(a4)");
        COMPRESSED(
            "c.addi16sp sp, -32\n c.swsp a0, 28(sp)\n c.addi4spn a2, sp, 28\n"
            "c.lw a0, 0(a2)\n c.add a0, a1\n c.swsp a0, 4(sp)\n c.lwsp a0, 4(sp)\n"
            "c.addi16sp sp, 32");
        COMPRESSED(
            "c.li a2, 0\n c.beqz a0, 1f\n c.addi a2, 1\n 1: c.bnez a1, 2f\n"
            "c.addi a2, 2\n 2: c.mv a0, a2");
        COMPRESSED("la a2, 1f\n c.jr a2\n c.li a0, 0\n 1: c.addi a0, 1");
        COMPRESSED(
            "c.mv a3, ra\n la a2, 1f\n c.jalr a2\n 1: sub a0, a0, ra\n c.add a0, a2\n"
            "c.mv ra, a3");
        COMPRESSED("c.mv a3, ra\n c.jal 1f\n c.li a0, 0\n 1: c.mv ra, a3");
        /* instructions of 32 bits in the middle of a word, in a row and after a jump */
        COMPRESSED(".p2align 2\n c.nop\n add a0, a0, a1\n sub a1, a0, a1\n xor a0, a0, a1\n c.nop");
        COMPRESSED("c.j 1f\n .p2align 2\n c.nop\n 1: addi a0, a0, 1000\n add a0, a0, a1");
        COMPRESSED(
            "c.li a2, 5\n .p2align 2\n c.nop\n 1: add a0, a0, a1\n c.addi a2, -1\n bnez a2, 1b");

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
        case 10: __asm__ volatile(".option push\n .option norvc\n ebreak\n .option pop"); break;
        case 11: ((void (*)(void))REGISTERS)(); break;
        case 12: ((void (*)(void))0x40000000)(); break;
        case 13: __asm__ volatile("c.ebreak"); break;
        default: break;
        }
    }
}

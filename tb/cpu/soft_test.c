/* SPDX-License-Identifier: Apache-2.0
 * The program that tb/cpu/test_soft_core.py runs on the soft core. It takes two operands from the
 * registers, applies every instruction of rv32imc that a compiler uses and each width of memory
 * access to them, and writes the results to the registers, one after the other. Then it executes
 * the wrong access that the register ORDER selects; all orders above 0 must trap.
 */
#define CODE 0x20000000u /* the flash; it has CODE_BYTES at most */
#define CODE_BYTES 8192u
#include "core_program.h"

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
    "    tail main\n");

u32 starts = 0x1000; /* a reset does not clear the memory */

void main(void) {
    STARTS = ++starts;
    for (;;) {
        u32 a = A, b = B, order;
        operate(a, b);
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

        access_memory(a, b);
        RESULT = ((volatile u8*)REGISTERS)[1]; /* a byte of a register may be read */

        order = ORDER;
        switch (order) {
        case 7: __asm__ volatile("lw t0, 2(%0)" : : "r"(here) : "t0"); break;
        case 8: __asm__ volatile("sh t0, 1(%0)" : : "r"(here)); break;
        case 9: __asm__ volatile(".word 0"); break;
        case 10: __asm__ volatile(".option push\n .option norvc\n ebreak\n .option pop"); break;
        case 11: ((void (*)(void))REGISTERS)(); break;
        case 12: ((void (*)(void))0x40000000)(); break;
        case 13: __asm__ volatile("c.ebreak"); break;
        case 14: *(volatile u32*)CODE = 1; break;
        case 15: RESULT = *(volatile u32*)(CODE + CODE_BYTES); break;
        default: access_wrongly(order); break;
        }
    }
}

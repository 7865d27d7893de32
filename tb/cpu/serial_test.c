/* SPDX-License-Identifier: Apache-2.0
 * The program that tb/cpu/test_serial_core.py runs on the serial core. It takes two operands from
 * the registers, applies every instruction of rv32i that a compiler uses and each width of memory
 * access to them, and writes the results to the registers, one after the other. Then it makes the
 * wrong access that the register ORDER selects; all orders from 1 to 8 must trap. The orders 16 and
 * 17 use the port of the flash.
 */
#define BEHIND 0x80020000u /* behind the port of the flash */
#include "core_program.h"

#define PORT(offset) (*(volatile u32*)(0x80010000u + (offset)))
#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)
#define ONE(mnemonic, number)                                                     \
    do {                                                                          \
        u32 r;                                                                    \
        __asm__ volatile(mnemonic " %0, %1, %2" : "=r"(r) : "r"(a), "i"(number)); \
        RESULT = r;                                                               \
    } while (0)
#define BRANCH(mnemonic, bit)                                               \
    __asm__ volatile(mnemonic " %1, %2, 1f\n j 2f\n 1: ori %0, %0, %3\n 2:" \
                     : "+r"(taken)                                          \
                     : "r"(a), "r"(b), "i"(bit))

__asm__(
    ".section .start, \"ax\"\n"
    ".globl _start\n"
    "_start:\n"
    "    li sp, " TEXT(MEMORY_BYTES) "\n"
    "    lui t0, 0x80000\n"
    "    sw sp, 12(t0)\n"
    "    j main\n");

u32 starts = 0x1000; /* each reset copies it again */

void main(void) {
    STARTS = ++starts;
    for (;;) {
        u32 a = A, b = B, taken = 0, upper, after, order;
        operate(a, b);
        ONE("addi", -32);
        ONE("andi", 21);
        ONE("ori", 21);
        ONE("xori", 21);
        ONE("slti", 5);
        ONE("sltiu", 5);
        ONE("slli", 7);
        ONE("srli", 31);
        ONE("srai", 3);
        BRANCH("beq", 1);
        BRANCH("bne", 2);
        BRANCH("blt", 4);
        BRANCH("bge", 8);
        BRANCH("bltu", 16);
        BRANCH("bgeu", 32);
        RESULT = taken;
        __asm__ volatile("lui %0, 0x12345" : "=r"(upper));
        RESULT = upper;
        __asm__ volatile(
            "mv %0, %1\n la t0, 1f\n jalr t1, 0(t0)\n li %0, 0\n 1: addi %0, %0, 1\n"
            "jal t1, 2f\n li %0, 0\n 2:"
            : "=&r"(after)
            : "r"(a)
            : "t0", "t1");
        RESULT = after;

        access_memory(a, b);

        order = ORDER;
        switch (order) {
        case 7: ((void (*)(void))REGISTERS)(); break;
        case 8: ((void (*)(void))0x40000000)(); break;
        case 16: /* a byte for the flash: B */
            PORT(0) = b;
            RESULT = PORT(0);
            RESULT = PORT(4);
            break;
        case 17: PORT(4) = b; break; /* another image */
        default: access_wrongly(order); break;
        }
    }
}

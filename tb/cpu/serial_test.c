/* SPDX-License-Identifier: Apache-2.0
 * The program that tb/cpu/test_serial_core.py runs on the serial core. It takes two operands from
 * the registers, applies every instruction of rv32i that a compiler uses and each width of memory
 * access to them, and writes the results to the registers, one after the other. Then it makes the
 * wrong access that the register ORDER selects; all orders above 0 must trap.
 */
typedef unsigned int u32;
typedef unsigned short u16;
typedef unsigned char u8;

#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)
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
volatile u32 here[2];

void main(void) {
    STARTS = ++starts;
    for (;;) {
        u32 a = A, b = B, taken = 0, upper, after;
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

        switch (ORDER) {
        case 0: break;
        case 1: RESULT = *(volatile u32*)MEMORY_BYTES; break;
        case 2: *(volatile u32*)MEMORY_BYTES = 1; break;
        case 3: *(volatile u32*)(REGISTERS + 0x10000) = 1; break;
        case 4: RESULT = *(volatile u32*)0xFFFFFFFCu; break;
        case 5: *(volatile u8*)REGISTERS = 1; break;
        case 6: *(volatile u16*)(REGISTERS + 2) = 1; break;
        case 7: ((void (*)(void))REGISTERS)(); break;
        case 8: ((void (*)(void))0x40000000)(); break;
        default: break;
        }
    }
}

# SPDX-License-Identifier: Apache-2.0
"""The results that tb/cpu/serial_test.c must write: those of rv32i for two operands, in the order
in which the program writes them.
"""

from tb.cpu.core_program import MASK, memory_results, operation_results, signed


def results(a, b):
    sa, sb = signed(a), signed(b)
    out = operation_results(a, b)
    out += [a - 32, a & 21, a | 21, a ^ 21, sa < 5, a < 5, a << 7, a >> 31, sa >> 3]
    out += [
        (a == b) + 2 * (a != b) + 4 * (sa < sb) + 8 * (sa >= sb) + 16 * (a < b) + 32 * (a >= b),
        0x12345000,
        a + 1,
    ]
    out += memory_results(a, b)
    return [int(x) & MASK for x in out]

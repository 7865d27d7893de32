# SPDX-License-Identifier: Apache-2.0
"""The results that tb/cpu/serial_test.c must write: those of rv32i for two operands, in the order
in which the program writes them.
"""

from tb.cpu.soft_core import MASK, signed


def results(a, b):
    sa, sb, n = signed(a), signed(b), b & 31
    out = [a + b, a - b, a & b, a | b, a ^ b, a << n, a >> n, sa >> n, sa < sb, a < b]
    out += [a - 32, a & 21, a | 21, a ^ 21, sa < 5, a < 5, a << 7, a >> 31, sa >> 3]
    out += [
        (a == b) + 2 * (a != b) + 4 * (sa < sb) + 8 * (sa >= sb) + 16 * (a < b) + 32 * (a >= b),
        0x12345000,
        a + 1,
    ]
    memory = a.to_bytes(4, "little") + b.to_bytes(4, "little")
    halves = [int.from_bytes(memory[k : k + 2], "little") for k in range(0, 8, 2)]
    out += [*memory, *(signed(x, 8) for x in memory), *halves, *(signed(x, 16) for x in halves)]
    out += [b, a, b & ~0xFF0000 | 0x5A0000, a & 0xFFFF | 0xA55A0000]
    return [int(x) & MASK for x in out]

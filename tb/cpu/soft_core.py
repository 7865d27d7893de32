# SPDX-License-Identifier: Apache-2.0
"""The results that tb/cpu/soft_test.c must write: those of rv32imc for two operands, in the order
in which the program writes them.
"""

from tb.cpu.core_program import MASK, memory_results, operation_results, signed


def divide(a, b):
    """Quotient and remainder as RISC-V defines them: rounded towards zero, and with fixed results
    for a divisor of 0. Overflow needs no rule: the lowest bits of the quotient are its result.
    """
    if b == 0:
        return -1, a
    quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    return quotient, a - quotient * b


def results(a, b):
    sa, sb = signed(a), signed(b)
    out = [
        *operation_results(a, b),
        a * b,
        sa * sb >> 32,
        sa * b >> 32,
        a * b >> 32,
    ]
    (div, rem), (divu, remu) = divide(sa, sb), divide(a, b)
    out += [div, divu, rem, remu]
    word = 1 << 32
    out += [a + b, a - b, a & b, a | b, a ^ b, b, a - 32, a & 21, a << 7, a >> 31, sa >> 3, -7]
    out += [-31 << 12, b, a + b, (a != 0) + 2 * (b == 0), a + 1, a, a]
    out += [(a + b) % word ^ a, a + b + 1000, a + 5 * b]
    out += [*memory_results(a, b), a >> 8 & 0xFF]
    return [int(x) & MASK for x in out]

# SPDX-License-Identifier: Apache-2.0
"""The wires between the soft core and the flash from which it executes."""

from firmware.build import CODE_AT
from tb.cpu.code_cache import WAKE

REGISTERS = 0x80000000  # where the program of the node adds the address of an access
BITS = 32  # of the command, with 24 that the flash ignores
AWAKE = 64 * 65  # cycles after a reset


def test_the_flash_is_woken_after_a_reset(node):
    node.set(rst=1)
    node.run(2)
    node.set(rst=0)
    sent = []
    for cycle in range(2 * BITS):
        cs_n, sclk, mosi = node.levels("flash_cs_n", "flash_sclk", "flash_mosi")
        assert (cs_n, sclk) == (0, cycle % 2)
        if sclk:
            sent.append(mosi)
        node.run(1)
    assert int("".join(map(str, sent)), 2) == WAKE
    assert node.levels("flash_cs_n", "flash_sclk") == (1, 0)


def test_the_words_of_the_flash_come_from_its_pin(node):
    node.run(AWAKE)
    for line, level in enumerate((1, 0, 1)):
        node.set(flash_miso=level)
        word = node.access((CODE_AT + 32 * line - REGISTERS) % (1 << 32))
        assert word == level * 0xFFFFFFFF

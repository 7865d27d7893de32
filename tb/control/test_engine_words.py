# SPDX-License-Identifier: Apache-2.0
"""engine_words: every word of the map against the model, and that every setting of the engine has
its register, in the unit that docs/engine.md states.
"""

import cocotb
from cocotb.triggers import Timer

from tables.engine_words import FILTER_VALUE, words
from tables.microcode.numbers import FILTER_SETTINGS, OPERANDS, SETTINGS
from tb.bench import run
from tb.control.engine_words import facts


@cocotb.test()
async def latency_is_0_and_every_word_is_that_of_the_model(dut):
    for kind in range(4):
        for word in range(64):
            dut.kind.value, dut.word.value = kind, word
            await Timer(1, "ns")
            want = facts(kind, word)
            got = {name: int(getattr(dut, name).value) for name in want}
            assert got == want, f"block {kind}, word {word:#x}"


def test_every_setting_of_the_engine_has_one_register():
    names = [w.name for w in words()]
    assert len(names) == len(set(names))
    assert {*SETTINGS, FILTER_VALUE} <= set(names)
    assert all(w.at ^ 0x10 == OPERANDS[w.name] for w in words() if w.name in OPERANDS)
    first = OPERANDS["b0"]
    assert [OPERANDS[name] - first for name in FILTER_SETTINGS] == list(range(6))


def test_values_are_shifted_to_the_units_of_the_engine():
    shifted = {w.name: w.shift for w in words() if w.shift}
    assert shifted == dict(
        ka=8, stop_deceleration=8, output_limit=16, override=16, integral_limit=24, filter_value=2
    )


def test_engine_words():
    run("engine_words", __file__)

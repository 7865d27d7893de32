# SPDX-License-Identifier: Apache-2.0
"""Tests of tables/modules.py: each line of a header is understood or refused with its file and
line, the table is readable, and ports and latencies keep their rules.
"""

import re

import pytest

from tables import modules

HEADER = """// SPDX-License-Identifier: Apache-2.0
// thing -- do something with levels, and report
// what was done.
//
//   y = b0 x
//
// latency  2 cycles from valid to done, and then
//          2 more
// rate     one level per cycle
// accuracy within 1 LSB
// behaviour rounds half up; and
//          never down
// model    tb/thing.py
//
// Words pass while it runs, and
// after that.
module thing;
"""


def test_long_keys_are_keys_and_formulae_and_sentences_belong_to_none():
    assert modules.header(HEADER) == (
        "thing",
        {
            "purpose": "do something with levels, and report what was done.",
            "latency": "2 cycles from valid to done, and then 2 more",
            "rate": "one level per cycle",
            "accuracy": "within 1 LSB",
            "behaviour": "rounds half up; and never down",
            "model": "tb/thing.py",
        },
    )


@pytest.mark.parametrize(
    "line, complaint",
    [
        ("// acuracy  within 1 LSB", "thing.sv:10: `acuracy` is no known key"),
        ("// Accuracy within 1 LSB", "thing.sv:10: `Accuracy` is no known key"),
        ("// one LSB at most", "thing.sv:10: `one` is no known key"),
        ("// latency  3 cycles", "thing.sv:10: the key `latency` is there twice"),
    ],
)
def test_another_key_is_refused_with_file_and_line(line, complaint):
    with pytest.raises(ValueError) as refused:
        modules.header(HEADER.replace("// accuracy within 1 LSB", line), "thing.sv")
    assert complaint in str(refused.value)


def test_every_module_is_in_the_table_and_no_cell_is_long():
    made = modules.made()[modules.PAGE]
    rows = [
        line.strip("| ").split(" | ")
        for line in made.partition(modules.BEGIN)[2].splitlines()
        if re.match(r"\|.*\.sv\)", line)
    ]
    assert len(rows) == len(list((modules.ROOT / "rtl").rglob("*.sv"))) > 80
    for row in rows:
        assert all(
            len(re.sub(r"\]\([^)]*\)", "]", cell)) <= modules.LONGEST_CELL for cell in row
        ), row


MODULES = sorted((modules.ROOT / "rtl").rglob("*.sv"))


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_no_fact_holds_another_key(path):
    facts = modules.header(path.read_text(), path)[1]
    keys = "|".join(modules.KEYS)
    held = {key: re.findall(rf"  +({keys}) ", text) for key, text in facts.items()}
    assert not any(held.values()), held


def test_the_page_is_fresh():
    assert modules.main(["--check"]) == 0


@pytest.mark.parametrize(
    "text, short",
    [
        ("Do this. Then that.", "Do this"),
        ("short; and more", "short; and more"),
        (f"long; {'x' * 200}", "long"),
        (f"long: {'x' * 200}; y", "long"),
    ],
)
def test_a_cell_is_the_first_sentence_without_its_details(text, short):
    assert modules.brief(text) == short


STAND_ALONE = {  # instantiated by no other module, and the reason why they exist
    "node": "a product",
    "relay": "a product",
    "encoder_counter": "a product: a counter on the bus of another design",
    "wishbone_port": "a product: the registers on the bus of another design",
    "axi_lite_port": "a product: the registers on the bus of another design",
    "arctan_pipelined": "the arctan without multipliers; narrow samples are correctly rounded",
    "arctan_iterative": "the small alternative to arctan_pipelined",
    "arctan_table": "the method of S0",
    "count_outlier_filter": "the method of S0",
    "peak_offset_tracker": "the method of S0",
}


def test_every_module_is_part_of_another_or_has_a_reason_to_be_alone():
    texts = {
        path.stem: re.sub(r"//.*", "", path.read_text())
        for path in (modules.ROOT / "rtl").rglob("*.sv")
    }
    part = {
        name
        for name in texts
        for other, text in texts.items()
        if other != name and re.search(rf"^\s*{name}\s+(#\s*\(|u_\w+)", text, re.MULTILINE)
    }
    assert set(texts) - part == set(STAND_ALONE)

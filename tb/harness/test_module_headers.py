# SPDX-License-Identifier: Apache-2.0
"""tables/modules.py: each line of a header is understood or refused with its file and line, and the
table can be read.
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
// latency  2 clk from valid to done, and then
//          2 more           rate  one level per clk
// accuracy within 1 LSB
// rounding half up; and
//          never down
// model    tb/thing.py
//
// Words pass while it runs, and
// after that.
module thing;
"""


def test_keys_of_eight_letters_are_keys_and_formulae_and_sentences_belong_to_none():
    assert modules.header(HEADER) == (
        "thing",
        {
            "purpose": "do something with levels, and report what was done.",
            "latency": "2 clk from valid to done, and then 2 more",
            "rate": "one level per clk",
            "accuracy": "within 1 LSB",
            "rounding": "half up; and never down",
            "model": "tb/thing.py",
        },
    )


@pytest.mark.parametrize(
    "line, complaint",
    [
        ("// acuracy  within 1 LSB", "thing.sv:9: `acuracy` is no known key"),
        ("// Accuracy within 1 LSB", "thing.sv:9: `Accuracy` is no known key"),
        ("// one LSB at most", "thing.sv:9: `one` is no known key"),
        ("// latency  3 clk", "thing.sv:9: the key `latency` stands twice"),
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


def test_the_rows_that_were_garbled_say_their_latency_alone():
    made = modules.made()[modules.PAGE]
    for name, latency in (
        ("quadrature_encoder", "2 clk from target to the edge, if `spacing` allows it"),
        (
            "arctan_iterative",
            "24, 28, 30 clk from valid to done for W = 8, 9, 10, 23 clk for wider samples",
        ),
        (
            "signal_monitor",
            "from valid to bits 2, 5..9 2 clk, bit 4 5 clk, bits 0, 1 10 clk, bits 3, 10..12 14 clk, "
            "amplitude 9 clk; 1 clk from phase_jump, lost_count",
        ),
    ):
        row = next(line for line in made.splitlines() if f"| [{name}](" in line)
        assert f" | {latency} | " in row


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


STAND_ALONE = {  # instantiated by no other module, and why they are there
    "node": "a product",
    "relay": "a product",
    "encoder_counter": "a product: a counter on somebody else's bus",
    "arctan_iterative": "the small one beside arctan_pipelined",
    "arctan_table": "as S0 prints it",
    "count_outlier_filter": "as S0 prints it",
    "peak_offset_tracker": "as S0 prints it",
}


def test_every_module_is_part_of_another_or_stands_alone_for_a_reason():
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

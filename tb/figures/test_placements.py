# SPDX-License-Identifier: Apache-2.0
"""The figure of the boards places a design again only if nextpnr would see something new."""

from dataclasses import replace

import pytest

from boards import board, build, machine
from boards.fit import fit
from figures import boards
from figures.synthesis import NotEndedError, SynthesisError

NETLIST = """{"cells": {"$auto$rtl/axis.sv:%d$%d": {"type": "LUT4", "parameters": {"INIT": "%s"},
"attributes": {"module_src": "rtl/node.sv:%d.1", "src": "rtl/axis.sv:%d.1"}, "connections": {}}}}"""


@pytest.fixture
def design(monkeypatch, tmp_path):
    monkeypatch.setattr(boards, "RESULTS", tmp_path / "results")
    return fit(board.named("colorlight_i5"), machine.named("mill"))


def state(design, path, line, number, init):
    """The state of a netlist with one cell."""
    path.write_text(NETLIST % (line, number, init, line, line))
    return build.netlist_state(design, path)


def test_a_netlist_is_another_if_a_cell_is_but_not_if_lines_or_numbers_are(design, tmp_path):
    before = state(design, tmp_path / "netlist.json", 10, 3, "0110")
    assert state(design, tmp_path / "netlist.json", 12, 4, "0110") == before
    assert state(design, tmp_path / "netlist.json", 10, 3, "0111") != before


def test_another_pin_or_board_is_another_placement(design):
    other = fit(board.named("colorlight_i9"), machine.named("mill"))
    assert build.told(other) != build.told(design)


@pytest.mark.parametrize(
    "option", [{"synthesis": "-nowidelut"}, {"place": ["--router", "router1"]}]
)
def test_another_option_of_a_tool_is_another_placement(design, option):
    part = replace(design.board.part, **option)
    other = replace(design, board=replace(design.board, part=part))
    assert build.state(other) != build.state(design)


def test_a_design_is_synthesised_again_only_if_its_sources_have_changed(
    design, monkeypatch, tmp_path
):
    calls = []

    def synthesise():
        calls.append(1)
        (tmp_path / "netlist.json").write_text(NETLIST % (1, 1, "0110", 1, 1))
        return tmp_path / "netlist.json"

    first = boards.netlist_state(design, synthesise)
    assert boards.netlist_state(design, synthesise) == first and len(calls) == 1
    monkeypatch.setattr(build, "state", lambda _: "other sources")
    assert boards.netlist_state(design, synthesise) == first and len(calls) == 2


def test_a_result_is_kept_for_its_seed_and_netlist_alone(design):
    boards.RESULTS.mkdir()
    assert boards.once(design, 1, "a", lambda: 51.5) == 51.5
    assert boards.once(design, 1, "a", lambda: 0) == 51.5
    assert boards.once(design, 2, "a", lambda: 52.5) == 52.5
    assert boards.once(design, 1, "b", lambda: 53.5) == 53.5


def test_a_tool_that_failed_is_a_result_too(design):
    boards.RESULTS.mkdir()

    def fails():
        raise SynthesisError("no way through the part")

    for measure in (fails, lambda: 51.5):
        with pytest.raises(SynthesisError, match="no way through"):
            boards.once(design, 1, "a", measure)


def test_a_tool_that_did_not_end_in_time_is_run_again(design):
    boards.RESULTS.mkdir()

    def takes_long():
        raise NotEndedError("place and route has not ended after 180 minutes")

    with pytest.raises(NotEndedError):
        boards.once(design, 1, "a", takes_long)
    assert boards.once(design, 1, "a", lambda: 51.5) == 51.5

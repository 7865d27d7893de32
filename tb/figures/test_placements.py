# SPDX-License-Identifier: Apache-2.0
"""A design is placed again only if nextpnr would see another circuit."""

import sys
from dataclasses import replace

import pytest

from boards import board, build, machine, packing, placements
from boards.fit import fit
from figures.synthesis import NotEndedError, SynthesisError
from tables.boards import placed_row
from tb.system.board_files import packer


@pytest.fixture
def design(monkeypatch, tmp_path):
    monkeypatch.setattr(placements, "RECORD", tmp_path / "placements.toml")
    return fit(board.named("colorlight_i5"), machine.named("mill"))


def test_the_circuit_and_what_nextpnr_is_told_are_both_in_the_state_of_a_netlist(
    design, monkeypatch
):
    other = fit(board.named("colorlight_i9"), machine.named("mill"))
    state = build.netlist_state
    monkeypatch.setattr(build, "circuit_hash", lambda circuit: circuit)
    assert state(design, "a") == state(design, "a")
    assert len({state(design, "a"), state(design, "b"), state(other, "a")}) == 3


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


class Tools:
    """In place of Yosys, nextpnr and the packer: what they return or raise."""

    def __init__(self, monkeypatch, folder):
        self.netlist, self.mhz = "a", 51.53
        self.calls = []
        self.folder = folder
        (folder / packing.PLACED).write_text("placed")
        monkeypatch.setattr(placements, "pack", packer(folder))
        for name in ("check_tools", "write", "make_firmware"):
            monkeypatch.setattr(build, name, lambda *_: folder)
        monkeypatch.setattr(build, "synthesise", lambda *_: self.calls.append("yosys"))
        monkeypatch.setattr(build, "netlist_state", lambda *_: self.netlist)
        monkeypatch.setattr(build, "used", lambda *_: "1 of 2 LUT")
        monkeypatch.setattr(build, "place", self.place)

    def place(self, design, folder, netlist, seed):
        self.calls.append(seed)
        if isinstance(self.mhz, Exception):
            raise self.mhz
        return self.mhz, {}


@pytest.fixture
def tools(monkeypatch, tmp_path):
    return Tools(monkeypatch, tmp_path)


def test_what_is_in_the_record_is_not_measured_again(design, tools):
    first = placements.measured(design, [1, 2])
    assert tools.calls == ["yosys", 1, 2] and first.used == "1 of 2 LUT"
    assert not (tools.folder / "moire.bit").exists(), "it would be loaded, whatever its clock"
    assert placements.worst_mhz(first, [1, 2]) == 51.53
    again = placements.measured(design, [1, 2])
    assert tools.calls == ["yosys", 1, 2] and placements.worst_mhz(again, [1, 2]) == 51.5
    placements.measured(design, [3])  # the netlist is not in the record
    assert tools.calls == ["yosys", 1, 2, "yosys", 3]
    assert sorted(placements.read()[design.name].seeds) == [1, 2, 3]


def test_other_sources_are_placed_again_only_if_the_netlist_is_another(design, tools, monkeypatch):
    placements.measured(design, [1])
    monkeypatch.setattr(build, "state", lambda _: "other sources")
    placements.measured(design, [1])
    assert tools.calls == ["yosys", 1, "yosys"]
    placements.measured(design, [1])
    assert tools.calls == ["yosys", 1, "yosys"]
    tools.netlist = "b"
    monkeypatch.setattr(build, "state", lambda _: "sources of another netlist")
    placements.measured(design, [2])
    assert tools.calls == ["yosys", 1, "yosys", "yosys", 2]
    assert sorted(placements.read()[design.name].seeds) == [2]


def test_each_design_has_its_own_entry(design, tools):
    other = fit(board.named("colorlight_i9"), machine.named("mill"))
    placements.measured(design, [1])
    tools.mhz = 60.0
    placements.measured(other, [1])
    found = {name: one.seeds[1].mhz for name, one in placements.read().items()}
    assert found == {design.name: 51.5, other.name: 60.0}


def test_a_tool_that_failed_is_a_result_too(design, tools):
    tools.mhz = SynthesisError("it's no way through the part")
    placements.measured(design, [1])
    known = placements.measured(design, [1])
    assert tools.calls == ["yosys", 1]
    with pytest.raises(SynthesisError, match="it.s no way through"):
        placements.worst_mhz(known, [1])
    assert "no way through" in placements.too_slow(design, known, [1])


def test_a_tool_that_did_not_end_in_time_is_run_again(design, tools):
    tools.mhz = NotEndedError("place and route has not ended after 180 minutes")
    with pytest.raises(NotEndedError):
        placements.measured(design, [1])
    tools.mhz = 51.5
    assert placements.measured(design, [1]).seeds[1].mhz == 51.5


def test_a_missing_seed_is_no_good_build(design, tools):
    known = placements.measured(design, [1])
    assert placements.too_slow(design, known, [1]) == ""
    assert placements.too_slow(design, known, [1, 3]) == "not placed yet with seed 3"
    tools.mhz = 49.9
    slow = placements.measured(design, [1, 2])
    assert placements.too_slow(design, slow, [1, 2]) == "49.9 MHz, 50 are needed"


@pytest.mark.parametrize(
    "words, said, code",
    [
        ([], "1 of 1 builds are good", 0),
        (["i5", "--minutes", "0"], "colorlight_i5-mill: not begun in time", 1),
        (["i7"], "no build has i7 in its name", 1),
    ],
)
def test_make_boards_says_which_builds_are_not_good(
    design, tools, monkeypatch, capsys, words, said, code
):
    monkeypatch.setattr(build, "fitting", lambda: ([design], []))
    monkeypatch.setattr(sys, "argv", ["placements", *words])
    with pytest.raises(SystemExit) as ended:
        placements.main()
    shown = capsys.readouterr().out + str(ended.value.code)
    assert said in shown and bool(ended.value.code) == bool(code)


def test_the_page_tells_a_part_that_no_tool_places_from_a_netlist_that_is_not_placed_yet(design):
    arty = fit(board.named("arty_a7_35t"), machine.named("mill"))
    for known in (placements.Build(), placements.Build(netlist="a")):
        assert placed_row(design, known)[4] == "not placed yet"
        assert placed_row(arty, known)[4] == "no open tool places it"

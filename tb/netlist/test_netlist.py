# SPDX-License-Identifier: Apache-2.0
"""The tests of a block on its netlist can fail: one wrong cell is found. And a netlist is made
once, and again when something that it depends on has changed.
"""

import re

import pytest

from tb.bench import ROOT, needs, rtl_only
from tb.cpu.test_node_memory import test_node_memory as node_memory
from tb.serial.test_crc32_stream import test_crc32_stream as crc32_stream
from twin import netlist
from twin.build import rtl_path

# {name: (family, test, a cell, another one in its place)}
FAULTS = {
    "an inverted LUT of the ECP5": (
        "ecp5",
        crc32_stream,
        r"\.INIT\(16'h(\w{4})\)",
        lambda cell: f".INIT(16'h{0xFFFF ^ int(cell[1], 16):04x})",
    ),
    "a flip-flop of the ECP5 that resets to 0": (
        "ecp5",
        crc32_stream,
        r'\.REGSET\("SET"\)',
        lambda cell: '.REGSET("RESET")',
    ),
    "an inverted LUT of the iCE40": (
        "ice40",
        crc32_stream,
        r"\.LUT_INIT\(16'h(\w{4})\)",
        lambda cell: f".LUT_INIT(16'h{0xFFFF ^ int(cell[1], 16):04x})",
    ),
    "a block RAM of the ECP5 that is never written": (
        "ecp5",
        node_memory,
        r"\.CEA\([^)]*\)",
        lambda cell: ".CEA(1'b0)",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_netlist_with_one_wrong_cell_fails_its_test(fault, monkeypatch, tmp_path):
    family, test, cell, wrong = FAULTS[fault]
    made = netlist.sources

    def broken(*what):
        primitives, whole, top = made(*what)
        text, count = re.subn(cell, wrong, whole.read_text(), count=1)
        assert count == 1, f"the netlist has no {cell}"
        (tmp_path / "netlist.v").write_text(text)
        return [primitives, tmp_path / "netlist.v", top]

    monkeypatch.setenv("NETLIST", family)
    assert test() is None, "without the fault it passes"
    monkeypatch.setattr(netlist, "sources", broken)
    with pytest.raises(pytest.fail.Exception, match=f"netlist for {family}: failed"):
        test()


def test_a_netlist_is_made_once_and_again_after_a_change(tmp_path, monkeypatch):
    monkeypatch.setattr(netlist, "BUILD", tmp_path / "netlist")
    source, written = tmp_path / "gate.sv", []
    source.write_text(
        "module gate #(parameter int W = 1) (input wire [W-1:0] a, output wire b);\n"
        "assign b = &a;\nendmodule\n"
    )

    def made(**parameters):
        *_, top = netlist.sources("ice40", source, parameters, [])
        written.append(top.parent)
        return top.read_text()

    assert "parameter W = 1" in made() and "wire a" in made()
    assert written[0] == written[1]
    assert "parameter W = 3" in made(W=3) and "wire [2:0] a" in made(W=3)
    assert written[2] == written[3] != written[0]
    source.write_text(source.read_text().replace("&a", "|a"))
    made()
    assert written[4] not in written[:4]


def test_a_block_that_yosys_reads_again_once_it_knows_those_below_keeps_its_name(tmp_path):
    """It does so for a '0 at a port, whose width is known below only."""
    (tmp_path / "below.sv").write_text(
        "module below #(parameter int W = 1) (input wire signed [W:0] a, output wire b);\n"
        "assign b = a < 0;\nendmodule\n"
    )
    block = tmp_path / "above.sv"
    block.write_text(
        "module above #(parameter int W = 1) (output wire b);\n"
        "below #(.W(W)) u_below (.a('0), .b);\nendmodule\n"
    )
    netlist.synthesise("ecp5", block, {"W": 5}, [tmp_path], tmp_path)
    said = (tmp_path / "synthesis.log").read_text()
    assert "Reprocessing module above" in said
    assert "module above_netlist" in (tmp_path / "netlist.v").read_text()


def test_a_wrong_family_a_wrong_parameter_and_a_wrong_source_are_errors(tmp_path, monkeypatch):
    monkeypatch.setattr(netlist, "BUILD", tmp_path / "netlist")
    source = ROOT / "rtl" / "common" / "synchroniser.sv"
    for family in ("xc7", ""):
        with pytest.raises(netlist.NetlistError, match="it is one of ecp5, ice40, gowin"):
            netlist.sources(family, source, {}, rtl_path())
    with pytest.raises(netlist.NetlistError, match="STAGES_MUST_BE_AT_LEAST_2"):
        netlist.sources("ice40", source, {"STAGES": 1}, rtl_path())
    assert not list((tmp_path / "netlist" / "ice40").glob("*")), "nothing is kept of a failure"


def test_what_needs_the_rtl_skips_on_a_netlist_with_its_reason(monkeypatch):
    monkeypatch.delenv("NETLIST", raising=False)
    assert rtl_only("") is None and needs(1, "") is None
    monkeypatch.setenv("NETLIST", "ecp5")
    with pytest.raises(pytest.skip.Exception, match="it reads a register inside"):
        rtl_only("it reads a register inside")

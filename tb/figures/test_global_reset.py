# SPDX-License-Identifier: Apache-2.0
"""A reset of many flip-flops goes on a clock line of an ECP5; the circuit behind it stays."""

import json

import pytest

from boards.circuit import TOP, circuit_hash
from boards.global_reset import BUFFER, FLIP_FLOP, RESET, put_on_clock_line
from figures.synthesis import BUILD, ECP5, NEXTPNR_ECP5, placed, yosys

WIDTH = 40  # flip-flops of the larger of the two resets
SHIFTS = f"""module top (input clk, rst_in, clear, d, output logic y, z, rst_seen);
  logic rst = 1'b1;
  logic [{WIDTH - 1}:0] long;
  logic [3:0] short;
  always_ff @(posedge clk) begin
    rst <= rst_in;
    if (rst) long <= '0; else long <= {{long[{WIDTH - 2}:0], d}};
    if (clear) short <= '0; else short <= {{short[2:0], d}};
  end
  assign y = long[{WIDTH - 1}] ^ d, z = short[3], rst_seen = rst & d;
endmodule
"""


@pytest.fixture
def netlist():
    source = BUILD / "test-global-reset" / "top.sv"  # under the root, where the tools may read
    source.parent.mkdir(parents=True, exist_ok=True)
    source.write_text(SHIFTS)
    return yosys(source, {}, "synth_ecp5 -json {netlist}", "test-global-reset")


def cells_of(netlist, kind):
    cells = json.loads(netlist.read_text())["modules"][TOP]["cells"].values()
    return [cell["connections"] for cell in cells if cell["type"] == kind]


def without_buffers(netlist):
    """The netlist as it is when each buffer is a wire."""
    design = json.loads(netlist.read_text())
    top = design["modules"][TOP]
    buffers = [cell["connections"] for cell in top["cells"].values() if cell["type"] == BUFFER]
    behind = {pins["CLKO"][0]: pins["CLKI"][0] for pins in buffers}
    top["cells"] = {name: cell for name, cell in top["cells"].items() if cell["type"] != BUFFER}
    for cell in top["cells"].values():
        for pin in cell["connections"].values():
            pin[:] = [behind.get(net, net) for net in pin]
    netlist.write_text(json.dumps(design))
    return netlist


def test_only_the_flip_flops_of_the_large_reset_get_it_from_a_buffer(netlist):
    before = circuit_hash(netlist)
    put_on_clock_line(netlist, loads=WIDTH)
    (buffer,) = cells_of(netlist, BUFFER)
    resets = [pins[RESET] for pins in cells_of(netlist, FLIP_FLOP)]
    assert resets.count(buffer["CLKO"]) == WIDTH
    assert buffer["CLKI"] not in resets
    assert any(buffer["CLKI"] in pins.values() for pins in cells_of(netlist, "LUT4"))
    assert circuit_hash(netlist) != before
    assert circuit_hash(without_buffers(netlist)) == before


def test_a_netlist_with_smaller_resets_stays_as_it_was(netlist):
    before = netlist.read_bytes()
    put_on_clock_line(netlist, loads=WIDTH + 1)
    put_on_clock_line(netlist)
    assert netlist.read_bytes() == before


def test_nextpnr_routes_it_on_the_clock_network(netlist):
    put_on_clock_line(netlist, loads=WIDTH)
    placed(netlist, NEXTPNR_ECP5, ECP5, 50, 1, "--lpf-allow-unconstrained")
    log = netlist.with_name("place_and_route.log").read_text()
    assert "routing clock net global_reset" in log

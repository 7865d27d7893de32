# SPDX-License-Identifier: Apache-2.0
"""The hash of a circuit depends on all that it is, and not on names and order."""

import copy
import json
import random

import pytest

from boards.circuit import circuit_hash
from figures.synthesis import BUILD, yosys
from tb.bench import seed

ADDER = """module top (input clk, input [7:0] a, b, output logic [7:0] y);
  always_ff @(posedge clk) y <= a {operator} b;
endmodule
"""


def cell(kind, init, **nets):
    return {
        "type": kind,
        "parameters": {"INIT": init},
        "attributes": {"src": "rtl/axis.sv:10.1", "hdlname": "u_axis u_cell", "REG": "1"},
        "connections": nets,
    }


def pads(direction, *nets):
    return {"direction": direction, "bits": [*nets]}


def circuit(chance, cells=40):
    """A netlist with nets 2 to 7 at pads, of which each further cell makes one more."""
    top = {"ports": {"a": pads("input", 2, 3, 4), "b": pads("input", 5, 6, 7)}, "cells": {}}
    top["ports"]["y"] = pads("output", 2, 5)
    for number in range(cells):
        inputs = [chance.choice([*range(2, 8 + number), "0", "1"]) for _ in range(3)]
        init = f"{chance.getrandbits(8):08b}"
        top["cells"][f"c{number}"] = cell("LUT4", init, A=inputs[:1], B=inputs[1:], Z=[8 + number])
    return {"modules": {"top": top}}


def renamed(netlist, chance):
    """The same circuit with other names, other numbers of nets and another order."""
    top = netlist["modules"]["top"]
    cells = list(top["cells"].values())
    bits = range(2, 8 + len(cells))
    other = dict(zip(bits, chance.sample(range(100, 1000), len(bits))))
    number = lambda net: other.get(net, net)
    moved = []
    for one in chance.sample(cells, len(cells)):
        nets = {port: [number(net) for net in found] for port, found in one["connections"].items()}
        names = {"src": f"rtl/axis.sv:{chance.random()}", "hdlname": f"u_{chance.random()}"}
        attributes = {**one["attributes"], **names}
        moved.append({**one, "attributes": attributes, "connections": nets})
    ports = {
        name: pads(port["direction"], *map(number, port["bits"]))
        for name, port in top["ports"].items()
    }
    scope = {"type": "$scopeinfo", "parameters": {}, "attributes": {}, "connections": {}}
    cells = {f"$auto${chance.random()}": one for one in [*moved, scope]}
    return {"modules": {"top": {"ports": ports, "cells": cells}}}


@pytest.fixture
def hash_of(tmp_path):
    def found(netlist):
        file = tmp_path / "netlist.json"
        file.write_text(json.dumps(netlist))
        return circuit_hash(file)

    return found


def test_names_numbers_and_order_are_no_part_of_a_circuit(hash_of):
    chance = random.Random(seed())
    for _ in range(20):
        netlist = circuit(chance)
        assert hash_of(renamed(netlist, chance)) == hash_of(netlist)


def change_constant(top, one, _):
    one["parameters"]["INIT"] += "1"


def change_attribute(top, one, _):
    one["attributes"]["REG"] = "0"


def change_type(top, one, _):
    one["type"] = "LUT5"


def change_net(top, one, chance):
    before = one["connections"]["A"][0]
    one["connections"]["A"] = [chance.choice([net for net in (2, 3, "0", "1") if net != before])]


def change_port(top, one, _):
    one["connections"]["C"] = one["connections"].pop("A")


def join_pads(top, one, _):
    top["ports"]["y"] = pads("output", 2, 6)


def turn_pads(top, one, _):
    top["ports"]["y"]["direction"] = "inout"


def drop(top, one, _):
    top["cells"] = {name: other for name, other in top["cells"].items() if other is not one}


@pytest.mark.parametrize(
    "change",
    [
        change_constant,
        change_attribute,
        change_type,
        change_net,
        change_port,
        join_pads,
        turn_pads,
        drop,
    ],
)
def test_each_other_cell_net_or_pad_makes_another_circuit(hash_of, change):
    chance = random.Random(seed())
    for _ in range(20):
        netlist = circuit(chance)
        changed = copy.deepcopy(netlist)
        top = changed["modules"]["top"]
        change(top, chance.choice(list(top["cells"].values())), chance)
        assert hash_of(changed) != hash_of(netlist)


def test_two_like_cells_with_swapped_neighbours_are_told_apart(hash_of):
    """Two chains of four like cells, from pad to pad, are not the same if they cross over."""
    chain = lambda nets, init: [cell("LUT4", init, A=[a], Z=[z]) for a, z in zip(nets, nets[1:])]
    first, second = chain([2, 10, 11, 12, 3], "01"), chain([4, 20, 21, 22, 5], "01")
    ports = {"a": pads("input", 2, 4), "y": pads("output", 3, 5)}
    whole = lambda cells: {
        "modules": {"top": {"ports": ports, "cells": {str(n): c for n, c in enumerate(cells)}}}
    }
    before = hash_of(whole([*first, *second]))
    first[1], second[1] = (
        cell("LUT4", "01", A=[10], Z=[21]),
        cell("LUT4", "01", A=[20], Z=[11]),
    )
    assert hash_of(whole([*first, *second])) != before


def test_a_comment_in_a_source_leaves_the_circuit_of_yosys_as_it_was():
    source = BUILD / "test-circuit" / "top.sv"  # under the root, where the tools may read
    source.parent.mkdir(parents=True, exist_ok=True)

    def found(text):
        source.write_text(text)
        return circuit_hash(yosys(source, {}, "synth_ecp5 -json {netlist}", "test-circuit"))

    plain = ADDER.format(operator="+")
    before = found(plain)
    assert found("// a comment\n\n" + plain) == before
    assert found(ADDER.format(operator="-")) != before

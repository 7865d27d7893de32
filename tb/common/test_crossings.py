# SPDX-License-Identifier: Apache-2.0
"""The crossings into the clock domain: how long one holds on average, that an input without a
synchroniser is found, and the blocks whose pins may arrive one cycle later, in short.
"""

import math

import pytest

from boards import board as boards
from tables import crossings
from tb.common.test_synchroniser import test_synchroniser as synchroniser
from tb.sense.test_axis_inputs import test_axis_inputs as axis_inputs
from tb.simulator import BENCHES
from twin.crossings import folders

YEAR_S = 365 * 24 * 3600
CHAIN = "synchroniser u_chain (.clk, .rst, .d({d}), .q(held));"


def test_mtbf_is_that_of_the_example_of_the_measured_part():
    """Actel's AC312: 100 MHz, 12.5 MHz of data, no more than the delay: 51.2 us. 2.96 ns more are
    worth one year.
    """
    assert crossings.mtbf_s(crossings.MEASURED, 1, 100e6, 12.5e6) == pytest.approx(51.2e-6, 2e-3)
    constants = crossings.FlipFlop(crossings.MEASURED.time_constant_s, 1.56e-11, 10e-9 - 2.96e-9)
    assert crossings.mtbf_s(constants, 2, 100e6, 12.5e6) == pytest.approx(YEAR_S, 0.1)


def test_mtbf_of_a_stage_more_is_greater_by_what_the_stage_decides():
    part, clock_hz = crossings.FlipFlop(1e-9, 1e-11, 2e-9), 125e6
    two, three = (crossings.mtbf_s(part, stages, clock_hz, 1e6) for stages in (2, 3))
    assert three / two == pytest.approx(math.exp(8 - 2))


def test_an_input_that_changes_each_cycle_holds_a_year_with_twice_the_time_constant():
    for part, clock_hz in crossings.FAMILIES.values():
        slow = crossings.FlipFlop(2 * part.time_constant_s, part.window_s, part.path_s)
        assert crossings.mtbf_s(slow, 2, clock_hz, clock_hz) > YEAR_S


def test_the_part_of_each_board_is_among_the_constants_or_said_to_have_none():
    _, _, constants = crossings.PAGE.read_text(encoding="utf-8").partition("## Constants")
    rows = [line.split("|")[1:-1] for line in constants.splitlines() if line.startswith("| ")]
    parts = [
        name.strip(" ").removesuffix(", as used") for row in rows for name in row[0].split(", ")
    ]
    for known in map(boards.named, boards.names()):
        stem = {"LFE5U": "ECP5", "iCE40UP5K": "iCE40 UP5K"}
        name = known.part.name.partition("-")[0]
        assert stem.get(name, name) in parts
    assert all("none published" in row[4] for row in rows if "unknown" in row[2])


def wrong(name, logic, comment="pin"):
    """What is wrong with the crossings of a small module."""
    BENCHES.mkdir(parents=True, exist_ok=True)
    source = BENCHES / f"{name}.sv"
    source.write_text(
        f"module {name} (\n"
        f"    input wire clk,\n    input wire rst,\n    input wire level,  // {comment}\n"
        "    output logic q,\n    output logic own\n);\nwire held;\n"
        "always_ff @(posedge clk) own <= q;\n"
        f"{logic}\nendmodule\n"
    )
    netlist = crossings.elaborated(source, {}, crossings.FLAT)
    try:
        found = crossings.crossings_of(name, netlist, crossings.inputs_of(source))
    except ValueError as why:
        return str(why)
    return [(one.width, one.stages, one.inputs) for one in found]


def test_an_input_crosses_through_its_synchroniser():
    logic = CHAIN.format(d="level || own") + "assign q = held;"
    assert wrong("crossing_good", logic) == [(1, 2, ("level",))]


@pytest.mark.parametrize(
    "name, logic, comment, words",
    [
        ("bare", "assign held = level; assign q = held;", "pin", "reaches"),
        ("beside", CHAIN.format(d="level") + "assign q = held || level;", "pin", "reaches"),
        ("static", CHAIN.format(d="level") + "assign q = held;", "static", "synchronised"),
    ],
)
def test_a_crossing_elsewhere_is_found(name, logic, comment, words):
    assert words in wrong(f"crossing_{name}", logic, comment)


@pytest.mark.parametrize(
    "port, comment, count",
    [("estop_open", "pin", 0), ("adc_sin", "pin", 1), ("estop_open", "static", 1)],
)
def test_a_pin_of_a_board_that_goes_to_a_port_of_another_kind_is_found(port, comment, count):
    BENCHES.mkdir(parents=True, exist_ok=True)
    top = BENCHES / f"pins_{port}_{comment}.sv"
    top.write_text(
        f"module {top.stem} (\n    input wire clk,\n    input wire rst,\n"
        f"    input wire level,  // {comment}\n    output wire q\n);\n"
        f"node u_node (.clk, .rst, .{port}(level), .rs485_tx(q));\nendmodule\n"
    )
    comments = crossings.inputs_of(crossings.designs()["node"])
    assert len(list(crossings.wrong_pins(top, "", comments))) == count


def test_each_input_of_each_design_has_one_rate():
    ports = [
        port
        for source in crossings.designs().values()
        for port, comment in crossings.inputs_of(source).items()
        if crossings.kind_of(comment) == "asynchronous"
    ]
    assert len(ports) >= 20 and min(crossings.rate_of(port, 1.0) for port in ports) > 0


def test_a_synchroniser_whose_changes_come_late_by_chance(monkeypatch):
    monkeypatch.setenv("CROSSINGS", "2")
    assert synchroniser(5, 3, -1) is None, "a failure is an exception"


def test_a_block_with_a_synchroniser_whose_changes_come_late_by_chance(monkeypatch):
    monkeypatch.setenv("CROSSINGS", "3")
    assert axis_inputs() is None, "a failure is an exception"


def test_a_netlist_has_its_own_synchronisers(monkeypatch):
    monkeypatch.setenv("CROSSINGS", "1")
    monkeypatch.setenv("NETLIST", "ecp5")
    with pytest.raises(ValueError, match="exclude each other"):
        folders()

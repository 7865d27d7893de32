# SPDX-License-Identifier: Apache-2.0
"""Boards and machines of constraints/: whatever is made of them passes Verilator's lint and has one
pin for each port.
"""

import os
import re
import subprocess

import pytest

from boards import board, build, generate, machine
from boards.fit import fit
from tb.bench import ROOT
from tb.simulator import WAIVERS, package
from tb.system.board_files import DESIGNS, MILL, assert_refused, edited, refusal
from twin.build import rtl_path


def different():
    """Few designs such that each board and each machine is among them."""
    kinds = {one.name: {one.board.file, one.machine.file} for one in DESIGNS}
    found, left = [], set().union(*kinds.values())
    while left:
        found.append(max(DESIGNS, key=lambda one: len(kinds[one.name] & left)))
        left -= kinds[found[-1].name]
    return found


@pytest.mark.parametrize("design", different(), ids=lambda design: design.name)
def test_the_top_of_each_machine_and_each_board_passes_lint(design, tmp_path):
    top = tmp_path / "top.sv"
    top.write_text(generate.top(design))
    verilator = package("verilator")
    folders = [word for folder in rtl_path() for word in ("-y", str(folder))]
    cells = package("pyosys") / "share" / design.board.part.family.cells
    command = [verilator / "bin" / "verilator_bin", "--lint-only", "-Wall", "--quiet"]
    command += ["--timescale", "1ns/1ps", *folders, "+libext+.sv+.v", "--top-module", "top"]
    command += [*WAIVERS, ROOT / "constraints" / "cells.vlt", "-v", cells, top]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "VERILATOR_ROOT": str(verilator)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


PINS = {  # the place of a port, and where its level and pull-up are, in each kind of constraints
    "pins.lpf": (r'LOCATE COMP "(?P<port>\w+)" SITE "(?P<ball>\w+)"', r'IOBUF PORT "(\w+)"'),
    "pins.pcf": (
        r"set_io (?:-pullup yes )?(?P<port>\w+) (?P<ball>\w+)",
        r"set_io (?:-pullup yes )?(\w+)",
    ),
    "pins.cst": (r'IO_LOC "(?P<port>\w+)" (?P<ball>\w+);', r'IO_PORT "(\w+)" PULL_MODE='),
    "pins.xdc": (
        r"PACKAGE_PIN (?P<ball>\w+) .*\[get_ports (?P<port>\w+)\]",
        r"IOSTANDARD LVCMOS33.* \[get_ports (\w+)\]",
    ),
}


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)
def test_each_port_of_the_top_has_a_pin_of_its_own(design):
    ports = re.findall(
        r"^    (?:input  wire |output logic|inout  wire ) (\w+)", generate.top(design), re.M
    )
    name = design.board.part.family.constraints
    made = generate.files(design)[name]
    located, given = PINS[name]
    pins = [(found["port"], found["ball"]) for found in re.finditer(located, made)]
    electrical = re.findall(given, made)
    assert sorted(port for port, _ in pins) == sorted(ports) == sorted(electrical)
    assert len({ball for _, ball in pins}) == len(pins)


@pytest.mark.parametrize("design", DESIGNS, ids=lambda design: design.name)
def test_page_and_drawing_name_each_connection(design):
    made = generate.files(design)
    for one in design.connections:
        row = rf"<td>{one.pad.place}</td><td>{one.pad.ball}</td><td>{one.name}</td>"
        assert row in made["wiring.html"]
        assert f">{one.name}</text>" in made["wiring.svg"]
        assert f">{one.between.part}</text>" in made["wiring.svg"]
    assert made["wiring.svg"] in made["wiring.html"]
    drawn = re.findall(r'<g class="(in|out|both)">', made["wiring.svg"])
    assert drawn.count("in") == sum(one.signal.direction == "in" for one in design.connections)
    assert len(drawn) == len(design.connections)


def test_the_page_says_what_keeps_each_drive_off_before_the_configuration():
    for design in DESIGNS:
        page = generate.files(design)["wiring.html"]
        enables = [one for one in design.connections if one.signal.group == "drive_enable"]
        buffered = sum(bool(one.pad.through) for one in enables)
        assert page.count("a contact of its own must switch the power") == buffered
        assert page.count("10 kΩ from the pin to GND") == len(enables) - buffered


def test_the_pins_of_s0_on_the_ulx3s_are_those_of_its_first_release():
    """The pins of J1 and J2 as people have wired them."""
    design = fit(board.named("ulx3s_85f"), machine.named("s0"))
    found = {one.name: one.pad.ball for one in design.connections}
    assert found["X.encoder_a"] == "B11" and found["X.encoder_z"] == "A10"
    assert found["X.adc_cs_n"] == "C10" and found["estop_open"] == "C6"
    assert found["X.drive_enable"] == "A6" and found["X.dac_sdi"] == "B4"
    assert found["rs485_rx"] == "C18" and found["rs485_driver_enable"] == "B15"
    assert len(found) == 25


def test_only_inputs_have_pull_ups():
    made = generate.files(fit(board.named("ulx3s_85f"), machine.named("mill")))["pins.lpf"]
    assert 'IOBUF PORT "x_limit_low_open" PULLMODE=UP IO_TYPE=LVCMOS33;' in made
    assert 'IOBUF PORT "x_drive_enable" PULLMODE=NONE IO_TYPE=LVCMOS33 DRIVE=4;' in made


def test_pull_ups_and_drive_are_those_of_the_pads_in_each_family():
    made = generate.files(fit(board.named("tang_nano_20k"), machine.named("mill")))["pins.cst"]
    assert 'IO_PORT "estop_open" PULL_MODE=UP IO_TYPE=LVCMOS33;' in made
    assert 'IO_PORT "x_step" PULL_MODE=NONE IO_TYPE=LVCMOS33 DRIVE=8;' in made
    made = generate.files(fit(board.named("arty_a7_35t"), machine.named("mill")))["pins.xdc"]
    words = "IOSTANDARD LVCMOS33 PULLTYPE PULLUP} [get_ports estop_open]"
    assert words in made and "DRIVE 4} [get_ports x_step]" in made
    assert "create_clock -name clock -period 10.0 [get_ports clock]" in made


def test_the_script_for_vivado_names_the_part_and_refuses_a_missed_clock():
    made = generate.files(fit(board.named("arty_a7_35t"), machine.named("mill")))["vivado.tcl"]
    assert "link_design -top top -part xc7a35ticsg324-1L\n" in made
    assert made.index("if {$slack < 0}") < made.index("write_bitstream -force moire.bit")


def test_a_relay_has_the_coefficients_of_the_flash_and_no_firmware(tmp_path):
    design = fit(board.named("icebreaker"), machine.named("relay"))
    assert design.parameters == {"K": 16, "CLK_HZ": 18_000_000}
    top = generate.top(design)
    assert "assign flash_mosi = node_flash_sdo;" in top and ".flash_sdi(flash_miso)" in top
    assert build.make_firmware(design, tmp_path) == "relay has no firmware"
    assert not list(tmp_path.iterdir())


PAPERS = ("S0:", "S1:", "S2 and", "S3:", "S4: main node", "S4: sub-node")  # titles begin so


def test_the_machine_of_each_paper_is_on_a_board():
    titles = [design.machine.title for design in DESIGNS]
    for paper in PAPERS:
        assert any(title.startswith(paper) for title in titles), paper


def test_lines_that_a_node_only_pulls_low_are_open_drain():
    made = generate.files(fit(board.named("colorlight_i5"), machine.named("s4_main")))
    assert "    inout  wire  i2c_scl,  // P2A 1: clock of the I2C bus\n" in made["top.sv"]
    assert "assign i2c_scl = node_i2c_scl_low ? 1'b0 : 1'bz;" in made["top.sv"]
    assert ".i2c_scl(i2c_scl)," in made["top.sv"]
    assert ".edm_status({edm_alarm, edm_cutting})" in made["top.sv"]
    assert 'IOBUF PORT "i2c_scl" PULLMODE=UP IO_TYPE=LVCMOS33' in made["pins.lpf"]
    assert "<td>to and from the board: clock of the I2C bus</td>" in made["wiring.html"]


def test_peripherals_that_a_machine_does_not_have_are_idle():
    given = generate.inputs(fit(board.named("colorlight_i5"), machine.named("s4_sub")))
    assert (given["keyboard_clock"], given["edm_status"]) == ("1'b1", "{1'b0, 1'b0}")
    assert (given["sensor_rx"], given["peer_rx"]) == ("sensor_rx", "peer_rx")


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"angle_sensor"]', '"angle"]', "[node] peripherals: 'angle' is none of i2c, ps2, peer, "),
        (
            'peripherals = ["i2c", "peer", "angle_sensor"]',
            'peripherals = ["i2c", "peer"]',
            "sensor_rx is no signal of this machine, or it is in `unused`",
        ),
        (
            '2.2 kilohm to 3.3 V at each line"\nvolts = 3.3',
            '2.2 kilohm to 5 V at each line"\nvolts = 5.0',
            "i2c_scl comes with 5 V, but J1 gp0 of constraints/ulx3s_25f/board.toml takes 3.3 V",
        ),
    ],
)
def test_wrong_peripherals_are_refused(old, new, words, tmp_path):
    path = edited(tmp_path, "constraints/machines/s4_sub.toml", (old, new))
    assert_refused(path, "ulx3s_25f", words)


def test_an_open_drain_line_needs_a_pin_for_both_directions(tmp_path):
    path = edited(
        tmp_path,
        "constraints/machines/s4_sub.toml",
        ("[wiring.ulx3s]", "[wiring.tang_nano_20k]"),
        ('i2c_scl = "J1 gp0"', 'i2c_scl = "LED 15"'),
    )
    pins = (f'"J5 {pin}"' for pin in (76, 42, 41, 56, 54, 51, 48, 55, 49, 86, 79, 72))
    text = re.sub(r'"J[12] g[pn]\d+"', lambda _: next(pins), path.read_text())
    path.write_text(text)
    found = refusal(lambda: fit(board.named("tang_nano_20k"), machine.load(path)))
    assert found == (
        f"{path}: i2c_scl is an input and output, but LED 15 of "
        "constraints/tang_nano_20k/board.toml is an output only"
    )


def test_the_page_describes_the_loop_back_plug_of_axes_with_drives():
    mill = fit(board.named("ulx3s_85f"), machine.named("mill"))
    wires = generate.plug(mill)
    assert wires[0] == ("GND", "J2 gn20") and len(wires) == 1 + 3 * 5
    assert ("J1 gn3", "J1 gp0") in wires and ("J1 gp3", "J1 gp1") in wires
    page = generate.files(mill)["wiring.html"]
    assert "<tr><td>J1 gn3</td><td>J1 gp0</td></tr>" in page
    s3 = fit(board.named("colorlight_i5"), machine.named("s3"))
    assert {start for start, _ in generate.plug(s3)} == {"GND", "P3A 1"}
    box = fit(board.named("icebreaker"), machine.named("counter_box"))
    assert not generate.plug(box)
    assert "Loop-back" not in generate.files(box)["wiring.html"]


def test_signals_that_a_layout_leaves_out_are_on_its_page():
    made = generate.files(fit(board.named("tang_nano_20k"), machine.named("mill")))
    assert "rs485_rx, rs485_tx, rs485_driver_enable, X.probe_0" in made["wiring.html"]
    assert ".rs485_rx(usb_rx)," in made["top.sv"]


def test_masks_have_a_bit_for_each_axis_with_the_feature(tmp_path):
    path = edited(
        tmp_path,
        "constraints/machines/counter_box.toml",
        ('name = "B"\nfeatures = ["capture"]', 'name = "B"\nfeatures = ["velocity"]'),
    )
    found = fit(board.named("icebreaker"), machine.load(path)).parameters
    assert (found["HAS_CAPTURE"], found["HAS_VELOCITY"], found["HAS_DRIVE"]) == (13, 2, 0)
    assert (found["AXES"], found["CLK_HZ"], found["REGISTER_STYLE"]) == (4, 18_000_000, "huge")


def test_inputs_without_a_pin_have_the_level_at_which_nothing_happens(tmp_path):
    path = edited(
        tmp_path,
        MILL,
        (
            'name = "Y"\ndrives = ["stepper"]\nunused = [',
            'name = "Y"\ndrives = ["stepper"]\nunused = ["drive_fault_n", "limit_low_open", ',
        ),
        ('Y.limit_low_open = "J1 gp6"\n', ""),
        ('Y.drive_fault_n = "J1 gp7"\n', ""),
    )
    given = generate.inputs(fit(board.named("ulx3s_85f"), machine.load(path)))
    assert given["drive_fault_n"] == "{z_drive_fault_n, 1'b1, x_drive_fault_n}"
    assert given["limit_low_open"] == "{z_limit_low_open, 1'b0, x_limit_low_open}"
    assert given["rs485_rx"] == "usb_rx & rs485_rx"


def test_a_board_without_switches_has_the_address_of_the_machine():
    assert (
        generate.inputs(fit(board.named("colorlight_i5"), machine.named("mill")))["address"]
        == "4'd1"
    )

# SPDX-License-Identifier: Apache-2.0
"""Boards and machines of constraints/: whatever is made of them passes Verilator's lint and has one
pin for each port, what does not fit is refused in one line, and the pins are those of others.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from amaranth_boards.arty_a7 import ArtyA7_35Platform
from amaranth_boards.ice40_hx8k_b_evn import ICE40HX8KBEVNPlatform
from amaranth_boards.icebreaker import ICEBreakerPlatform
from amaranth_boards.orangecrab_r0_2 import OrangeCrabR0_2_25FPlatform
from amaranth_boards.tang_nano_9k import TangNano9kPlatform
from amaranth_boards.ulx3s import ULX3S_25F_Platform, ULX3S_85F_Platform

from boards import board, build, clocks, generate, machine, placements, size
from boards.fit import fit
from boards.toml_file import Misfit
from figures import synthesis
from figures.boards import boards_failed
from figures.synthesis import SynthesisError
from tb.bench import ROOT
from tb.simulator import WAIVERS, package
from tools import gowin
from twin.build import rtl_path

DESIGNS, TOO_LARGE = build.fitting()
ULX3S, MILL = "constraints/ulx3s_85f/board.toml", "constraints/machines/mill.toml"


def edited(folder, path, *changes):
    """A copy of a board or machine file with some of its text replaced."""
    text = (ROOT / path).read_text()
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    copy = folder / os.path.basename(path)
    copy.write_text(text)
    return copy


def refusal(make):
    """The one line with which something is refused."""
    with pytest.raises(Misfit) as why:
        make()
    assert "\n" not in str(why.value)
    return str(why.value)


# What is made


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
    found = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


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


S0 = "constraints/machines/s0.toml"


def over_ethernet(folder, address="192.168.1.50", more=""):
    """The mill with its link over Ethernet."""
    node = "memory_kib = 64\naddress = 1\n"
    table = f'[node.ethernet]\naddress = "{address}"\n{more}\n'
    return edited(folder, "constraints/machines/mill.toml", (node, f"{node}\n{table}"))


@pytest.mark.parametrize(
    "name, balls",
    [
        ("colorlight_i5", {"rx_clk": "H2", "tx_ctl": "K1", "tx_data_3": "J3"}),
        ("colorlight_i9", {"rx_clk": "H2", "tx_ctl": "K1", "tx_data_3": "J3"}),
        ("colorlight_5a_75b_v8_0", {"rx_clk": "J1", "tx_ctl": "L2", "tx_data_3": "R1"}),
    ],
)
def test_a_link_over_ethernet_has_the_pins_of_the_phy_and_its_clock(name, balls, tmp_path):
    design = fit(board.named(name), machine.load(over_ethernet(tmp_path)))
    assert (design.parameters["HAS_LINK"], design.parameters["LINK_CARRIER"]) == (1, 1)
    made = generate.files(design)
    assert f".mac_address(48'd{0x024D_C0A8_0132})," in made["top.sv"]
    assert f".ip_address(32'd{0xC0A8_0132}),  // 192.168.1.50" in made["top.sv"]
    assert ".udp_rx_sender(ethernet_udp_rx_sender)" in made["top.sv"]
    assert (
        ".pads_rx_data({eth_rx_data_3, eth_rx_data_2, eth_rx_data_1, eth_rx_data_0})"
        in (made["top.sv"])
    )
    assert 'FREQUENCY PORT "eth_rx_clk" 125.0 MHZ;' in made["pins.lpf"]
    assert (
        'IOBUF PORT "eth_tx_clk" PULLMODE=NONE IO_TYPE=LVCMOS33 DRIVE=8 SLEWRATE=FAST;'
        in (made["pins.lpf"])
    )
    for port, ball in balls.items():
        assert f'LOCATE COMP "eth_{port}" SITE "{ball}";' in made["pins.lpf"]
    plain = generate.files(fit(board.named(name), machine.named("mill")))
    assert "eth_" not in plain["pins.lpf"] and "ethernet_core" not in plain["top.sv"]


def test_a_phy_with_mii_has_its_clocks_and_takes_its_own_from_the_node(tmp_path):
    arty = board.named("arty_a7_35t")
    made = generate.files(fit(arty, machine.load(over_ethernet(tmp_path))))
    top, xdc = made["top.sv"], made["pins.xdc"]
    assert ".clocks_rx(eth_rx_clk)," in top and ".clocks_tx(eth_tx_clk)," in top
    data = ", ".join(f"eth_tx_data_{n}" for n in (3, 2, 1, 0))
    assert f".pads_tx_data({{{data}}})," in top
    assert "always_ff @(posedge clk) reference <= !reference;" in top and arty.node_hz == 50_000_000
    assert "assign eth_reference = reference;" in top and "assign eth_reset_n = !rst;" in top
    assert "reference(" not in top, "the core has no such pad"
    for clock in ("eth_rx_clk", "eth_tx_clk"):
        assert f"create_clock -name {clock} -period 40.0 [get_ports {clock}]" in xdc
    assert "clock] -group eth_rx_clk -group eth_tx_clk\n" in xdc
    assert "PULLTYPE PULLDOWN} [get_ports eth_rx_dv]" in xdc
    assert "DRIVE 8 SLEW FAST} [get_ports eth_tx_en]" in xdc
    plain = generate.files(fit(arty, machine.named("mill")))
    assert "eth_" not in plain["pins.xdc"] + plain["top.sv"]


def test_a_node_that_cannot_make_the_clock_of_the_phy_is_refused(tmp_path):
    change = ("node_hz = 50_000_000", "node_hz = 40_000_000")
    path = edited(tmp_path, "constraints/arty_a7_35t/board.toml", change)
    assert refusal(lambda: board.load(path)) == (
        f"{path}: [clock] node_hz must be 50000000: the reference of the PHY is half of it"
    )


def test_an_interface_that_the_family_has_no_core_for_is_refused(tmp_path):
    i5 = "constraints/colorlight_i5/board.toml"
    phy = Path(i5).read_text().partition("[ethernet]")[2].partition("\n\n")[0]
    arty = Path("constraints/arty_a7_35t/board.toml").read_text()
    mine = arty.partition("[ethernet]")[2].partition("\n\n")[0]
    path = edited(tmp_path, "constraints/arty_a7_35t/board.toml", (mine, phy))
    path.write_text(re.sub(r'"(H2|P2|K2|L1|N1|P1|G1|K1|H1|J1|J3)"', '"G16"', path.read_text()))
    found = refusal(lambda: board.load(path))
    assert found == f"{path}: [ethernet] rgmii is not built for the family xc7"


def test_the_delays_of_the_phy_are_in_the_range_of_the_part(tmp_path):
    path = edited(
        tmp_path, "constraints/colorlight_i5/board.toml", ("rx_delay_ns = 2.0", "rx_delay_ns = 4")
    )
    found = refusal(lambda: board.load(path))
    assert found == f"{path}: [ethernet] tx_delay_ns and rx_delay_ns must be 0 to 3.1"


@pytest.mark.parametrize(
    "address, more, words",
    [
        ("192.168.1", "", "[node.ethernet] address '192.168.1' is no IP address such as"),
        ("224.0.0.1", "", "[node.ethernet] address '224.0.0.1' is none that a node may have"),
        ("192.168.1.50", "dhcp = true", "[node.ethernet] there is no key dhcp"),
    ],
)
def test_a_wrong_address_is_refused(address, more, words, tmp_path):
    path = over_ethernet(tmp_path, address, more)
    assert refusal(lambda: machine.load(path)).startswith(f"{path}: {words}")


SPI_PINS = """
link_cs_n = "J2 gp23"
link_sclk = "J2 gn23"
link_mosi = "J2 gp24"
link_miso = "J2 gn24"
"""


def over_spi(folder, volts=3.3, pins=SPI_PINS):
    """The mill with its link over SPI on an ULX3S."""
    node = "memory_kib = 64\naddress = 1\n"
    last = 'rs485_driver_enable = "J2 gp22"\n'
    between = f'[between.link_spi]\npart = "none"\nvolts = {volts}\n\n[between.encoder]'
    return edited(
        folder,
        "constraints/machines/mill.toml",
        (node, f'{node}peripherals = ["link_spi"]\n'),
        (last, last + pins),
        ("[between.encoder]", between),
    )


def test_a_link_over_spi_has_four_pins(tmp_path):
    design = fit(board.named("ulx3s_25f"), machine.load(over_spi(tmp_path)))
    assert (design.parameters["HAS_LINK"], design.parameters["LINK_CARRIER"]) == (1, 2)
    made = generate.files(design)
    for name in ("cs_n", "sclk", "mosi"):
        assert f".link_{name}(link_{name})" in made["top.sv"]
    assert "assign link_miso = node_link_miso;" in made["top.sv"]
    assert 'LOCATE COMP "link_miso" SITE "D16";' in made["pins.lpf"]
    for words in ("chip select of the host", "data to the host"):
        assert words in made["wiring.html"]
    plain = generate.files(fit(board.named("ulx3s_25f"), machine.named("mill")))
    assert ".link_cs_n(1'b1)" in plain["top.sv"] and "LINK_CARRIER" not in plain["top.sv"]


def test_the_pll_of_a_link_is_built_where_the_machine_asks_for_it(tmp_path):
    path = over_spi(tmp_path)
    without = fit(board.named("ulx3s_25f"), machine.load(path))
    assert "LINK_PLL" not in without.parameters
    path.write_text(path.read_text().replace('["link_spi"]', '["link_spi"]\nlink_pll = true'))
    with_it = fit(board.named("ulx3s_25f"), machine.load(path))
    assert with_it.parameters == without.parameters | {"LINK_PLL": 1}
    path.write_text(path.read_text().replace('["link_spi"]', "[]"))
    assert "link_pll needs a real-time link" in refusal(lambda: machine.load(path))


def test_a_link_over_spi_with_a_wrong_level_or_beside_another_link_is_refused(tmp_path):
    path = over_spi(tmp_path, volts=5.0)
    found = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "link_cs_n comes with 5 V" in found
    path = over_spi(tmp_path, pins=SPI_PINS.replace("link_miso", "# link_miso"))
    found = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "link_miso has no pin" in found
    path.write_text(path.read_text().replace('["link_spi"]', '["link", "link_spi"]'))
    assert "a node has one of them" in refusal(lambda: machine.load(path))


def test_a_link_over_ethernet_needs_a_phy_and_no_serial_line(tmp_path):
    path = over_ethernet(tmp_path)
    found = refusal(lambda: fit(board.named("ulx3s_85f"), machine.load(path)))
    assert found.startswith(f"{path}: [node.ethernet] needs a board with an Ethernet PHY")
    both = tmp_path / "both.toml"
    both.write_text(path.read_text().replace("[node]", '[node]\nperipherals = ["link"]'))
    assert "a node has one of them" in refusal(lambda: machine.load(both))


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('interface = "rgmii"', 'interface = "sgmii"', "interface 'sgmii' is none of mii, rgmii"),
        ('"K2", "L1", "N1", "P1"', '"K2", "L1", "N1"', "rx_data must name 4 pins"),
        ('tx_clk = ["G1"]', 'tx_clk = ["ZZ"]', "has no pin ZZ"),
    ],
)
def test_a_wrong_phy_is_refused(old, new, words, tmp_path):
    path = edited(tmp_path, "constraints/colorlight_i5/board.toml", (old, new))
    assert words in refusal(lambda: board.load(path))


def test_a_recorder_of_ticks_is_built_where_its_memory_has_room(tmp_path):
    path = edited(tmp_path, S0, ("filters = 2\n", "filters = 2\nscope_words = 16384\n"))
    found = fit(board.named("ulx3s_85f"), machine.load(path))
    assert found.parameters["SCOPE_WORDS"] == 16384
    small = refusal(lambda: fit(board.named("ulx3s_25f"), machine.load(path)))
    assert "need about 93 block RAM" in small, "57, and 36 for the recorder"
    assert fit(board.named("ulx3s_85f"), machine.named("s0")).parameters["SCOPE_WORDS"] == 0


@pytest.mark.parametrize(
    "file, words, message",
    [
        (S0, 1000, "scope_words = 1000 must be 0 or a power of two from 256 to 65536"),
        (S0, 128, "scope_words = 128 must be 0 or a power of two"),
        (MILL, 256, "scope_words needs image axis or stream"),
    ],
)
def test_a_recorder_of_ticks_that_cannot_be_is_refused(file, words, message, tmp_path):
    path = edited(tmp_path, file, ("memory_kib", f"scope_words = {words}\nmemory_kib"))
    assert message in refusal(lambda: machine.load(path))


def test_a_board_without_switches_has_the_address_of_the_machine():
    assert (
        generate.inputs(fit(board.named("colorlight_i5"), machine.named("mill")))["address"]
        == "4'd1"
    )


@pytest.fixture
def packed(monkeypatch):
    """pack() of the counter box with a packer that writes these bytes."""
    design = fit(board.named("icebreaker"), machine.named("counter_box"))
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        folder = Path(name)
        (folder / "counter_serial.bin").write_bytes(b"firmware")

        def pack(bits):
            write = lambda words, step, log: (ROOT / words[-1]).write_bytes(bits)
            monkeypatch.setattr(build, "run", write)
            return build.pack(design, folder).read_bytes()

        yield pack


def test_the_flash_has_the_firmware_where_the_node_reads_it(packed):
    found = packed(b"bitstream")
    assert found == b"bitstream" + b"\xff" * (0x20000 - 9) + b"firmware"


def test_updates_of_the_firmware_are_built_on_request_and_need_the_serial_core(tmp_path):
    more = ("memory_kib = 64", "memory_kib = 64\nupdate = true")
    box = edited(tmp_path, "constraints/machines/counter_box.toml", more)
    design = fit(board.named("icebreaker"), machine.load(box))
    assert design.parameters["HAS_UPDATE"] == 1
    path = edited(tmp_path, MILL, ("[node]", "[node]\nupdate = true"))
    assert refusal(lambda: machine.load(path)) == (
        f"{path}: [node] update needs core 'serial': the firmware of the other comes out of RAM"
    )


def test_a_bitstream_that_reaches_into_the_firmware_is_refused(packed):
    with pytest.raises(SynthesisError, match="the bitstream has 131073 bytes, the firmware is at"):
        packed(b"x" * 131073)


def test_a_router_that_does_not_end_is_reported(monkeypatch):
    monkeypatch.setattr(synthesis, "LONGEST_S", 0.1)
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        log = Path(name) / "place_and_route.log"
        sleeps = [sys.executable, "-c", "import time; time.sleep(60)"]
        with pytest.raises(SynthesisError) as why:
            synthesis.run(sleeps, "place and route", log)
        assert str(why.value) == (
            "place and route has not ended after 0.0 minutes: try another seed "
            f"(log: {log.relative_to(ROOT)})"
        )


def test_the_log_of_a_tool_that_fails_is_named_with_its_error():
    with tempfile.TemporaryDirectory(dir=ROOT / "build") as name:
        log = Path(name) / "synthesis.log"
        words = "import sys; print('ERROR: no way'); sys.stderr.write('bye'); sys.exit(1)"
        with pytest.raises(SynthesisError) as why:
            synthesis.run([sys.executable, "-c", words], "synthesis", log)
        assert str(why.value).startswith("synthesis failed: ERROR: no way (log: build/")


def no_way(*_):
    raise SynthesisError("no way")


def no_more(*_):
    raise AssertionError("it is placed again")


@pytest.mark.parametrize(
    "place, failed",
    [
        (lambda design, *_: (design.board.node_hz / 1e6, {}), 0),
        (lambda design, folder, netlist, seed: (17.9 + seed, {}), 2),  # 18.9 MHz at the worst
        (no_way, 3),
    ],
)
def test_the_figure_counts_builds_that_miss_their_clock_or_have_no_bitstream(
    place, failed, monkeypatch, tmp_path
):
    """Of four builds: one reaches 18 MHz but not 48 or 27, one needs no placement."""
    names = ("icebreaker", "ice40_hx8k_evn", "tang_nano_9k", "arty_a7_35t")
    designs = [next(one for one in DESIGNS if one.board.name == name) for name in names]
    monkeypatch.setattr(build, "fitting", lambda: (designs, []))
    for name in ("check_tools", "write", "make_firmware", "synthesise", "pack"):
        monkeypatch.setattr(build, name, lambda *_: tmp_path)
    (tmp_path / build.PLACED).write_text("placed")
    monkeypatch.setattr(build, "cells", lambda _: "1 LUT")
    monkeypatch.setattr(build, "place", place)
    monkeypatch.setattr(build, "netlist_state", lambda design, _: design.name)
    monkeypatch.setattr(placements, "RECORD", tmp_path / "placements.toml")
    assert boards_failed() == failed
    monkeypatch.setattr(build, "place", no_more)  # each placement was kept
    assert boards_failed() == failed
    monkeypatch.setattr(build, "state", lambda design: design.name)  # other sources, same netlist
    assert boards_failed() == failed
    monkeypatch.setattr(build, "state", lambda design: f"again-{design.name}")
    monkeypatch.setattr(build, "netlist_state", lambda *_: "another netlist")
    with pytest.raises(AssertionError):
        boards_failed()


# Clocks and sizes


def test_the_pll_makes_the_clock_of_the_node_exactly():
    ecp5 = clocks.pll(clocks.ecp5, 25_000_000, 50_000_000, "")
    assert ecp5.settings == {"CLKI_DIV": 1, "CLKFB_DIV": 2, "CLKOP_DIV": 12}  # 600 MHz
    ice40 = clocks.pll(clocks.ice40, 12_000_000, 18_000_000, "")
    assert ice40.settings == {"DIVR": 0, "DIVF": 47, "DIVQ": 5, "FILTER_RANGE": 1}  # 576 MHz
    xc7 = clocks.pll(clocks.xc7, 100_000_000, 50_000_000, "")
    assert xc7.settings == {"DIVCLK_DIVIDE": 1, "CLKFBOUT_MULT": 10, "CLKOUT0_DIVIDE": 20}
    assert clocks.pll(clocks.ecp5, 25_000_000, 25_000_000, "") is None


def test_the_pll_of_an_ice40_is_at_its_pad_where_the_clock_comes_in_there():
    """Pin J3 of the HX8K is no pin of a PLL."""
    tops = {
        name: generate.top(fit(board.named(name), machine.named("relay")))
        for name in ("icebreaker", "ice40_hx8k_evn")
    }
    assert "SB_PLL40_PAD #(" in tops["icebreaker"] and ".PACKAGEPIN(clock)" in tops["icebreaker"]
    of_hx8k = tops["ice40_hx8k_evn"]
    assert "SB_PLL40_CORE #(" in of_hx8k and ".REFERENCECLK(clock)" in of_hx8k


def test_the_size_of_the_peripherals_is_the_one_of_their_page():
    assert f"take {size.PERIPHERALS} LUT4" in (ROOT / "docs" / "peripherals.md").read_text()


def test_the_block_rams_are_those_of_netlists(tmp_path):
    """Of nodes that were synthesised for an ECP5: 48 + 8 of the S0 node without its segment table,
    32 + 10 of eight axes.
    """
    assert size.estimate("ecp5", machine.named("s0")).block_ram == 56 + 1
    assert size.estimate("ecp5", machine.named("eight_axes")).block_ram == 42
    assert size.estimate("ecp5", machine.named("mill")).block_ram == 38
    assert size.estimate("xc7", machine.named("mill")).block_ram == 19  # of 36 kbit
    assert TOO_LARGE == [
        "constraints/machines/s0.toml: 1 axis with 96 KiB need about 57 block RAM, but "
        "LFE5U-25F-6BG381C of constraints/ulx3s_25f/board.toml has 56"
    ]


def test_the_size_of_the_link_over_ethernet_is_that_of_the_interface(tmp_path):
    """The core for MII is smaller: 3377 LUT4 against 4921 for RGMII, synthesised."""
    mill = machine.load(over_ethernet(tmp_path))
    arty, plain = (
        fit(board.named("arty_a7_35t"), mill),
        fit(board.named("arty_a7_35t"), machine.named("mill")),
    )
    assert arty.estimate.lut - plain.estimate.lut == size.LINK + 3377
    i5 = fit(board.named("colorlight_i5"), mill).estimate.lut
    assert i5 - arty.estimate.lut == 4921 - 3377


def test_a_node_with_set_points_and_the_real_time_link_has_their_size():
    """Three axes, synthesised: 13 996 LUT4 with the set-points, 9464 without."""
    plain, stream = (
        size.estimate("ecp5", machine.named(name)) for name in ("mill", "mill_linuxcnc")
    )
    more = size.LINK + 3 * (size.FEATURES["backlash"] + size.FEATURES["capture"])
    assert stream.lut - plain.lut - more == 13_996 - 9464 + 1
    assert stream.block_ram == plain.block_ram


def test_a_part_that_is_too_small_for_set_points_is_refused(tmp_path):
    needed = size.estimate("ecp5", machine.named("mill_linuxcnc")).lut
    change = ("lut = 24288", f"lut = {needed - 1}")
    path = edited(tmp_path, "constraints/colorlight_i5/board.toml", change)
    assert fit(board.load(path), machine.named("mill"))
    found = refusal(lambda: fit(board.load(path), machine.named("mill_linuxcnc")))
    assert f"3 axes with 64 KiB need about {needed} LUT, but" in found


# Pins of others


def pins_of(platform, number):
    """{pin: ball} of a connector of Amaranth's."""
    found = next(each for each in platform.connectors if each.number == number)
    return dict(found.mapping)


def resource(platform, name, number=0):
    """The balls of a resource of Amaranth's that has one set of pins."""
    found = next(r for r in platform.resources if (r.name, r.number) == (name, number))
    return found.ios[0].names


def signal(platform, name, part):
    """The ball of one signal of a resource of Amaranth's."""
    found = next(r for r in platform.resources if (r.name, r.number) == (name, 0))
    return next(io.ios[0].names[0] for io in found.ios if io.name == part)


@pytest.mark.parametrize(
    "name, platform", [("ulx3s_25f", ULX3S_25F_Platform), ("ulx3s_85f", ULX3S_85F_Platform)]
)
def test_the_pins_of_the_ulx3s_are_those_of_amaranth(name, platform):
    ours, theirs = board.named(name), pins_of(platform, 0)
    found = {}
    for pins in ours.connectors.values():
        for pin, pad in pins.items():
            found[pin[2:] + {"gp": "+", "gn": "-"}[pin[:2]]] = pad.ball
    assert found == theirs
    assert [ours.clock.ball] == resource(platform, "clk25")
    assert ours.on_board["usb_rx"].ball == signal(platform, "uart", "rx")
    assert ours.on_board["usb_tx"].ball == signal(platform, "uart", "tx")
    switches = [resource(platform, "switch", n)[0] for n in range(4)]
    assert [pad.ball for pad in ours.address] == switches
    leds = {resource(platform, "led", n)[0] for n in range(8)}
    assert {pad.ball for pad in ours.leds.values()} == leds
    assert platform.device in ours.part.name and platform.package in ours.part.name


FLASH_OF_AMARANTH = {
    **{"flash_cs_n": "cs", "flash_sclk": "clk"},
    **{"flash_mosi": "copi", "flash_miso": "cipo"},
}


def test_the_pins_of_the_icebreaker_are_those_of_amaranth():
    ours, platform = board.named("icebreaker"), ICEBreakerPlatform
    for number, name in enumerate(("PMOD1A", "PMOD1B", "PMOD2")):
        theirs = pins_of(platform, number)
        assert {pin: pad.ball for pin, pad in ours.connectors[name].items()} == theirs
    assert [ours.clock.ball] == resource(platform, "clk12")
    assert ours.on_board["usb_rx"].ball == signal(platform, "uart", "rx")
    assert ours.on_board["usb_tx"].ball == signal(platform, "uart", "tx")
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    leds = {ours.leds["sending"].ball: "led_r", ours.leds["running"].ball: "led_g"}
    for ball, name in leds.items():
        assert [ball] == resource(platform, name)


def test_the_pins_of_the_hx8k_board_are_those_of_amaranth():
    ours, platform = board.named("ice40_hx8k_evn"), ICE40HX8KBEVNPlatform
    for name, pins in ours.connectors.items():
        theirs = pins_of(platform, int(name[1:]))
        assert {pin: pad.ball for pin, pad in pins.items()}.items() <= theirs.items()
    assert [ours.clock.ball] == resource(platform, "clk12")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    leds = [pad.ball for pad in ours.leds.values()]
    assert leds == [resource(platform, "led", n)[0] for n in range(len(leds))]
    assert (platform.device, platform.package) == ("iCE40HX8K", "CT256")


def test_the_pins_of_the_arty_are_those_of_amaranth():
    ours, platform = board.named("arty_a7_35t"), ArtyA7_35Platform
    connectors = {(each.name, each.number): dict(each.mapping) for each in platform.connectors}
    for number, name in enumerate(("JA", "JB", "JC", "JD")):
        found = {pin: pad.ball for pin, pad in ours.connectors[name].items()}
        assert found == connectors["pmod", number]
    theirs = connectors["ck_io", 0]
    for pin, pad in ours.connectors["IO"].items():
        assert theirs[f"io{pin}"] == pad.ball
    assert [ours.clock.ball] == resource(platform, "clk100")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for n, pad in enumerate(ours.address):
        assert [pad.ball] == resource(platform, "switch", n)
    for n, pad in enumerate(ours.leds.values()):
        assert [pad.ball] == resource(platform, "led", n)
    assert ours.ethernet
    phy = {port: pad.ball for port, pad in ours.ethernet.pads.items()}
    assert [phy.pop("eth_reference")] == resource(platform, "eth_clk25")
    mii = next(each for each in platform.resources if each.name == "eth_mii")
    theirs = {part.name: part.ios[0].names for part in mii.ios}
    assert [phy.pop("eth_reset_n")] == theirs["rst"]
    for name in ("rx_clk", "rx_dv", "rx_data", "tx_clk", "tx_en", "tx_data"):
        balls = [ball for port, ball in phy.items() if port.startswith(f"eth_{name}")]
        assert balls == theirs[name]
    device = f"{platform.device}{platform.package}-{platform.speed}"
    assert ours.part.device.lower() == device.lower()


def test_the_pins_of_the_orangecrab_are_those_of_amaranth():
    ours, platform = board.named("orangecrab"), OrangeCrabR0_2_25FPlatform
    theirs, names = pins_of(platform, 0), {"miso": "cipo", "mosi": "copi"}
    found = {names.get(pin, pin): pad.ball for pin, pad in ours.connectors["IO"].items()}
    assert found == theirs
    assert [ours.clock.ball] == resource(platform, "clk")
    leds = {"drive_fault": "r", "running": "g", "sending": "b"}
    for mine, colour in leds.items():
        assert ours.leds[mine].ball == signal(platform, "rgb_led", colour)
    assert ours.part.name == f"{platform.device}-{platform.speed}{platform.package}C"


def test_the_pins_of_the_tang_nano_9k_are_those_of_amaranth():
    """Amaranth has no connectors of this board, but what is beside them."""
    ours, platform = board.named("tang_nano_9k"), TangNano9kPlatform
    assert [ours.clock.ball] == resource(platform, "clk27")
    for mine, part in {"usb_rx": "rx", "usb_tx": "tx"}.items():
        assert ours.on_board[mine].ball == signal(platform, "uart", part)
    for mine, part in FLASH_OF_AMARANTH.items():
        assert ours.on_board[mine].ball == signal(platform, "spi_flash_1x", part)
    assert ours.part.device == platform.part


def test_pins_that_are_printed_on_a_board_are_their_own_names():
    for name in ("tang_nano_9k", "tang_nano_20k"):
        for pins in board.named(name).connectors.values():
            assert all(pin == pad.ball for pin, pad in pins.items())


@pytest.mark.parametrize(
    "family, device, package, count",
    [  # I/O pins by the data sheets; of a Gowin part without the four of JTAG
        ("ice40", "up5k", "sg48", 39),
        ("ice40", "hx8k", "ct256", 206),
        ("xc7", "xc7a35ticsg324-1L", "csg324", 210),
        ("gowin", "GW2AR-LV18QN88C8/I7", "QN88", 66 - 4),
        ("gowin", "GW1NR-LV9QN88PC6/I5", "QN88P", 71 - 4),
    ],
)
def test_packages_have_the_pins_of_their_data_sheets(family, device, package, count):
    assert len(board.package_pins(family, device, package)) == count


# Bad input: board files


@pytest.mark.parametrize(
    "old, new, words",
    [
        (
            'gp3 = "B9"',
            'gp3 = "Z9"',
            "J1 gp3: the package CABGA381 of LFE5U-85F-6BG381C has no pin Z9",
        ),
        (
            'pin = "G2"',
            'pin = "A1"',
            "clock: the package CABGA381 of LFE5U-85F-6BG381C has no pin A1",
        ),
        ('package = "CABGA381"', 'package = "SG48"', "[part] a ecp5 85k has no package SG48"),
        ('family = "ecp5"', 'family = "ecp6"', "[part] family 'ecp6' is none of ecp5, ice40, "),
        ("hz = 25_000_000", 'hz = "25 MHz"', "[clock] hz must be a whole number"),
        ('usb_tx = "L4"', 'usb_ty = "L4"', "[on_board] usb_ty is none of usb_rx, usb_tx, "),
        ('"D7", "E7"]', '"D7"]', "[address] an address has 4 switches"),
        ('running = "H3"', 'runing = "H3"', "[leds] runing is none of running, sending, "),
        ("speed = 6", "speed = 6\nsped = 7", "[part] there is no key sped"),
        ('layout = "ulx3s"', "layout = ", "Invalid value"),
        ('title = "ULX3S', 'name = "ULX3S', "title is missing"),
    ],
)
def test_a_wrong_board_file_is_refused_with_its_name(old, new, words, tmp_path):
    path = edited(tmp_path, ULX3S, (old, new))
    found = refusal(lambda: board.load(path))
    assert found.startswith(f"{path}: ") and words in found


def test_a_clock_that_the_pll_cannot_make_is_refused(tmp_path):
    path = edited(
        tmp_path,
        "constraints/icebreaker/board.toml",
        ("node_hz = 18_000_000", "node_hz = 20_000_000"),
    )
    found = refusal(lambda: fit(board.load(path), machine.named("counter_box")))
    assert found == (
        f"{path}: [clock] the PLL makes no 20000000 Hz of 12000000 Hz; the nearest is 19875000 Hz"
    )


# Bad input: machine files


@pytest.mark.parametrize(
    "old, new, words",
    [
        (  # a pin used twice
            'X.encoder_b = "J1 gn0"',
            'X.encoder_b = "J1 gp0"',
            "X.encoder_a and X.encoder_b both use J1 gp0",
        ),
        (
            'X.step = "J1 gn3"',
            'X.step = "J1 gp77"',
            f"X.step: the connector J1 of {ULX3S} has no pin gp77",
        ),
        (
            'X.step = "J1 gn3"',
            'X.step = "J9 gp1"',
            f"X.step: {ULX3S} has no connector J9; there are: J1, J2",
        ),
        (
            'X.step = "J1 gn3"',
            'X.step = "J1"',
            "X.step: a pin is written \"CONNECTOR PIN\", not 'J1'",
        ),
        (
            'X.step = "J1 gn3"\n',
            "",
            "X.step has no pin; if it is not connected, list it in `unused`",
        ),
        ('X.step = "J1 gn3"', 'X.stepp = "J1 gn3"', "X.stepp is no signal of this machine"),
        (  # a 5 V signal on a 3.3 V pin
            'part = "RS-422 receiver, AM26LV32 at 3.3 V"\nfront_end = "rs422"\nvolts = 3.3',
            'part = "RS-422 receiver, AM26LS32"\nvolts = 5.0',
            f"X.encoder_a comes with 5 V, but J1 gp0 of {ULX3S} takes 3.3 V at most",
        ),
        (
            'part = "RS-485 transceiver, MAX3485"\nfront_end = "rs485"\nvolts = 3.3',
            'part = "MAX485"\nvolts = [5.0]',
            f"rs485_rx comes with 5 V, but J2 gp21 of {ULX3S} takes 3.3 V at most",
        ),
        (
            'image = "steps"',
            'image = "counter"',
            "the image counter has no drives, but axis X has",
        ),
        ('image = "steps"', 'image = "stepps"', "[node] image 'stepps' is none of axis, stream, "),
        (
            "memory_kib = 64",
            "memory_kib = 2048",
            "3 axes with 2048 KiB need about 1030 block RAM, ",
        ),
        ("address = 1", "address = 0", "[node] address 0 must be 1 to 15"),
        ("address = 1", "address = 1\nsegments = 255", "[node] segments = 255, but no axis has"),
        ('name = "Y"', 'name = "X"', "two axes have the name X"),
        ('name = "Y"', 'name = "Y axis"', "[axis 2] name 'Y axis' must consist of letters"),
        (
            'name = "Y"',
            'name = "Y"\nfeatures = ["monitor"]',
            "the feature monitor of axis Y needs sine",
        ),
        (
            'name = "Y"',
            'name = "Y"\nfeatures = ["lasers"]',
            "[axis 2] features: 'lasers' is none of sine, ",
        ),
        (
            'name = "Y"',
            'name = "Y"\nfeatures = ["set_points"]',
            "the feature set_points of axis Y needs image stream or steps_stream: steps does not",
        ),
        ("[between.estop]", "[between.stop]", "[between] stop is none of adc, bridge, "),
        (
            '[between.rs485]\npart = "RS-485 transceiver, MAX3485"\nfront_end = "rs485"',
            '[between.adc]\npart = "RS-485 transceiver, MAX3485"',
            "rs485_rx needs [between.rs485]: part and volts",
        ),
    ],
)
def test_a_wrong_machine_file_is_refused_with_its_name(old, new, words, tmp_path):
    path = edited(tmp_path, MILL, (old, new))
    found = refusal(lambda: fit(board.named("ulx3s_85f"), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


RELAY = "constraints/machines/relay.toml"


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("orders = 16", "orders = 0", "[relay] orders 0 must be 1 to 16"),
        ("orders = 16", "orders = 17", "[relay] orders 17 must be 1 to 16"),
        ("orders = 16", "orders = 16\nimage = 'axis'", "[relay] there is no key image"),
        ("[relay]\n", '[node]\nimage = "axis"\n\n[relay]\n', "has [node] or [relay], not both"),
        ("[relay]\norders = 16\n", "", "node is missing"),
        ("[between.relay]", '[[axis]]\nname = "X"\n\n[between.relay]', "no [[axis]], but X is one"),
        ('relay_z = "PMOD1B 3"\n', "", "[wiring.icebreaker] relay_z has no pin"),
        (
            'fault = "PMOD1B 7"',
            'fault = "PMOD1B 7"\nunused = ["step"]',
            "[wiring.icebreaker] unused: step is no signal of this machine",
        ),
        (
            'fault = "PMOD1B 7"',
            'fault = "PMOD1B 7"\nunused = ["correcting"]',
            "[wiring.icebreaker] correcting is no signal of this machine, or it is in `unused`",
        ),
    ],
)
def test_a_wrong_relay_file_is_refused_with_its_name(old, new, words, tmp_path):
    path = edited(tmp_path, RELAY, (old, new))
    found = refusal(lambda: fit(board.named("icebreaker"), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


def test_a_relay_on_a_board_without_flash_is_refused(tmp_path):
    path = edited(tmp_path, RELAY, ("[wiring.icebreaker]", "[wiring.arty_a7]"))
    path.write_text(path.read_text().replace("PMOD1A", "JA").replace("PMOD1B", "JB"))
    path.write_text(path.read_text().replace("PMOD2", "JC"))
    arty = "constraints/arty_a7_35t/board.toml"
    found = refusal(lambda: fit(board.named("arty_a7_35t"), machine.load(path)))
    assert found == f"{path}: a relay needs flash_cs_n, {arty} has none"


def test_a_serial_core_on_a_part_whose_bitstream_is_a_text_is_refused(tmp_path):
    connectors = board.named("tang_nano_20k").connectors
    places = (f"{name} {pin}" for name in ("J5", "J6") for pin in connectors[name])
    path = edited(
        tmp_path,
        "constraints/machines/counter_box.toml",
        ("[wiring.icebreaker]", "[wiring.tang_nano_20k]"),
    )
    path.write_text(re.sub(r'"PMOD\w+ \d+"', lambda _: f'"{next(places)}"', path.read_text()))
    tang = "constraints/tang_nano_20k/board.toml"
    assert refusal(lambda: fit(board.named("tang_nano_20k"), machine.load(path))) == (
        f"{path}: a serial core has its firmware behind the bitstream, which is a text for "
        f"GW2AR-18C of {tang}"
    )


def test_a_relay_on_a_smaller_part_is_refused(tmp_path):
    path = edited(tmp_path, "constraints/icebreaker/board.toml", ("lut = 5280", "lut = 3520"))
    found = refusal(lambda: fit(board.load(path), machine.named("relay")))
    assert found == (
        f"{RELAY}: a relay of 16 orders needs about {size.RELAY} LUT, but iCE40UP5K-SG48 of {path} "
        "has 3520"
    )


@pytest.mark.parametrize(
    "old, new, words",
    [
        (  # the LED pulls it up
            'Z.direction = "LED 20"\nestop_open = "J6 85"',
            'Z.direction = "J6 85"\nestop_open = "LED 20"',
            "estop_open is an input, but LED 20 of constraints/tang_nano_20k/board.toml is an "
            "output only",
        ),
        (  # a drive that is on until the part is configured
            'X.drive_enable = "J6 29"\nX.step = "LED 15"',
            'X.drive_enable = "LED 15"\nX.step = "J6 29"',
            "X.drive_enable must be low before the configuration, but LED 15 of "
            "constraints/tang_nano_20k/board.toml is pulled up by the board",
        ),
        (
            'X.step = "LED 15"',
            'X.step = "LED 16"',
            "X.step and X.direction both use LED 16",
        ),
        (
            'unused = ["rs485_rx", "rs485_tx", "rs485_driver_enable"]',
            'unused = ["rs485_rx", "rs485_tx"]',
            "rs485_driver_enable has no pin",
        ),
    ],
)
def test_a_wrong_wiring_of_a_tang_nano_is_refused(old, new, words, tmp_path):
    path = edited(tmp_path, MILL, (old, new))
    found = refusal(lambda: fit(board.named("tang_nano_20k"), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


@pytest.mark.parametrize(
    "name, old, new, words",
    [
        (
            "tang_nano_20k",
            '80 = "80"',
            '80 = "1"',
            "J5 80: the package QN88 of GW2AR-18C has no pin 1",
        ),
        (
            "arty_a7_35t",
            '1 = "G13"',
            '1 = "K9"',
            "JA 1: the package csg324 of XC7A35T-1L has no pin K9",
        ),
        (
            "ice40_hx8k_evn",
            'running = "C3"',
            'running = "E1"',
            "LED running: the package ct256 of iCE40HX8K-CT256 has no pin E1",
        ),
        (
            "arty_a7_35t",
            'device = "xc7a35ticsg324-1L"',
            'device = "xc7a35t"',
            "[part] a xc7 xc7a35t has no package csg324",
        ),
    ],
)
def test_a_pin_that_the_package_lacks_is_refused_in_each_family(name, old, new, words, tmp_path):
    path = edited(tmp_path, f"constraints/{name}/board.toml", (old, new))
    assert refusal(lambda: board.load(path)) == f"{path}: {words}"


def test_another_clock_than_that_of_the_board_needs_a_pll(tmp_path):
    changed = ("node_hz = 27_000_000", "node_hz = 54_000_000")
    path = edited(tmp_path, "constraints/tang_nano_20k/board.toml", changed)
    found = refusal(lambda: fit(board.load(path), machine.named("mill")))
    assert found == f"{path}: [clock] the PLL makes no 54000000 Hz of 27000000 Hz"


@pytest.mark.parametrize(
    "files, words",
    [
        ([], "ERROR: the tools for Gowin parts are missing: make gowin gets them"),
        (["stamp", "bin/packer"], "ERROR: 'gowin_pack' is none of packer"),
    ],
)
def test_tools_for_gowin_that_are_missing_are_named(files, words, tmp_path):
    for name in ["../../tools/gowin.py", *files]:
        copy = tmp_path / "build" / "gowin" / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text((ROOT / "tools" / "gowin.py").read_text())
    command = [sys.executable, tmp_path / "tools" / "gowin.py", "gowin_pack"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, words + "\n")


def test_a_part_whose_tools_are_missing_is_refused_before_anything_is_built(monkeypatch, tmp_path):
    monkeypatch.setattr(gowin, "FOLDER", tmp_path)
    monkeypatch.setattr(build, "OUT", tmp_path)
    said = []
    with pytest.raises(Misfit) as why:
        build.bitstream(fit(board.named("tang_nano_9k"), machine.named("relay")), 1, said.append)
    assert str(why.value) == (
        "constraints/tang_nano_9k/board.toml: the tools for a GW1NR-9C are missing: make gowin "
        "gets them"
    )
    assert not said and not list(tmp_path.iterdir())


def test_a_part_without_an_open_placer_ends_with_a_script(monkeypatch, tmp_path):
    design = fit(board.named("arty_a7_35t"), machine.named("mill"))
    netlist = tmp_path / "netlist.json"
    kinds = ["LUT3", "LUT6", "RAMB36E1", "FDRE", "IBUF"]
    cells = {str(n): {"type": kind} for n, kind in enumerate(kinds)}
    netlist.write_text(json.dumps({"modules": {"top": {"cells": cells}}}))
    monkeypatch.setattr(build, "OUT", tmp_path)
    monkeypatch.setattr(build, "shown", str)
    monkeypatch.setattr(build, "make_firmware", lambda *_: "firmware")
    monkeypatch.setattr(build, "synthesise", lambda *_: netlist)
    said = []
    made = build.bitstream(design, 1, said.append)
    assert made == tmp_path / "arty_a7_35t-mill" / "vivado.tcl" and made.is_file()
    assert said[-1] == "2 LUT, 1 flip-flops, 1 block RAMs of 36 kbit"
    with pytest.raises(Misfit, match="arty_a7_35t/board.toml: no open tool places a XC7A35T-1L"):
        build.chip(design)


V8 = "constraints/colorlight_5a_75b_v8_0/board.toml"


@pytest.mark.parametrize(
    "old, new, words",
    [
        (  # an output on an input-only buffer
            'Z.step = "J2 G0"',
            'Z.step = "J8 B1"',
            f"Z.step is an output, but J8 B1 of {V8} is an input only behind its buffer (74HC245T",
        ),
        (  # an input on an output-only buffer
            'turned = ["J5", "J6", "J7", "J8"]',
            'turned = ["J6", "J7", "J8"]',
            f"X.encoder_a is an input, but J5 R0 of {V8} is an output only behind its buffer (74HC",
        ),
        (  # one net on two connectors
            'Z.step = "J2 G0"\nZ.direction = "J2 B0"',
            'Z.step = "J1 CLK"\nZ.direction = "J2 CLK"',
            f"Z.step and Z.direction both use J2 CLK (the same net as J1 CLK of {V8})",
        ),
        (
            'turned = ["J5", "J6", "J7", "J8"]',
            'turned = ["J5", "J6", "J7", "J9"]',
            f"turned: {V8} has no buffers at a connector J9",
        ),
        (  # 5 V into a part for 3.3 V
            'between.stepper]\npart = "stepper driver with inputs for 5 V"\nvolts = 5.0',
            'between.stepper]\npart = "stepper driver with inputs for 3.3 V"\nvolts = 3.3',
            f"X.step needs 3.3 V, but J1 G0 of {V8} gives 5 V",
        ),
        (
            "address = 1\n",
            'address = 1\nunused = ["rs485_rx"]\n',
            "rs485_rx is no signal of this machine, or it is in `unused`",
        ),
    ],
)
def test_what_the_buffers_of_the_5a_75b_do_not_allow_is_refused(old, new, words, tmp_path):
    path = edited(tmp_path, MILL, (old, new))
    found = refusal(lambda: fit(board.named("colorlight_5a_75b_v8_0"), machine.load(path)))
    assert found.startswith(f"{path}: ") and words in found


def test_a_node_without_any_bus_is_refused(tmp_path):
    text = (
        (ROOT / MILL).read_text().replace("address = 1\n", 'address = 1\nunused = ["rs485_rx"]\n')
    )
    path = tmp_path / "mill.toml"
    path.write_text(re.sub(r"^rs485_rx = .*\n", "", text, flags=re.M))
    found = refusal(lambda: fit(board.named("colorlight_5a_75b_v8_0"), machine.load(path)))
    assert found == f"{path}: {V8} has no USB serial port: connect rs485_rx"


def test_more_axes_than_a_node_has_are_refused(tmp_path):
    path = edited(
        tmp_path,
        "constraints/machines/eight_axes.toml",
        ("[between.encoder]", '[[axis]]\nname = "W"\ndrives = ["stepper"]\n\n[between.encoder]'),
    )
    assert refusal(lambda: machine.load(path)) == f"{path}: 9 axes; a node has 1 to 8"


def test_more_axes_than_the_part_holds_are_refused(tmp_path):
    more = '[[axis]]\nname = "E"\nfeatures = ["capture"]\n'
    more += 'unused = ["encoder_z", "probe_0", "probe_1"]\n\n'
    path = edited(
        tmp_path,
        "constraints/machines/counter_box.toml",
        ("[between.encoder]", more + "[between.encoder]"),
        ('D.probe_0 = "PMOD2 3"', 'E.encoder_a = "PMOD2 3"'),
        ('D.probe_1 = "PMOD2 4"', 'E.encoder_b = "PMOD2 4"'),
        ('name = "D"\n', 'name = "D"\nunused = ["probe_0", "probe_1"]\n'),
    )
    found = refusal(lambda: fit(board.named("icebreaker"), machine.load(path)))
    assert found == (
        f"{path}: 5 axes with 64 KiB need about 35 block RAM, but iCE40UP5K-SG48 of "
        "constraints/icebreaker/board.toml has 30"
    )


def test_a_pin_that_the_board_uses_itself_is_refused(tmp_path):
    """Pin 1 of P5A is the serial port of the extension board."""
    path = edited(tmp_path, MILL, ('X.encoder_a = "P2A 1"', 'X.encoder_a = "P5A 1"'))
    found = refusal(lambda: fit(board.named("colorlight_i5"), machine.load(path)))
    i5 = "constraints/colorlight_i5/board.toml"
    assert found == (
        f"{path}: usb_tx and X.encoder_a both use P5A 1 (the same net as usb_tx of {i5})"
    )


def test_a_machine_that_is_not_wired_for_a_board_is_refused():
    found = refusal(lambda: fit(board.named("icebreaker"), machine.named("s0")))
    assert found == (
        "constraints/machines/s0.toml: has no [wiring.icebreaker] for the board icebreaker; it is "
        "wired for ulx3s, arty_a7"
    )


def test_unknown_names_list_the_known_ones(tmp_path):
    assert "there is no board 'nexys'; there are: arty_a7_35t, colorlight_5a" in refusal(
        lambda: board.named("nexys")
    )
    assert "there is no machine 'lathe'; there are: c" in refusal(lambda: machine.named("lathe"))
    missing = tmp_path / "lathe.toml"
    assert refusal(lambda: machine.named(str(missing))) == f"{missing}: no such file or directory"


def test_the_command_refuses_before_any_tool_runs(tmp_path):
    path = edited(tmp_path, MILL, ('X.encoder_b = "J1 gn0"', 'X.encoder_b = "J1 gp0"'))
    command = [sys.executable, "-m", "boards.build", "--board", "ulx3s_85f", "--machine", str(path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "")
    words = f"board: {path}: X.encoder_a and X.encoder_b both use J1 gp0\n"
    assert done.stderr == words

# SPDX-License-Identifier: Apache-2.0
"""Boards and machines that do not fit are refused in one line, before anything is built."""

import json
import re
import subprocess
import sys

import pytest

from boards import board, build, clocks, machine, size
from boards.fit import fit
from boards.toml_file import Misfit
from tb.bench import ROOT
from tb.system.board_files import MILL, ULX3S, assert_refused, edited, refusal
from tools import gowin

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
        ("hz = 25_000_000", "hz = 0", "[clock] hz = 0 must be 1 to 1000000000"),
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
        ('name = "Y"', 'name = "x"', "two axes have the name x, as their pins are in small"),
        ('name = "Y"', 'name = "node"', "[axis 2] name 'node' is taken: signals of the top begin"),
        ("memory_kib = 64", "memory_kib = 0", "[node] memory_kib = 0 must be 1 to 4096"),
        ("address = 1", "address = 1\nfilters = 8", "[node] filters = 8 must be 0 to 2"),
        ("address = 1", "address = 1\nsegments = -1", "[node] segments = -1 must be 0 to 255"),
        ("address = 1", "address = 1\nsegments = 2", "[node] segments = 2: a table has 3 at least"),
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
    assert_refused(path, "ulx3s_85f", words)


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
    assert_refused(path, "icebreaker", words)


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


TANG = "constraints/tang_nano_20k/board.toml"


@pytest.mark.parametrize(
    "old, new, words",
    [
        (
            'flash_cs_n = "60"\n',
            "",
            "a node with core 'flash' needs flash_cs_n, {path} has none",
        ),
        (
            "[code] # in the flash of the configuration, which has 8 MiB\noffset = 0x70_0000\n"
            'loader = ["--external-flash"]\n',
            "",
            "core 'flash' needs [code] of {path}: where in the flash the firmware may be",
        ),
        (
            "node_hz = 27_000_000",
            "node_hz = 13_500_000",
            "core 'flash' needs a clock of 15000000 Hz at least, but {path} has 13500000 Hz",
        ),
    ],
)
def test_a_board_that_cannot_execute_from_its_flash_is_refused(
    old, new, words, tmp_path, monkeypatch
):
    path, flashed = edited(tmp_path, TANG, (old, new)), machine.named("s0_flash")
    monkeypatch.setattr(clocks, "pll", lambda *_: None)
    found = refusal(lambda: fit(board.load(path), flashed))
    assert found == f"{flashed.file}: {words.format(path=path)}"


@pytest.mark.parametrize("offset", [0, 0x70_0001, 0x100_0000])
def test_code_that_no_command_reaches_in_the_flash_is_refused(offset, tmp_path):
    path = edited(tmp_path, TANG, ("offset = 0x70_0000", f"offset = {offset}"))
    assert refusal(lambda: board.load(path)) == (
        f"{path}: [code] offset {offset} must be a multiple of 65536, above 0 and below 16777216"
    )


def test_an_unknown_core_is_refused(tmp_path):
    path = edited(
        tmp_path, "constraints/machines/s0_flash.toml", ('core = "flash"', 'core = "rom"')
    )
    assert refusal(lambda: machine.load(path)) == (
        f"{path}: [node] core 'rom' is none of soft, serial, flash"
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
    assert_refused(path, "tang_nano_20k", words)


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
        (  # a net of a connector whose buffers are inputs now
            'X.step = "J1 G0"',
            'X.step = "J1 A"',
            f"X.step is an output, but J1 A is the same net as J5 A of {V8}, whose buffers were",
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
    assert_refused(path, "colorlight_5a_75b_v8_0", words)


@pytest.mark.parametrize("name", ["rs485_rx", "rs485_tx"])
def test_a_node_without_any_bus_is_refused(name, tmp_path):
    text = (ROOT / MILL).read_text().replace("address = 1\n", f'address = 1\nunused = ["{name}"]\n')
    path = tmp_path / "mill.toml"
    path.write_text(re.sub(rf"^{name} = .*\n", "", text, flags=re.M))
    found = refusal(lambda: fit(board.named("colorlight_5a_75b_v8_0"), machine.load(path)))
    assert found == f"{path}: {V8} has no USB serial port: connect {name}"


def test_a_file_that_is_no_text_in_utf_8_is_refused(tmp_path):
    path = tmp_path / "mill.toml"
    path.write_bytes('title = "Fräse"'.encode("latin-1"))
    assert refusal(lambda: machine.load(path)) == f"{path}: is no text in UTF-8"


@pytest.mark.parametrize("volts", ["-24", "0", "nan", "inf", "true", '"5 V"', "[]", "[3.3, -5.0]"])
def test_levels_that_are_none_are_refused(volts, tmp_path):
    changed = ('front_end = "rs485"\nvolts = 3.3', f'front_end = "rs485"\nvolts = {volts}')
    path = edited(tmp_path, MILL, changed)
    words = "[between.rs485] volts must be a number above 0 or a list of such numbers"
    assert refusal(lambda: machine.load(path)) == f"{path}: {words}"


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

# SPDX-License-Identifier: Apache-2.0
"""Front ends: their files and refusals, the link on the wiring page, the 1 Vpp path in ngspice
(skipped where it is not installed) against theory, and the result in the twin.
"""

import math

import pytest

from boards import board, front_ends, generate, machine, spice
from boards.fit import fit
from boards.toml_file import Misfit, Table
from tb.bench import ROOT
from twin.machines.stage import Stage
from twin.parameters import front_ends as results
from twin.parameters import tables

SINCOS = front_ends.named(spice.NAME)
VALUE = {part.ref: part.value for part in SINCOS.parts}
TOLERANCE = {part.ref: part.tolerance_pct / 100 for part in SINCOS.parts}


def content():
    """A small front end."""
    part = {"ref": "R1", "part": "resistor", "value": 120.0, "unit": "ohm", "why": "ends"}
    return {
        "title": "t",
        "purpose": "p",
        "groups": ["encoder"],
        "volts": [3.3],
        "channels": 1,
        "part": [part],
    }


@pytest.mark.parametrize("name", front_ends.names())
def test_each_front_end_is_for_known_signals_and_says_why_for_each_part(name):
    found = front_ends.named(name)
    assert found.groups and set(found.groups) <= set(machine.GROUPS)
    assert found.parts and all(part.why for part in found.parts)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": "volt"}, "the unit 'volt' of R1 is none of"),
        ({"value": 0.0}, "the value of R1 must be more than 0"),
        ({"nets": ["a"]}, "R1 must have two nets"),
        ({"valeu": 1.0}, "there is no key valeu"),
    ],
)
def test_a_wrong_part_is_refused(change, words):
    wrong = content()
    wrong["part"][0] |= change
    with pytest.raises(Misfit, match=words):
        front_ends.front_end_of(Table(wrong, "x.toml"), "x")


def test_two_parts_of_one_name_and_an_unknown_front_end_are_refused():
    twice = content()
    twice["part"] *= 2
    with pytest.raises(Misfit, match="two parts have the name R1"):
        front_ends.front_end_of(Table(twice, "x.toml"), "x")
    with pytest.raises(Misfit, match="there is no front end 'rs423'; there are: .*rs422"):
        front_ends.named("rs423")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"rs422"', '"rs423"', r"\[between.encoder\] there is no front end 'rs423'"),
        ('"rs422"', '"rs485"', r"\[between.encoder\] the front end rs485 is for rs485"),
        (
            '"rs422"\nvolts = 3.3',
            '"rs422"\nvolts = 5.0',
            "the front end rs422 has 3.3 V at the board",
        ),
    ],
)
def test_a_machine_with_a_front_end_that_does_not_fit_is_refused(old, new, words, tmp_path):
    text = (ROOT / "constraints" / "machines" / "s3.toml").read_text()
    assert text.count(old) == 1
    copy = tmp_path / "s3.toml"
    copy.write_text(text.replace(old, new))
    with pytest.raises(Misfit, match=words):
        machine.load(copy)


def test_the_wiring_page_links_each_front_end_to_its_heading():
    design = fit(board.named("ulx3s_85f"), machine.named("s0"))
    page = generate.files(design)["wiring.html"]
    headings = (ROOT / "docs" / "front_ends.md").read_text().splitlines()
    named = {one.between.front_end for one in design.connections} - {""}
    assert {"sincos_1vpp", "rs485", "step_driver"} == named
    for name in named:
        uses = sum(one.between.front_end == name for one in design.connections)
        assert page.count(f'href="{generate.FRONT_ENDS}#{name}"') == uses
        assert f"## {name}" in headings
    folder = ROOT / "build" / "boards" / design.name
    assert (folder / generate.FRONT_ENDS).resolve() == ROOT / "docs" / "front_ends.md"


def test_the_parts_table_shows_values_with_their_prefix():
    shown = {part.ref: part.shown for part in SINCOS.parts}
    assert (shown["R2"], shown["R4"], shown["C1"], shown["U1"]) == (
        "1 kohm",
        "2.87 kohm",
        "330 pF",
        "1",
    )


# The 1 Vpp path


def check_numbers(found):
    """The numbers of the simulation against formulas of the circuit."""
    gain = VALUE["R4"] / VALUE["R2"]
    assert found["gain"] == pytest.approx(gain, rel=1e-3)
    pole = 1 / (2 * math.pi * (VALUE["R6"] + VALUE["R7"]) * VALUE["C1"])
    assert found["bandwidth"] == pytest.approx(pole, rel=0.01)
    highest = SINCOS.analogue.signal["highest_hz"]
    assert found["lag_deg"] == pytest.approx(math.degrees(math.atan(highest / pole)), abs=0.5)
    # each resistor has 4kTR; feedback resistors count once, input resistors with the gain
    noisy = 4 * spice.BOLTZMANN * spice.KELVIN
    its = SINCOS.analogue.amplifier
    density = math.sqrt(
        2 * noisy * (VALUE["R4"] + gain**2 * VALUE["R2"])
        + (its["noise"] * (1 + gain)) ** 2
        + 2 * (its["current_noise"] * VALUE["R4"]) ** 2
    )
    # a pole of one capacitor passes pi / 2 times its frequency; its own resistors add kT / C
    volts = math.hypot(
        density * math.sqrt(pole * math.pi / 2),
        math.sqrt(spice.BOLTZMANN * spice.KELVIN / VALUE["C1"]),
    )
    lsb = 2 * SINCOS.analogue.converter["reference"] / 2**12
    assert found["noise_amplifier"] == pytest.approx(volts / lsb, rel=0.03)
    # worst case of all tolerances: two ratios of two resistors, two references
    most = 4 * TOLERANCE["R2"] + 2 * SINCOS.analogue.converter["reference_pct"] / 100
    assert most / 4 < found["gain_mismatch"] <= found["gain_mismatch_worst"] < 1.05 * most
    # a converter pin takes 0 to its reference, an input of the amplifier 1.2 V below its rail
    assert 0 < found["pin_lowest"] < found["pin_highest"] < SINCOS.analogue.converter["reference"]
    assert 0 < found["input_lowest"] < found["input_highest"] < its["rail"] - 1.2
    assert found["highest_amplitude"] + found["offset"] < 1
    assert found["bending"] < 0.5


def test_the_result_belongs_to_the_file_and_agrees_with_theory():
    found = results.load(spice.NAME)
    assert found["state"] == spice.state(SINCOS), "run make spice"
    check_numbers(found)


def test_ngspice_gives_the_result_again(tmp_path):
    if reason := spice.missing():
        pytest.skip(reason)
    made = spice.result(SINCOS, spice.rows(SINCOS, tmp_path))
    check_numbers(made)
    for name, value in results.load(spice.NAME).items():
        if name in made and name != "bending":
            assert made[name] == pytest.approx(value, rel=2e-3), name


def test_ngspice_that_fails_is_reported(tmp_path, monkeypatch):
    if reason := spice.missing():
        pytest.skip(reason)
    monkeypatch.setattr(spice, "deck", lambda front_end: ".control\nquit\n.endc\n.end\n")
    with pytest.raises(spice.SpiceError, match="printed 0 rows `offset`"):
        spice.rows(SINCOS, tmp_path)


def test_without_ngspice_the_check_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(spice.SpiceError, match="make ngspice"):
        spice.rows(SINCOS, tmp_path)


def test_the_twin_has_the_amplitude_and_the_gain_of_the_front_end():
    plant = results.front_end(spice.NAME)
    assert set(plant) <= set(tables.values())
    assert plant["signal_noise"] == pytest.approx(results.load(spice.NAME)["noise"] / 16)
    stage = Stage(**plant)
    period = stage.plant["grating_period"]
    waves = [stage.analogue(n * period / 64) for n in range(64)]
    sine, cosine = ((max(wave) - min(wave)) / 2 for wave in zip(*waves, strict=True))
    assert sine == pytest.approx(plant["signal_amplitude"], rel=2e-3)
    assert cosine / sine == pytest.approx(plant["signal_gain_cos"], rel=2e-3)


def test_a_result_that_there_is_not_is_named():
    with pytest.raises(KeyError, match="sincos_1vpp"):
        results.front_end("sincos")

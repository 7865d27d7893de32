# SPDX-License-Identifier: Apache-2.0
"""Check of the 1 Vpp front end with ngspice: `make spice`.

The netlist has the sine and the cosine channel, made of the parts of
constraints/front_ends/sincos_1vpp.toml; each amplifier is a model of its own with one pole, noise,
offset and output limits from the data sheet that the file names. The Monte Carlo draws each part
of each board evenly within its tolerance. The result is written to sw/twin/parameters/front_ends,
where twin.parameters.front_ends reads it.

python -m boards.spice
"""

import math
import random
import shutil
import subprocess
import sys
import zlib
from collections.abc import Iterator
from pathlib import Path

from boards import front_ends
from boards.front_ends import Analogue, FrontEnd
from boards.toml_file import ROOT
from twin.parameters.front_ends import FOLDER as RESULTS

NAME = "sincos_1vpp"
CHANNELS = ("s", "c")
KELVIN = 300.15  # the temperature of ngspice unless it is given
BOLTZMANN = 1.380649e-23  # J/K
LOW_HZ = 1e3  # of the gain: far below the pole
STEEPNESS = 1e-3  # A/V of the amplifier's model; it cancels out
REFERENCE_OHM = 1e3  # of the noise resistors that make the noise currents
MOST_OF_BOARDS = 0.99  # share of the boards that the mismatches given to the twin cover
PATIENCE_S = 120.0


class SpiceError(Exception):
    """What kept the check from its end, in words."""


def missing() -> str:
    """What is missing for the check, in words; empty if nothing is."""
    return "" if shutil.which("ngspice") else "ngspice is not installed: make ngspice"


def analogue(front_end: FrontEnd) -> Analogue:
    """What is simulated of a front end; a SpiceError if nothing is."""
    if front_end.analogue is None:
        raise SpiceError(f"{front_end.file} has no [analogue]: there is nothing to simulate")
    return front_end.analogue


def output_common_mode(front_end: FrontEnd) -> float:
    """V at the outputs of the amplifier: the divider of the supply."""
    value = {part.ref: part.value for part in front_end.parts}
    return analogue(front_end).signal["supply"] * value["R9"] / (value["R8"] + value["R9"])


def amplifier(front_end: FrontEnd, channel: str) -> list[str]:
    """The model of an amplifier: its difference drives one pole, whose voltage is the output."""
    its, c = analogue(front_end).amplifier, channel
    noisy = 4 * BOLTZMANN * KELVIN
    pole = STEEPNESS / (2 * math.pi * its["gain_bandwidth"])
    current = its["current_noise"] / math.sqrt(noisy * REFERENCE_OHM)
    middle, low, high = output_common_mode(front_end), its["swing"], its["rail"] - its["swing"]
    return [
        f"Gd_{c} 0 x_{c} sum_p_{c} sum_n_{c} {STEEPNESS:g}",
        f"Rx_{c} x_{c} 0 {its['open_loop_gain'] / STEEPNESS:g}",
        f"Cx_{c} x_{c} 0 {pole:.6g}",
        f"Ren_{c} en_{c} 0 {its['noise'] ** 2 / noisy:.6g}",
        f"Gen_{c} 0 x_{c} en_{c} 0 {STEEPNESS:g}",
        f"Vos_{c} os_{c} 0 dc 0",
        f"Gos_{c} 0 x_{c} os_{c} 0 {STEEPNESS:g}",
        *(f"Ri{n}_{c} i{n}_{c} 0 {REFERENCE_OHM:g}" for n in "pn"),
        *(f"Gi{n}_{c} 0 sum_{n}_{c} i{n}_{c} 0 {current:.6g}" for n in "pn"),
        f"Bp_{c} out_p_{c} 0 V=min(max({middle:.6g}+v(x_{c})/2,{low:g}),{high:g})",
        f"Bn_{c} out_n_{c} 0 V=min(max({middle:.6g}-v(x_{c})/2,{low:g}),{high:g})",
    ]


def circuit(front_end: FrontEnd) -> list[str]:
    """The netlist of both channels behind one signal."""
    lines = [f"* made of {front_end.file}", "Vd d 0 dc 0 ac 1"]
    lines += [f"Vcm cm 0 dc {analogue(front_end).signal['common_mode']:g}"]
    for c in CHANNELS:
        lines += [f"Ep_{c} in_p_{c} cm d 0 0.5", f"En_{c} in_n_{c} cm d 0 -0.5"]
        for part in front_end.parts:
            if part.nets:
                nets = " ".join(f"{net}_{c}" for net in part.nets)
                lines.append(f"{part.ref}_{c} {nets} {part.value:g}")
        lines += amplifier(front_end, c)
    return lines


def printed(name: str, *values: str) -> str:
    """A command that prints a row which `rows` finds."""
    return f"echo {name} {' '.join(f'$&{value}' for value in values)}"


def difference(channel: str) -> str:
    return f"let diff{channel} = v(adc_p_{channel}) - v(adc_n_{channel})"


def response(front_end: FrontEnd) -> Iterator[str]:
    """Gain, offset, phase and bandwidth of both channels, as they are now."""
    yield from ["op", *map(difference, CHANNELS), printed("offset", "diffs", "diffc")]
    for name, hz in (("low", LOW_HZ), ("high", analogue(front_end).signal["highest_hz"])):
        yield from [f"ac lin 1 {hz:g} {hz:g}", *map(difference, CHANNELS)]
        for c in CHANNELS:
            yield f"let mag{c} = mag(diff{c})"
            yield f"let phase{c} = ph(diff{c})"
        yield printed(name, "mags", "magc", "phases", "phasec")
    yield from ["ac dec 50 1k 10meg", *map(difference, CHANNELS)]
    for c in CHANNELS:
        yield f"let rel{c} = db(diff{c}) - db(diff{c}[0])"
        yield f"meas ac band{c} when rel{c}=-3.0103"
    yield printed("bandwidth", "bands", "bandc")
    yield "destroy all"


def levels(front_end: FrontEnd) -> Iterator[str]:
    """The levels at the highest signal, at each end of the scale's common mode."""
    signal = analogue(front_end).signal
    for side in (-1, 0, 1):
        common = signal["common_mode"] + side * signal["common_mode_range"]
        yield f"alter vcm dc = {common:g}"
        for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
            yield f"alter vd dc = {share * signal['highest_vpp'] / 2:g}"
            yield from ["op", "let a = v(adc_p_s)", "let b = v(adc_n_s)"]
            yield "let e = v(sum_p_s)"
            yield printed("level", "a", "b", "e")
    yield from [f"alter vcm dc = {signal['common_mode']:g}", "alter vd dc = 0", "destroy all"]


def board(front_end: FrontEnd, source: random.Random) -> Iterator[str]:
    """Draws the parts of a board."""
    for c in CHANNELS:
        for part in front_end.parts:
            if part.nets:
                drawn = part.value * (1 + source.uniform(-1, 1) * part.tolerance_pct / 100)
                yield f"alter {part.ref.lower()}_{c} = {drawn:.9g}"
        offset = source.uniform(-1, 1) * analogue(front_end).amplifier["offset"]
        yield f"alter vos_{c} dc = {offset:.6g}"


def deck(front_end: FrontEnd) -> str:
    """The whole input of ngspice."""
    its = analogue(front_end)
    source = random.Random(its.seed)
    lines = [*circuit(front_end), ".control", "set numdgt=12", "unset askquit"]
    lines += [*response(front_end), *levels(front_end)]
    lines += ["noise v(adc_p_s,adc_n_s) Vd dec 20 1 1g", printed("noise", "onoise_total")]
    for _ in range(its.boards):
        lines += [*board(front_end, source), *response(front_end)]
    return "\n".join([*lines, "quit", ".endc", ".end", ""])


def state(front_end: FrontEnd) -> str:
    """CRC-32 of the input of ngspice and of the converter's numbers: what a result belongs to."""
    text = deck(front_end) + repr(sorted(analogue(front_end).converter.items()))
    return f"{zlib.crc32(text.encode()):08X}"


def rows(front_end: FrontEnd, folder: Path) -> dict[str, list[list[float]]]:
    """{name: rows} that ngspice prints; a SpiceError if it does not end or a row is missing."""
    if reason := missing():
        raise SpiceError(reason)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{front_end.name}.cir"
    path.write_text(deck(front_end), encoding="utf-8")
    try:
        done = subprocess.run(
            ["ngspice", "-b", path], capture_output=True, text=True, timeout=PATIENCE_S
        )
    except subprocess.TimeoutExpired:
        raise SpiceError(f"ngspice did not end within {PATIENCE_S:g} s: see {path}") from None
    boards = 1 + analogue(front_end).boards
    expected = dict.fromkeys(("offset", "low", "high", "bandwidth"), boards)
    expected |= {"level": 15, "noise": 1}
    found: dict[str, list[list[float]]] = {name: [] for name in expected}
    for line in done.stdout.splitlines():
        name, _, values = line.partition(" ")
        if name in found:
            found[name].append([float(value) for value in values.split()])
    for name, count in expected.items():
        if len(found[name]) != count:
            raise SpiceError(
                f"ngspice printed {len(found[name])} rows `{name}`, not {count}: run ngspice -b "
                f"{path} and read its errors. {done.stderr.strip()[-200:]}"
            )
    return found


def covering(values: list[float]) -> float:
    """The size that most of the boards do not exceed."""
    ordered = sorted(map(abs, values))
    return ordered[math.ceil(MOST_OF_BOARDS * len(ordered)) - 1]


def result(front_end: FrontEnd, found: dict[str, list[list[float]]]) -> dict[str, float]:
    """The numbers of the check from the rows of ngspice; the first row is that of a board with all
    parts at their values.
    """
    its = analogue(front_end)
    signal, converter = its.signal, its.converter
    full, lsb = converter["reference"], 2 * converter["reference"] / 2 ** converter["bits"]
    drawn = random.Random(its.seed + 1)  # the references of the converter are not in the netlist
    spread = converter["reference_pct"] / 100
    references = [
        (1 + drawn.uniform(-spread, spread)) / (1 + drawn.uniform(-spread, spread))
        for _ in range(its.boards)
    ]
    sine, cosine = found["low"][0][:2]
    gains = [
        row[1] / row[0] * share - 1 for row, share in zip(found["low"][1:], references, strict=True)
    ]
    delays = [(row[2] - row[3]) / (2 * math.pi * signal["highest_hz"]) for row in found["high"][1:]]
    amplitude = sine * signal["nominal_vpp"] / 2
    # of full scale at its SNR, less the noise of the quantisation, which the twin makes itself
    own = full / math.sqrt(2) * 10 ** (-converter["snr_db"] / 20) / lsb
    of_converter = math.sqrt(max(0.0, own**2 - 1 / 12))
    of_amplifier = found["noise"][0][0] / lsb
    at = [a - b for a, b, _ in found["level"]]
    bent = [
        abs(high - middle - 2 * (half - middle))
        for lower, low_half, middle, half_high, upper in zip(*[iter(at)] * 5, strict=True)
        for half, high in ((low_half, lower), (half_high, upper))
    ]
    pins = [volts for row in found["level"] for volts in row[:2]]
    inputs = [row[2] for row in found["level"]]
    return {
        "gain": sine,
        "gain_cos": cosine,
        "amplitude": amplitude / full,
        "highest_amplitude": sine * signal["highest_vpp"] / 2 / full,
        "bandwidth": found["bandwidth"][0][0],
        "bandwidth_lowest": min(min(row) for row in found["bandwidth"]),
        "lag_deg": -math.degrees(found["high"][0][2]),
        "droop_pct": 100 * (1 - found["high"][0][0] / sine),
        "noise_amplifier": of_amplifier,
        "noise_converter": of_converter,
        "noise": math.hypot(of_amplifier, of_converter),
        "gain_mismatch": covering(gains),
        "gain_mismatch_worst": max(map(abs, gains)),
        "skew": covering(delays),
        "offset": covering([v / amplitude for row in found["offset"][1:] for v in row]),
        "bending": max(bent) / lsb,
        "pin_lowest": min(pins),
        "pin_highest": max(pins),
        "input_lowest": min(inputs),
        "input_highest": max(inputs),
    }


def written(front_end: FrontEnd, numbers: dict[str, float]) -> str:
    """The text of the file of results."""
    head = [
        "# SPDX-License-Identifier: Apache-2.0",
        f"# Made by `make spice` from {front_end.file}: do not edit.",
        f'state = "{state(front_end)}"',
        f"bits = {analogue(front_end).converter['bits']:g}",
    ]
    return "\n".join([*head, *(f"{name} = {value:.4g}" for name, value in numbers.items()), ""])


def main() -> None:
    front_end = front_ends.named(NAME)
    try:
        numbers = result(front_end, rows(front_end, ROOT / "build" / "spice"))
    except SpiceError as why:
        sys.exit(f"spice: {why}")
    path = RESULTS / f"{front_end.name}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(written(front_end, numbers), encoding="utf-8")
    for name, value in numbers.items():
        print(f"{name:20} {value:.4g}")
    print(f"made {path.relative_to(ROOT)}; make tables puts it into docs/front_ends.md")


if __name__ == "__main__":
    main()

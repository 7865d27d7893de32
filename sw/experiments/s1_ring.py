# SPDX-License-Identifier: Apache-2.0
"""S1: a circular grating of 8192 lines with an error of 134.59 arcsec, which a relay between the
read head and the controller corrects.

    python -m experiments.s1_ring

The experiment takes 37 readings of the simulated ring, fits them and writes the coefficients over
the UART into the Verilated relay. A second pass measures the error of the A/B signals of the relay
at angles between the readings, both for the method of the paper (3 orders) and for ours. The
results are build/report/s1_ring.html and the readings, build/report/s1_readings.csv. The paper
reduced the error from 134.59 to 12.62 arcsec.
"""

import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.console import Console
from rich.table import Table

from experiments import command, report_page, start_page
from moire.analysis import report
from moire.analysis.harmonic_fit import Harmonics, Readings, fit, read_readings
from moire.analysis.metrology import harmonics
from moire.analysis.metrology_pictures import harmonic_bars
from moire.bus.transport import BITS, Transport
from moire.client.relay import Relay, Settings, Status, make_set, terms_of
from moire.errors import BadFile, MoireError
from twin.build import ROOT, simulation
from twin.machines.ring import ARC_SECOND, RotaryRing

DRIVER, RELAY = Path(__file__).with_name("relay_serve.cpp"), ROOT / "rtl" / "relay.sv"
HARMONIC_DRIVER = Path(__file__).with_name("harmonic_run.cpp")
HARMONIC_MAP = ROOT / "rtl" / "compensate" / "harmonic_map.sv"
ORDERS = 16  # that the relay corrects
CLK_HZ, BAUD = 48_000_000, 3_000_000
SUBDIVISION = 200  # of a line, in the read head: 0.2 arcsec per count
PAPER_PEAK, PAPER_AFTER, PAPER_RESIDUAL = 134.59, 12.62, 5.79
PAPER_ORDERS = 3
# arcsec: the errors of the readings are distributed evenly within +- this value, the drift of the
# paper
SCATTER = 2.0
SCATTER_RMS = SCATTER / 3**0.5
TEN_DEGREES = np.arange(0.0, 361.0, 10.0)
DWELL_S = 15.0  # from one reading to the next
LEFT_OUT = "orders above 16, jitter of the read head"
EARLY = 400  # at power-up the ring is at rest this many counts before its index
PLACES = 180  # of the second pass
HIGH_ORDERS = slice(PAPER_ORDERS + 1, None)

Array = NDArray[np.float64]


# ------------------------------------------------------------------ the ring


def paper_ring(seed: int, **values: float) -> RotaryRing:
    """A ring with both errors of the paper: a peak of 134.59 arcsec, and 5.79 arcsec in the orders
    above the third.
    """
    values = {"ring_subdivision": SUBDIVISION, "ring_higher": 1.63, **values}
    for _ in range(3):  # the model scales the peak after the shares of the orders
        ring = RotaryRing(seed, **values)
        values["ring_higher"] *= (
            PAPER_RESIDUAL / np.abs(error_of(ring, np.arange(0, 360, 0.1), HIGH_ORDERS)).max()
        )
    return RotaryRing(seed, **values)


def error_of(ring: RotaryRing, angle: Array, orders: slice = slice(1, None)) -> Array:
    """The repeatable error in arcsec at these true angles (degrees)."""
    amplitude, phase = ring.orders()
    number = np.arange(len(amplitude))[orders]
    error: Array = (
        np.sin(np.radians(angle)[:, None] * number + phase[orders]) @ amplitude[orders] / ARC_SECOND
    )
    return error


def true_angle(ring: RotaryRing, encoder: Array, time_s: ArrayLike = 0.0) -> Array:
    """The true angles (degrees) at which the read head measures these angles (degrees)."""
    shown: Array = np.radians(encoder)
    true = shown.copy()
    for _ in range(6):
        true = shown - (ring.measured(true, time_s) - true)
    degrees: Array = np.degrees(true)
    return degrees


def measure(
    ring: RotaryRing,
    angles: Array,
    source: np.random.Generator,
    scatter: float = SCATTER,
    dwell_s: float = DWELL_S,
) -> Readings:
    """Readings at these angles of the encoder: the difference from a reference. The ring is at rest
    anywhere within the count.
    """
    encoder = angles + source.uniform(-0.5, 0.5, len(angles)) * 360 / ring.counts_per_turn
    true = true_angle(ring, encoder, dwell_s * np.arange(len(angles)))
    error = 3600 * (angles - true) + source.uniform(-scatter, scatter, len(angles))
    if jitter := ring.parameters["ring_jitter"]:
        error += jitter * source.normal(size=len(angles))
    return Readings(angles, error, np.arange(1, len(angles) + 1))


def off_grid(source: np.random.Generator, count: int) -> Array:
    """Angles (degrees) distributed evenly over the turn, none of them an angle of the readings."""
    angles: Array = (np.arange(count) + source.uniform(0.1, 0.9)) * 360 / count
    return angles


def ours(readings: Readings, orders: int = ORDERS) -> Harmonics:
    """Our fit. The noise cannot be estimated from one revolution; then it is given."""
    return fit(readings, orders=orders, noise=SCATTER_RMS if readings.revolutions < 2 else None)


def as_in_the_paper(readings: Readings) -> Harmonics:
    """The fit of the paper."""
    return fit(readings, orders=PAPER_ORDERS, weighted=False)


# ------------------------------------------------------------------ the relay


def set_of(found: Harmonics, counts_per_turn: int) -> bytes:
    """The correction set of the relay for these harmonics, of more orders if they need them."""
    orders = max(ORDERS, found.orders)
    return make_set(terms_of(found, counts_per_turn), Settings(counts_per_turn), orders)


def corrections_of(whole: bytes, counts: Iterable[float]) -> Array:
    """The counts that the Verilated harmonic_map subtracts at these counts with this set."""
    words = np.frombuffer(whole, "<u4").astype(np.int64)
    terms, turn, step = words[6:-1], int(words[1]), int(words[2] | (words[3] & 0xFFFF) << 32)
    angles = [(int(count) % turn * step >> 16) % 2**32 for count in counts]
    numbers = [words[4], len(terms) // 2, *terms, len(angles), *angles]
    done = subprocess.run(
        [simulation(HARMONIC_DRIVER, HARMONIC_MAP, K=len(terms) // 2)],
        input=" ".join(map(str, numbers)),
        capture_output=True,
        text=True,
        check=True,
    )
    return np.array(done.stdout.split(), dtype=float) / 65536


def each_left_by_map(ring: RotaryRing, found: Harmonics, angles: Array) -> Array:
    """The remaining error in arcsec at these true angles: the true error of the ring minus the
    correction by the RTL.
    """
    return left_of(error_of(ring, angles), ring.counts_per_turn, found, angles)


def left_of(error: Array, turn: int, found: Harmonics, angles: Array) -> Array:
    """What the correction by the RTL leaves of this error in arcsec at these true angles."""
    counts = np.round((angles + error / 3600) / 360 * turn)
    left = error - corrections_of(set_of(found, turn), counts) * 1_296_000 / turn
    return left - float(left.mean())


def left_by_map(ring: RotaryRing, found: Harmonics, angles: Array) -> float:
    """The largest remaining error at these true angles, in arcsec."""
    return float(np.abs(each_left_by_map(ring, found, angles)).max())


class VerilatedRelay(Transport):
    """The RTL of the relay with a ring at its input, a counter at its output and a host.

    Time passes only in send, receive and wait.
    """

    character_s = BITS * 16 / CLK_HZ
    time_is_stopped = True

    def __init__(self, counts_per_turn: int, position: int) -> None:
        program = simulation(DRIVER, RELAY, K=ORDERS, BAUD=BAUD)
        self.process = subprocess.Popen(
            [program, str(counts_per_turn), str(position)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.received: list[int] = []
        self.passed = 0.0

    @property
    def pipes(self) -> tuple[IO[str], IO[str]]:
        """Standard input and output of the simulation."""
        assert self.process.stdin and self.process.stdout
        return self.process.stdin, self.process.stdout

    def command(self, *words: str | int) -> list[int]:
        """Sends a command to the simulation and returns its answer."""
        commands, answers = self.pipes
        commands.write(" ".join(map(str, words)) + "\n")
        commands.flush()
        if not (line := answers.readline()):
            raise MoireError("the simulated relay has ended")
        return [int(word) for word in line.split()]

    def send(self, words: Sequence[int]) -> None:
        """Sends words to the relay and stores its answer."""
        self.received = self.command("words", *words)
        self.passed += (len(words) + len(self.received)) * self.character_s

    def receive(self, count: int, timeout_s: float) -> list[int]:
        """At most `count` words of the answer."""
        words, self.received = self.received[:count], self.received[count:]
        self.passed += timeout_s if len(words) < count else 0.0
        return words

    def now(self) -> float:
        """Simulated time in s."""
        return self.passed

    def wait(self, seconds: float) -> None:
        """Lets simulated time pass."""
        self.passed += seconds

    def go(self, position: int) -> list[int]:
        """Moves the ring to this count; returns [count at the output, correcting, fault]."""
        return self.command("go", int(position), 2)

    def close(self) -> None:
        """Ends the simulation."""
        commands, answers = self.pipes
        commands.close()
        self.process.wait()
        answers.close()


def left_by_relay(
    ring: RotaryRing, found: Harmonics, angles: Array, start_s: float = 0.0
) -> tuple[Array, Status]:
    """The error in arcsec at the output of the Verilated relay at these true angles of its second
    turn, and its last status.
    """
    turn, times = ring.counts_per_turn, start_s + DWELL_S * np.arange(len(angles))
    inputs = np.floor(np.degrees(ring.measured(np.radians(angles), times)) / 360 * turn).astype(int)
    with VerilatedRelay(turn, -EARLY) as pins:
        relay = Relay(pins)
        relay.write(set_of(found, turn))
        pins.go(EARLY)  # after the index the relay corrects
        counted = []
        for position in inputs:
            out, correcting, _fault = pins.go(position)
            if not correcting:
                raise MoireError("the relay does not correct")
            counted.append(out)
        status = relay.status()
    left: Array = ((np.array(counted) + 0.5) / turn * 360 - angles) * 3600
    return left - float(left.mean()), status


# ------------------------------------------------------------------ the experiment


@dataclass(frozen=True)
class Method:
    """A method of correction and the error that remains with it."""

    name: str
    found: Harmonics
    left: Array  # arcsec, at the angles of the second pass

    @property
    def peak(self) -> float:
        """The largest remaining error, in arcsec."""
        return float(np.abs(self.left).max())


def save_readings(readings: Readings, path: Path) -> None:
    """Writes the readings to a CSV file; raises BadFile."""
    lines = [
        "angle_deg,error_arcsec",
        *(
            f"{angle:g},{error:.3f}"
            for angle, error in zip(readings.angle, readings.error, strict=True)
        ),
    ]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadFile(f"{path} cannot be written: {error.strerror}") from None


def picture(readings: Readings, angles: Array, before: Array, methods: Sequence[Method]) -> bytes:
    """A picture (PNG) of the error over the turn."""
    figure, (whole, fine) = report.drawing(height=6.4, nrows=2, sharex=True)
    whole.plot(angles, before, color="#999999", linewidth=1.2, label="before")
    whole.plot(
        readings.angle,
        readings.error - readings.error.mean(),
        linestyle="",
        marker="o",
        markersize=3.5,
        color="#555555",
        label="readings",
    )
    for number, method in enumerate(methods):
        for panel in (whole, fine):
            panel.plot(
                angles,
                method.left,
                color=report.colour(number),
                linewidth=1.1,
                label=method.name if panel is whole else None,
            )
    fine.axhline(PAPER_AFTER, color="#b00020", linewidth=1.0, linestyle="--")
    fine.axhline(-PAPER_AFTER, color="#b00020", linewidth=1.0, linestyle="--")
    fine.set_title(
        f"enlarged; dashed: result of the paper, \N{PLUS-MINUS SIGN}{PAPER_AFTER}",
        fontsize="medium",
    )
    fine.set_xlabel("angle / degrees")
    for panel in (whole, fine):
        panel.set_ylabel("error / arcsec")
    report.legend(figure, whole)
    return report.png(figure)


def bars(angles: Array, before: Array, methods: Sequence[Method]) -> bytes:
    """A picture (PNG) of the harmonics before and after the correction, as many as the angles
    carry.
    """
    orders = min(ORDERS, (len(angles) - 1) // 2)
    errors = {"before": before, **{method.name: method.left for method in methods}}
    amplitudes = {name: harmonics(angles / 360, error, orders) for name, error in errors.items()}
    return harmonic_bars(amplitudes, "amplitude / arcsec", logarithmic=True)


def page(
    seed: int,
    readings: Readings,
    angles: Array,
    before: Array,
    methods: Sequence[Method],
    status: Status,
) -> str:
    """The report as HTML."""
    best, second = methods[-1], "\N{DOUBLE PRIME}"
    numbers = [
        (f"{np.abs(before).max():.2f}{second}", "largest error before"),
        (f"{best.peak:.2f}{second}", "after, our method"),
        (f"{methods[0].peak:.2f}{second}", "after, the paper's method"),
        (f"{len(angles)}", "angles of the second pass"),
    ]
    compared = [
        report.Compared(
            "largest error before", f"{PAPER_PEAK}{second}", f"{np.abs(before).max():.2f}{second}"
        )
    ]
    compared += [
        report.Compared(
            f"largest error after, {method.name}",
            f"{PAPER_AFTER}{second}",
            f"{method.peak:.2f}{second}",
            method.peak < PAPER_AFTER,
        )
        for method in methods
    ]
    rows = [
        (f"{angle:.3f}", f"{raw:+.2f}", *(f"{method.left[n]:+.2f}" for method in methods))
        for n, (angle, raw) in enumerate(zip(angles, before, strict=True))
    ]
    head = (
        "true angle / degrees",
        "before / arcsec",
        *(f"{method.name} / arcsec" for method in methods),
    )
    drawn = picture(readings, angles, before, methods)
    parts = [
        report.against_the_paper(compared, LEFT_OUT),
        "<h2>Before and after</h2>",
        report_page.picture(
            "error", "Error over the turn: angle at the output of the relay minus true angle", drawn
        ),
        report_page.picture(
            "harmonics",
            "Amplitudes of the orders of the error over the turn: eccentricity is order 1",
            bars(angles, before, methods),
        ),
        "<h2>Second pass</h2>",
        report.table(head, rows, tall=True),
    ]
    facts = {
        "seed": seed,
        "ring": f"8192 lines, subdivided {SUBDIVISION} times; it has both errors of the paper",
        "readings": f"{len(readings.angle)}, every 10 degrees, one every {DWELL_S:g} s; the "
        "encoder drifts",
        "second pass": "other angles at later times, with the same drift; the mean error is "
        "subtracted, because it depends on the setting of the zero",
        "relay": f"RTL, Verilated, {ORDERS} orders; the set {status.identity:08X} was written over "
        "its UART",
        "fit": best.found.words(),
    }
    summary = (
        "The host fits 37 readings of a simulated ring and writes the coefficients into the relay. "
        "Then the counts at the output of the relay are compared with the true angles."
    )
    title = "S1: circular grating, corrected on the fly"
    claim = (
        f"The relay reduces an error of {np.abs(before).max():.2f}{second} to "
        f"{best.peak:.2f}{second}; "
        f"the paper's real ring came from {PAPER_PEAK}{second} to {PAPER_AFTER}{second}."
    )
    return report_page.text_of(title, summary, parts, facts, numbers, claim, LEFT_OUT)


def run(
    seed: int = 1,
    places: int = PLACES,
    folder: Path = start_page.FOLDER,
    console: Console | None = None,
) -> tuple[list[Method], Path]:
    """Runs the whole experiment and returns both methods and the path of the report."""
    console = console or Console()
    source, ring = np.random.default_rng(seed), paper_ring(seed)
    console.print(
        f"[bold]S1: ring of 8192 lines, {ring.counts_per_turn} counts per turn, "
        f"relay of {ORDERS} orders[/] (seed {seed})"
    )
    taken = measure(ring, TEN_DEGREES, source, scatter=0.0)
    save_readings(taken, folder / "s1_readings.csv")
    readings = read_readings(folder / "s1_readings.csv")
    start = DWELL_S * (len(readings.angle) + 20)
    angles = off_grid(source, places)
    raw = np.degrees(ring.measured(np.radians(angles), start + DWELL_S * np.arange(places)))
    before: Array = 3600 * (raw - angles)
    before -= before.mean()
    methods = []
    for name, found in (
        (f"the paper's method, {PAPER_ORDERS} orders", as_in_the_paper(readings)),
        (f"ours, {ORDERS} orders", ours(readings)),
    ):
        with console.status(f"{name}: simulating the relay"):
            left, status = left_by_relay(ring, found, angles, start)
        methods.append(Method(name, found, left))
    made = Table(
        "",
        "largest error / arcsec",
        title=f"second pass, {places} angles between those of the readings",
    )
    made.columns[1].justify = "right"
    for name, value in (
        ("before", np.abs(before).max()),
        *((method.name, method.peak) for method in methods),
        ("the paper", PAPER_AFTER),
    ):
        made.add_row(name, f"{value:.2f}")
    console.print(made)
    text = page(seed, readings, angles, before, methods, status)
    path = start_page.publish("s1_ring", text, folder)
    console.print(f"report with picture: {path}", soft_wrap=True)
    return methods, path


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment from the command line and returns the exit code."""
    parser = command.parser_of(
        "s1_ring",
        "The ring of S1: it is read, fitted, corrected and measured again.",
        "its readings",
    )
    command.add_number(parser, "--places", "angles of the second pass", PLACES, least=8)
    asked = parser.parse_args(arguments)
    return command.exit_code("s1_ring", lambda: run(asked.seed, asked.places, asked.report))


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""The commands about the relay of a ring: relay status, clear, calibrate."""

from typing import Any

import click

from moire.analysis import report
from moire.cli.files import write_bytes
from moire.cli.parser import Group, moire
from moire.cli.session import Call
from moire.cli.values import FILE, NUMBER, POSITIVE, WHOLE
from moire.client.relay import Relay, Settings, make_set, terms_of
from moire.client.values import CHOICES
from moire.errors import OutOfRange

PLAIN = Settings(counts_per_turn=0)  # for the defaults
# (mask, levels) of B and A, by the words of an axis: any, both_low, a_high, both_high, b_high
GATES = dict(zip(CHOICES["index_gate"], ((0, 0), (3, 0), (3, 1), (3, 3), (3, 2)), strict=True))

group = Group(
    "relay",
    help="Show, clear and calibrate the relay of a ring (S1).",
    example="moire --port /dev/ttyUSB0 relay status",
)
moire.add_command(group)


@group.command(
    "status",
    help="Show the state and the flags of the relay.",
    example="moire --port /dev/ttyUSB0 relay status",
)
def status(call: Call) -> None:
    """One read-back."""
    say_status(call, Relay(call.bus.transport).status())


@group.command(
    "clear",
    help="Clear all flags of the relay.",
    example="moire --port /dev/ttyUSB0 relay clear",
)
def clear(call: Call) -> None:
    """A flag whose cause is still present comes back."""
    say_status(call, Relay(call.bus.transport).clear())


@group.command(
    "calibrate",
    help="Fit harmonics to a table of readings, write them to the relay and save them in its "
    "flash.",
    example="moire --port /dev/ttyUSB0 relay calibrate ring.csv --counts 32768 --picture ring.png",
)
@click.argument(
    "file",
    type=FILE,
    metavar="FILE",
    help="CSV: the angle in degrees, and the error (encoder minus reference) in arcsec.",
)
@click.option(
    "--counts",
    type=POSITIVE,
    required=True,
    metavar="N",
    help="The counts per turn, four per line of the ring.",
)
@click.option(
    "--orders",
    type=POSITIVE,
    metavar="K",
    help="The number of harmonics. The default is as many as the readings and the relay allow.",
)
@click.option(
    "--noise",
    type=NUMBER,
    metavar="ARCSEC",
    help="The rms noise of one reading. Without it the noise is estimated.",
)
@click.option(
    "--index-at",
    type=NUMBER,
    default=0.0,
    metavar="DEGREES",
    help="The angle of the reference at the index of the ring. The default is 0.",
)
@click.option(
    "--hysteresis",
    type=NUMBER,
    default=PLAIN.hysteresis,
    metavar="COUNTS",
    help=f"How far the angle turns back before the output does. The default is {PLAIN.hysteresis}.",
)
@click.option(
    "--filter",
    "filter_samples",
    type=WHOLE,
    default=PLAIN.filter_samples,
    metavar="SAMPLES",
    help="For how many samples a level of A, B or Z must last. The default is 0, no filter.",
)
@click.option(
    "--edge-separation",
    type=WHOLE,
    default=PLAIN.minimum_edge_separation,
    metavar="CYCLES",
    help="The least time between two edges of the output, in cycles of its clock. The default is "
    f"{PLAIN.minimum_edge_separation}.",
)
@click.option(
    "--index-gate",
    type=click.Choice(list(GATES)),
    default="any",
    help="The levels of A and B at which the index counts. The default is any.",
)
@click.option("--index-low", is_flag=True, help="The index is active low.")
@click.option(
    "--picture", type=FILE, metavar="FILE", help="Draw the error before and after, as PNG."
)
@click.option("--dry", is_flag=True, help="Only fit and draw; write nothing to the relay.")
@click.option(
    "--no-flash",
    is_flag=True,
    help="Put the harmonics in force, but do not save them for the next power-up.",
)
def calibrate(
    call: Call,
    file: str,
    counts: int,
    orders: int | None,
    noise: float | None,
    index_at: float,
    hysteresis: float,
    filter_samples: int,
    edge_separation: int,
    index_gate: str,
    index_low: bool,
    picture: str | None,
    dry: bool,
    no_flash: bool,
) -> None:
    """A table that cannot be read leaves the relay as it is."""
    from moire.analysis.harmonic_fit import fit, read_readings  # NumPy only where it is needed

    readings = read_readings(file)
    mask, levels = GATES[index_gate]
    settings = Settings(
        counts, edge_separation, hysteresis, filter_samples, index_low, mask, levels
    )
    relay = None if dry else Relay(call.bus.transport)
    built = relay.status().orders if relay else 0
    if relay and not built:
        raise OutOfRange(
            "this relay corrects by a table of segments, not by harmonics: make_segment_set of "
            "moire.client.relay makes its set"
        )
    if orders is None and relay:
        orders = min(readings.most_orders, built)
    found = fit(readings, orders=orders, noise=noise)
    if picture:
        write_bytes(picture, draw(readings, found))
    written = "nothing written"
    if relay:
        terms = terms_of(found, counts, index_at)
        whole = make_set(terms, settings, built)
        relay.write(whole)
        written = "in force"
        if not no_flash:
            relay.save(whole)
            written = "in force, and saved in flash"
    call.say(
        {
            "orders": found.orders,
            "before": found.before,
            "left": found.left,
            "noise": found.noise,
            "written": written,
        },
        f"{found.words()}\n{written}",
    )


def say_status(call: Call, state: Any) -> None:
    """Print the state of the relay."""
    call.say({**state._asdict(), "identity": f"{state.identity:08X}"}, state.words())


def draw(readings: Any, found: Any) -> bytes:
    """The readings before and after the correction, and the correction."""
    figure, (before, after) = report.drawing(height=6.0, nrows=2, sharex=True)
    halves = int(2 * (readings.angle[-1] - readings.angle[0])) + 1
    fine = [readings.angle[0] + n * 0.5 for n in range(halves)]
    error = readings.error - found.constant
    points: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 3.5}
    before.plot(fine, found.at(fine), color=report.colour(0), linewidth=1.2, label="correction")
    before.plot(readings.angle, error, color="#555555", label="readings", **points)
    left = error - found.at(readings.angle)
    after.plot(readings.angle, left, color=report.colour(1), label="remaining error", **points)
    after.set_xlabel("angle / degrees")
    for panel in (before, after):
        panel.set_ylabel("error / arcsec")
    report.legend(figure, before)
    image: bytes = report.png(figure)
    return image

# SPDX-License-Identifier: Apache-2.0
"""The recorder of ticks of a node: signals of one axis at each servo tick, evenly spaced, and an
excitation that is added to the commands of an axis.

    scope = TickScope(axis)
    scope.start(("error", "command"), samples=4096)
    axis.move("1mm")
    record = scope.read()
    Path("move.csv").write_text(record.csv())

Sample n of every signal belongs to the same tick: the position was taken at that tick, and the
command was computed from it. The node needs SCOPE_WORDS of rtl/node.sv; `moire.analysis.scope` is
for the others.
"""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction

import numpy
from numpy.typing import ArrayLike, NDArray

from moire import units
from moire.analysis import report
from moire.client.access import COUNTS, FULL_SCALE
from moire.client.axis import Axis
from moire.client.names import code_name
from moire.errors import MoireError, OutOfRange
from moire.made.bus_tables import OPERATIONS, SCOPE_STATES, TICK_SIGNALS, WAVEFORM_LONGEST
from moire.made.registers import FIELDS

Array = NDArray[numpy.float64]

SIGNALS = {name: bit for bit, (name, _) in TICK_SIGNALS.items()}
LONGEST_EVERY = 0xFFFF  # ticks from sample to sample
WORDS_AT_ONCE = sum(field.startswith("word_") for field, _ in OPERATIONS["read_ticks"].reply)
VALUES_AT_ONCE = sum(
    field.startswith("value_") for field, _ in OPERATIONS["load_excitation"].request
)
NODE_FIELDS = {f"{f.register}.{f.field}": f for f in FIELDS if f.block == "node"}


class NotRecorded(MoireError):
    """The recorder is not built, or the recording did not come to its end; the text says why."""


@dataclass(frozen=True)
class TickRecord:
    """Signals at equally spaced ticks; each array has one value for each sample, in LSB."""

    every: int  # ticks from sample to sample
    tick_s: float
    period_nm: float
    values: Mapping[str, Array]  # by name of SIGNALS; sine_cosine is split into sine and cosine

    @property
    def time_s(self) -> Array:
        """The time of each sample since the first one."""
        count = len(next(iter(self.values.values())))
        return numpy.asarray(numpy.arange(count) * self.every * self.tick_s, float)

    def columns(self) -> dict[str, Array]:
        """The signals in the units that their names state, after the time."""
        nm = self.period_nm / COUNTS
        scales = {
            "sine": ("sine_counts", 1.0),
            "cosine": ("cosine_counts", 1.0),
            "target": ("target_nm", nm),
            "target_velocity": ("target_velocity_nm_per_s", nm / self.tick_s),
            "velocity": ("velocity_nm_per_s", nm / self.tick_s),
            "error": ("error_nm", nm),
            "position": ("position_nm", nm),
            "command": ("command_of_full_scale", 1 / FULL_SCALE),
        }
        named = {"time_s": self.time_s}
        for name, values in self.values.items():
            column, scale = scales[name]
            named[column] = numpy.asarray(values * scale, float)
        return named

    def csv(self) -> str:
        """The record as CSV, with a heading that names the units."""
        columns = self.columns()
        rows = [",".join(columns)]
        rows += [",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values())]
        return "\n".join(rows) + "\n"

    def parquet(self) -> bytes:
        """The record as Parquet, with the columns of the CSV; needs the package pyarrow."""
        try:
            import pyarrow
            from pyarrow import parquet
        except ImportError:
            raise MoireError(
                "the package pyarrow is missing, Parquet needs it: pip install pyarrow"
            ) from None
        out = io.BytesIO()
        parquet.write_table(pyarrow.table(self.columns()), out)
        return out.getvalue()

    def picture(self) -> bytes:
        """The signals over time, as PNG."""
        columns = self.columns()
        time_ms = columns.pop("time_s") * 1e3
        figure, panels = report.drawing(
            height=1.0 + 1.6 * len(columns), nrows=len(columns), sharex=True
        )
        for number, (panel, (name, values)) in enumerate(zip(panels, columns.items(), strict=True)):
            panel.plot(time_ms, values, color=report.colour(number), linewidth=1.0)
            panel.set_ylabel(name.replace("_", " "))
        panels[-1].set_xlabel("time / ms")
        return report.png(figure)


def signed(words: ArrayLike, bits: int) -> Array:
    """Unsigned words as numbers in two's complement."""
    whole = numpy.asarray(words, numpy.int64)
    return numpy.asarray((whole + (1 << bits - 1)) % (1 << bits) - (1 << bits - 1), float)


def unwrapped(low_words: ArrayLike, near: int) -> Array:
    """Whole positions from their low words, of which the last one is next to `near`."""
    low = signed(low_words, 32)
    steps = (numpy.diff(low) + (1 << 31)) % (1 << 32) - (1 << 31)
    path = numpy.concatenate([[0.0], numpy.cumsum(steps)])
    last = near + (low[-1] - near + (1 << 31)) % (1 << 32) - (1 << 31)
    return numpy.asarray(path - path[-1] + last, float)


@dataclass(frozen=True)
class Setting:
    """What a recording has."""

    axis: int
    signals: tuple[str, ...]  # of SIGNALS, in their order
    samples: int
    every: int  # ticks from sample to sample

    @property
    def words(self) -> int:
        """Words of the recording."""
        return self.samples * len(self.signals)


class TickScope:
    """The recorder of ticks of the node of an axis."""

    def __init__(self, axis: Axis):
        self.axis, self.node = axis, axis.node

    @property
    def nothing(self) -> str:
        """Why there is nothing to read."""
        return f"node {self.node.address} has no recording: begin one with `moire scope record`"

    def field(self, name: str) -> int:
        """A field of the node's registers, by register and field with a dot."""
        field = NODE_FIELDS[name]
        return field.value(self.node.read_register(field.address()))

    def setting(self) -> Setting:
        """The setting of the last recording, whoever began it."""
        chosen = self.field("scope.signals")
        return Setting(
            self.field("scope.axis"),
            tuple(name for name, bit in SIGNALS.items() if chosen >> bit & 1),
            self.field("scope_samples.length"),
            max(1, self.field("scope_samples.every")),
        )

    def words(self) -> int:
        """The size of the recorder's memory in words; 0: there is no recorder."""
        return self.field("build.scope") * int(NODE_FIELDS["build.scope"].lsb)

    def longest(self, signals: Sequence[str]) -> int:
        """The most samples of these signals that one recording can have; raises NotRecorded."""
        words = self.words()
        if words == 0:
            raise NotRecorded(
                f"node {self.node.address} has no recorder of ticks: build it with SCOPE_WORDS of "
                "rtl/node.sv, or use `moire scope arm`"
            )
        return words // len(signals)

    def start(
        self, signals: Sequence[str], samples: int | None = None, every: units.Value | None = None
    ) -> None:
        """Begins a recording of these SIGNALS; raises OutOfRange or NotRecorded.

        `samples` is None for as many as fit. `every` (s, or a text) is rounded to servo ticks, and
        None is each tick.
        """
        if unknown := [name for name in signals if name not in SIGNALS]:
            raise OutOfRange(
                f"there is no signal '{unknown[0]}' to record: there are {', '.join(SIGNALS)}"
            )
        chosen = tuple(name for name in SIGNALS if name in signals)
        if not chosen:
            raise OutOfRange(f"name a signal to record: {', '.join(SIGNALS)}")
        tick_hz = self.node.identity.tick_hz
        ticks = 1 if every is None else round(units.parse_time(every) * tick_hz)
        if not 1 <= ticks <= LONGEST_EVERY:
            raise OutOfRange(
                f"samples come every {units.format_time(Fraction(1, tick_hz))} to "
                f"{units.format_time(Fraction(LONGEST_EVERY, tick_hz))}"
            )
        most = self.longest(chosen)
        count = most if samples is None else samples
        if not 1 <= count <= most:
            raise OutOfRange(
                f"{count} samples of {len(chosen)} signals do not fit: from 1 to {most}"
            )
        self.axis.request(
            "record_ticks",
            signals=sum(1 << SIGNALS[name] for name in chosen),
            every=ticks,
            samples=count,
        )

    def state(self) -> str:
        """Whether it is "recording", "full" or "empty"; of a full one it passes words."""
        return code_name(SCOPE_STATES, self.node.request("read_ticks")["state"], "state")

    def read(self, progress: Callable[[int], object] = lambda done: None) -> TickRecord:
        """The recording, as soon as it is complete; raises NotRecorded.

        `progress` gets the number of words read so far. It sends requests often enough for the
        watchdog.
        """
        transport, setting = self.axis.transport, self.setting()
        if setting.axis != self.axis.number:
            raise NotRecorded(
                f"the recording of node {self.node.address} is of axis {setting.axis}, not of axis "
                f"{self.axis.number}"
            )
        if setting.words == 0:
            raise NotRecorded(self.nothing)
        tick_s = 1 / self.node.identity.tick_hz
        end = transport.now() + setting.samples * setting.every * tick_s * 2 + 2.0
        total = setting.words
        words: list[int] = []
        while len(words) < total:
            reply = self.node.request("read_ticks")
            state = code_name(SCOPE_STATES, reply["state"], "state")
            if state == "empty":
                raise NotRecorded(self.nothing)
            if state == "full":
                if reply["first"] != len(words) % (1 << 16):
                    raise NotRecorded(
                        "another client has read the recording at the same time: record again"
                    )
                words += [reply[f"word_{n}"] for n in range(WORDS_AT_ONCE)]
                progress(min(len(words), total))
                continue
            if transport.now() > end:
                raise NotRecorded(
                    f"the recording of node {self.node.address} did not come to its end: does its "
                    "servo run?"
                )
            self.node.bus.until_next_poll(self.node)
        rows = numpy.array(words[:total], numpy.int64).reshape(setting.samples, -1).T
        values: dict[str, Array] = {}
        for name, row in zip(setting.signals, rows, strict=True):
            if name == "sine_cosine":
                values["sine"], values["cosine"] = signed(row & 0xFFFF, 16), signed(row >> 16, 16)
            elif name == "target":
                near = self.node.request("position", axis=self.axis.number)["position"]
                values[name] = unwrapped(row, near)
            else:
                values[name] = signed(row, 16 if name == "command" else 32)
        if "target" in values and "error" in values:
            values["position"] = values["target"] - values["error"]
        return TickRecord(setting.every, tick_s, float(self.axis.period_nm), values)

    # the excitation

    def load(self, waveform: ArrayLike) -> int:
        """Loads the values of an excitation, full scale 2^15, one for each tick; returns how many.

        Raises OutOfRange.
        """
        values = numpy.asarray(waveform)
        if not 1 <= values.size <= WAVEFORM_LONGEST or numpy.abs(values).max() >= FULL_SCALE:
            raise OutOfRange(f"an excitation has 1 to {WAVEFORM_LONGEST} values below {FULL_SCALE}")
        whole = [int(value) for value in values]
        for first in range(0, len(whole), VALUES_AT_ONCE):
            part = whole[first : first + VALUES_AT_ONCE]
            part += [0] * (VALUES_AT_ONCE - len(part))
            fields = {f"value_{n}": value for n, value in enumerate(part)}
            self.node.request("load_excitation", first=first, **fields)
        return len(whole)

    @contextmanager
    def excited(self, period: int) -> Iterator[None]:
        """Adds the loaded waveform to the commands of the axis as long as the block lasts.

        The drive must be on; a request to the axis to move or stop ends the excitation, too.
        """
        self.axis.request("excite", period=period)
        try:
            yield
        finally:
            self.axis.request("excite", period=0)

# SPDX-License-Identifier: Apache-2.0
"""The recorder of ticks of a node: up to 8 signals of its axes at each servo tick, evenly spaced,
from before a trigger on or without end, and an excitation that is added to the commands of an axis.

    scope = TickScope(axis)
    scope.start(("error", "command"), 4096, trigger=Trigger("beyond", "error", "1um", earlier=400))
    axis.move("1mm")
    record = scope.read()
    Path("move.csv").write_text(record.csv())

    for record in scope.stream(("error", "command"), every="1ms", duration="10s"): ...

A signal is one of the axis, as "error", or of another axis of its node, as "1.error" of axis 1.
Sample n of every signal belongs to the same tick: the position was taken at that tick, and the
command was computed from it. The node needs SCOPE_WORDS of rtl/node.sv; `moire.analysis.scope` is
for the others.
"""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy
from numpy.typing import ArrayLike, NDArray

from moire import units
from moire.analysis import report
from moire.client.access import COUNTS, FULL_SCALE
from moire.client.axis import Axis
from moire.client.names import code_name
from moire.errors import MoireError, OutOfRange
from moire.made.bus_tables import (
    FAULTS,
    OPERATIONS,
    SCOPE_STATES,
    TICK_SIGNALS,
    TICK_TRIGGERS,
    WAVEFORM_LONGEST,
)
from moire.made.registers import FIELDS

Array = NDArray[numpy.float64]

SIGNALS = {name: code for code, (name, _) in TICK_SIGNALS.items()}
TRIGGERS = {name: code for code, (name, _) in TICK_TRIGGERS.items()}
LENGTHS = ("target", "error", "position")  # signals by what they are
SPEEDS = ("target_velocity", "velocity")
SHARES = {"command": FULL_SCALE, "fine_command": FULL_SCALE, "integral": FULL_SCALE << 16}
LONGEST_EVERY = 0xFFFF  # ticks from sample to sample
LONGEST_DELAY = 0xFFFF  # ticks from the trigger to the first sample
LATE_S = 2.0  # of the node: a recording that lasts so much longer than it should has no servo
TRIGGER_S = 10.0  # of the node: the longest wait for a trigger
WORDS_AT_ONCE = sum(field.startswith("word_") for field, _ in OPERATIONS["read_ticks"].reply)
VALUES_AT_ONCE = sum(
    field.startswith("value_") for field, _ in OPERATIONS["load_excitation"].request
)
CHANNELS = sum(field.startswith("channel_") for field, _ in OPERATIONS["record_ticks"].request)
AXIS_AT = 4  # bit of a channel, above the number of its signal
NODE_FIELDS = {f"{f.register}.{f.field}": f for f in FIELDS if f.block == "node"}
TIME_STAMP = NODE_FIELDS["time_stamp.value"].address()
STREAM_SAMPLES = 256  # of a record of a stream, at most about so many
STREAM_POLL_S = 0.005  # where no sample has come


class NotRecorded(MoireError):
    """The recorder is not built, or the recording did not come to its end; the text says why."""


@dataclass(frozen=True)
class TickRecord:
    """Signals at equally spaced ticks; each array has one value for each sample, in LSB."""

    every: int  # ticks from sample to sample
    tick_s: float
    period_nm: Mapping[str, float]  # by what is before the names of the signals of an axis
    values: Mapping[str, Array]  # by name of signal; sine_cosine is split into sine and cosine
    first: int = 0  # samples from the trigger to the first one

    @property
    def time_s(self) -> Array:
        """The time of each sample since the trigger."""
        count = len(next(iter(self.values.values())))
        return numpy.asarray((self.first + numpy.arange(count)) * self.every * self.tick_s, float)

    def columns(self) -> dict[str, Array]:
        """The signals in the units that their names state, after the time."""
        named = {"time_s": self.time_s}
        for name, values in self.values.items():
            axis, _, signal = name.rpartition(".")
            column, scale = self.unit(signal, self.period_nm[axis] / COUNTS)
            named[f"axis_{axis}_{column}" if axis else column] = numpy.asarray(values * scale)
        return named

    def unit(self, signal: str, nm: float) -> tuple[str, float]:
        """The name of a signal with its unit, and its LSB in it; `nm` is that of a position."""
        return {
            "sine": ("sine_counts", 1.0),
            "cosine": ("cosine_counts", 1.0),
            "target": ("target_nm", nm),
            "target_velocity": ("target_velocity_nm_per_s", nm / self.tick_s),
            "velocity": ("velocity_nm_per_s", nm / self.tick_s),
            "error": ("error_nm", nm),
            "position": ("position_nm", nm),
            "command": ("command_of_full_scale", 1 / FULL_SCALE),
            "integral": ("integral_of_full_scale", 1 / SHARES["integral"]),
            "phase": ("phase_periods", 1 / COUNTS),
            "fine_command": ("fine_command_of_full_scale", 1 / FULL_SCALE),
            "faults": ("faults_bits", 1.0),
        }[signal]

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


def joined(records: Sequence[TickRecord]) -> TickRecord:
    """Records that follow one another as one."""
    values = {
        name: numpy.concatenate([one.values[name] for one in records]) for name in records[0].values
    }
    return replace(records[0], values=values)


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
class Trigger:
    """When a recording begins."""

    kind: str = "now"  # of TRIGGERS
    signal: str = "error"  # of SIGNALS
    level: units.Value | None = None  # with a unit that fits the signal; None: 0, or any fault
    earlier: int = 0  # samples from before the trigger, where there is no delay
    delay: int = 0  # ticks from the trigger to the first sample

    def counts(self, period_nm: Fraction, tick_hz: int) -> int:
        """The level in LSB of the signal; raises UnitError or OutOfRange."""
        if self.kind not in TRIGGERS:
            raise OutOfRange(f"there is no trigger '{self.kind}': there are {', '.join(TRIGGERS)}")
        if self.signal not in SIGNALS:
            raise OutOfRange(
                f"there is no signal '{self.signal}' to trigger: there are {', '.join(SIGNALS)}"
            )
        lsb_nm = period_nm / COUNTS
        if self.level is None:
            level = Fraction((1 << len(FAULTS)) - 1 if self.kind == "bits" else 0)
        elif self.signal in LENGTHS:
            level = units.parse_length(self.level) / lsb_nm
        elif self.signal in SPEEDS:
            level = units.parse_speed(self.level) * 1_000_000 / lsb_nm / tick_hz
        elif self.signal in SHARES:
            level = units.parse_signed_share(self.level) * SHARES[self.signal]
        else:
            level = units.parse_number(self.level)
        if abs(level) >= 1 << 31:
            raise OutOfRange(f"the level of the trigger is too large for '{self.signal}'")
        return round(level)


NOW = Trigger()


class Channel(NamedTuple):
    """A signal of an axis."""

    signal: str  # of SIGNALS
    axis: int  # its number

    @property
    def code(self) -> int:
        """The channel as the node has it."""
        return SIGNALS[self.signal] | self.axis << AXIS_AT


@dataclass(frozen=True)
class Setting:
    """What a recording has."""

    axis: int  # of the trigger
    channels: tuple[Channel, ...]  # in the order of their words
    samples: int  # 0: no end
    every: int  # ticks from sample to sample
    earlier: int = 0  # samples from before the trigger
    delay: int = 0  # ticks from the trigger to the first sample

    @property
    def words(self) -> int:
        """Words of the recording."""
        return self.samples * len(self.channels)

    @property
    def signals(self) -> tuple[str, ...]:
        """The names of the signals, with the axis before those of another one."""
        return tuple(
            one.signal if one.axis == self.axis else f"{one.axis}.{one.signal}"
            for one in self.channels
        )


class TickScope:
    """The recorder of ticks of the node of an axis."""

    def __init__(self, axis: Axis):
        self.axis, self.node = axis, axis.node
        self.tick_hz = axis.node.identity.tick_hz
        self.tick_s = 1 / self.tick_hz

    @property
    def nothing(self) -> str:
        """Why there is nothing to read."""
        return f"node {self.node.address} has no recording: begin one with `moire scope record`"

    def field(self, name: str) -> int:
        """A field of the node's registers, by register and field with a dot."""
        field = NODE_FIELDS[name]
        return int(field.value(self.node.read_register(field.address())))

    def setting(self) -> Setting:
        """The setting of the last recording, whoever began it."""
        words = [self.field(f"scope_channels_{first}.value") for first in (0, 4)]
        codes = b"".join(word.to_bytes(4, "little") for word in words)
        return Setting(
            self.field("scope.axis"),
            tuple(
                Channel(code_name(TICK_SIGNALS, code % (1 << AXIS_AT), "signal"), code >> AXIS_AT)
                for code in codes[: self.field("scope.last") + 1]
            ),
            self.field("scope_samples.length"),
            max(1, self.field("scope_samples.every")),
            self.field("scope_place.earlier"),
            self.field("scope_place.delay"),
        )

    def words(self) -> int:
        """The size of the recorder's memory in words; 0: there is no recorder."""
        return self.field("build.scope") * int(NODE_FIELDS["build.scope"].lsb)

    def longest(self, signals: Sequence[object]) -> int:
        """The most samples of these signals that one recording can have; raises NotRecorded."""
        words = self.words()
        if words == 0:
            raise NotRecorded(
                f"node {self.node.address} has no recorder of ticks: build it with SCOPE_WORDS of "
                "rtl/node.sv, or use `moire scope arm`"
            )
        return words // len(signals)

    def start(
        self,
        signals: Sequence[str],
        samples: int | None = None,
        every: units.Value | None = None,
        trigger: Trigger = NOW,
    ) -> None:
        """Begins a recording of these signals at a trigger; raises OutOfRange or NotRecorded.

        The trigger looks at a signal of the axis of this scope. `samples` is None for as many
        as fit. `every` (s, or a text) is rounded to servo ticks, and None is each tick.
        """
        chosen, ticks = self.chosen(signals), self.ticks(every)
        most = self.longest(chosen)
        count = most if samples is None else samples
        if not 1 <= count <= most:
            raise OutOfRange(
                f"{count} samples of {len(chosen)} signals do not fit: from 1 to {most}"
            )
        if not 0 <= trigger.earlier < count or not 0 <= trigger.delay <= LONGEST_DELAY:
            raise OutOfRange(
                f"{trigger.earlier} samples before the trigger, or {trigger.delay} ticks after "
                f"it: from 0 to {count - 1}, or to {LONGEST_DELAY}"
            )
        self.request(chosen, ticks, count, trigger)

    def chosen(self, signals: Sequence[str]) -> tuple[Channel, ...]:
        """These signals as channels, each one once; raises OutOfRange, or Refused for an axis that
        the node does not have.
        """
        found = tuple(dict.fromkeys(self.channel(name) for name in signals))
        if not 1 <= len(found) <= CHANNELS:
            raise OutOfRange(
                f"a recording has 1 to {CHANNELS} signals, not {len(found)}: "
                f"there are {', '.join(SIGNALS)}"
            )
        return found

    def channel(self, name: str) -> Channel:
        """The channel of a signal, as "error" or "1.error"; raises OutOfRange or Refused."""
        axis, dot, signal = name.rpartition(".")
        if signal not in SIGNALS:
            raise OutOfRange(
                f"there is no signal '{signal}' to record: there are {', '.join(SIGNALS)}"
            )
        if not dot:
            return Channel(signal, self.axis.number)
        if not axis.isdecimal():
            raise OutOfRange(f"'{axis}' of '{name}' is no number of an axis: write 1.{signal}")
        return Channel(signal, self.node.axis(int(axis)).number)

    def ticks(self, every: units.Value | None) -> int:
        """Servo ticks from sample to sample; raises OutOfRange."""
        ticks = 1 if every is None else round(units.parse_time(every) * self.tick_hz)
        if not 1 <= ticks <= LONGEST_EVERY:
            raise OutOfRange(
                f"samples come every {units.format_time(Fraction(1, self.tick_hz))} to "
                f"{units.format_time(Fraction(LONGEST_EVERY, self.tick_hz))}"
            )
        return ticks

    def request(
        self, chosen: Sequence[Channel], ticks: int, samples: int, trigger: Trigger
    ) -> None:
        """Sends the request to record."""
        level = trigger.counts(self.axis.period_nm, self.tick_hz)
        self.axis.request(
            "record_ticks",
            last=len(chosen) - 1,
            **{f"channel_{n}": chosen[n].code if n < len(chosen) else 0 for n in range(CHANNELS)},
            trigger=SIGNALS[trigger.signal],
            mode=TRIGGERS[trigger.kind],
            every=ticks,
            samples=samples,
            earlier=trigger.earlier,
            delay=trigger.delay,
            level=level,
        )

    def progress(self) -> tuple[str, int]:
        """Whether it is "empty", "waiting" for its trigger, "recording" or "full", and the number
        of words that can be read. It reads none of them.
        """
        name = code_name(SCOPE_STATES, self.field("scope_state.phase"), "state")
        return name, self.field("scope_state.available")

    def state(self) -> str:
        """Whether it is "empty", "waiting" for its trigger, "recording" or "full"."""
        return self.progress()[0]

    def now_s(self) -> float:
        """The time of the node since its reset, however fast it runs."""
        low, high = (self.node.read_register(TIME_STAMP + at) for at in (0, 4))
        return (high << 32 | low) / self.node.identity.clk_hz

    def wait(self, timeout: units.Value = TRIGGER_S) -> Setting:
        """Returns the setting of the recording when it is complete; raises NotRecorded.

        `timeout` is how long it waits for the trigger, in the time of the node. It sends requests
        often enough for the watchdog.
        """
        setting = self.setting()
        if setting.axis != self.axis.number:
            raise NotRecorded(
                f"the recording of node {self.node.address} was begun for axis {setting.axis}, "
                f"not for axis {self.axis.number}"
            )
        ticks = setting.samples * setting.every + setting.delay
        begun, lasts_s = self.now_s(), ticks / self.tick_hz
        waited_s = float(units.parse_time(timeout))
        while (state := self.state()) != "full":
            if state == "empty":
                raise NotRecorded(self.nothing)
            elapsed = self.now_s() - begun
            if state == "waiting" and elapsed > waited_s + setting.delay * self.tick_s:
                raise NotRecorded(
                    f"the recording of node {self.node.address} was not triggered within "
                    f"{units.format_time(units.parse_time(timeout))}"
                )
            if elapsed > waited_s + lasts_s + LATE_S:
                raise NotRecorded(
                    f"the recording of node {self.node.address} did not come to its end: does its "
                    "servo run?"
                )
            self.node.bus.until_next_poll(self.node)
        return setting

    def read(
        self,
        progress: Callable[[int], object] = lambda done: None,
        timeout: units.Value = TRIGGER_S,
    ) -> TickRecord:
        """The recording, as soon as it is complete; raises NotRecorded.

        `progress` gets the number of words read so far; `timeout` is that of wait().
        """
        setting = self.wait(timeout)
        words: list[int] = []
        while len(words) < setting.words:
            words += self.some_words(len(words))
            progress(len(words))
        first = -setting.earlier + round(setting.delay / setting.every)
        return self.record_of(setting, words, first)

    def some_words(self, first: int) -> list[int]:
        """The next words of the recording, of which so many have been read; raises NotRecorded."""
        reply = self.node.request("read_ticks")
        if reply["first"] != first % (1 << 16):
            raise NotRecorded(
                "another client has read the recording at the same time: record again"
            )
        return [reply[f"word_{n}"] for n in range(reply["count"])]

    def record_of(self, setting: Setting, words: Sequence[int], first: int) -> TickRecord:
        """The signals of whole samples of words."""
        rows = numpy.array(words, numpy.int64).reshape(-1, len(setting.channels)).T
        values: dict[str, Array] = {}
        periods: dict[str, float] = {}
        for (name, axis), whole, row in zip(setting.channels, setting.signals, rows, strict=True):
            before = whole.removesuffix(name)
            periods[before.rstrip(".")] = float(self.node.axis(axis).period_nm)
            if name == "sine_cosine":
                values[f"{before}sine"] = signed(row & 0xFFFF, 16)
                values[f"{before}cosine"] = signed(row >> 16, 16)
            elif name in ("target", "position"):
                near = self.node.request("position", axis=axis)["position"]
                values[whole] = unwrapped(row, near)
            elif name in ("phase", "faults"):
                values[whole] = numpy.asarray(row, float)
            else:
                values[whole] = signed(row, 16 if name == "command" else 32)
        for before in (f"{axis}." if axis else "" for axis in periods):
            target, error, position = (
                f"{before}{name}" for name in ("target", "error", "position")
            )
            if target in values and error in values and position not in values:
                values[position] = values[target] - values[error]
        return TickRecord(setting.every, self.tick_s, periods, values, first)

    def stream(
        self,
        signals: Sequence[str],
        every: units.Value | None = None,
        duration: units.Value | None = None,
    ) -> Iterator[TickRecord]:
        """The signals without a gap, in records that follow one another: for a duration, or as long
        as anybody takes them.

        Raises OutOfRange, and NotRecorded once the memory of the node is full because the samples
        are not taken as fast as they come.
        """
        chosen, ticks = self.chosen(signals), self.ticks(every)
        self.longest(chosen)  # there is a recorder
        left = (
            None if duration is None else round(units.parse_time(duration) / ticks * self.tick_hz)
        )
        setting = Setting(self.axis.number, chosen, 0, ticks)
        self.request(chosen, ticks, 0, NOW)
        words: list[int] = []
        passed = given = 0
        while left is None or given < left:
            some = self.some_words(passed)
            passed += len(some)
            words += some
            whole = len(words) // len(chosen)
            if left is not None:
                whole = min(whole, left - given)
            complete = given + whole == left
            if whole and (complete or len(some) < WORDS_AT_ONCE or whole >= STREAM_SAMPLES):
                yield self.record_of(setting, words[: whole * len(chosen)], given)
                del words[: whole * len(chosen)]
                given += whole
            if not some:
                state, available = self.progress()
                if state in ("full", "empty") and not available:
                    raise NotRecorded(
                        f"the stream of node {self.node.address} has ended: its memory was full, "
                        "since the samples come faster than they are read; stream fewer signals, "
                        "or one sample in more ticks"
                    )
                self.node.bus.until_next_poll(self.node, STREAM_POLL_S)

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
        """Adds the loaded waveform to the commands of the axis from the trigger to the end of the
        recordings that begin within the block; their delay ends with its first value.

        The drive must be on. A motion may begin meanwhile, any other request to the axis ends the
        excitation.
        """
        self.axis.request("excite", period=period)
        try:
            yield
        finally:
            self.axis.request("excite", period=0)

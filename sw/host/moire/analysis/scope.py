# SPDX-License-Identifier: Apache-2.0
"""The scope of a node, which records position, error and command of one axis around a trigger.

    scope = Scope(axis)
    scope.arm("motion", before=20)
    axis.move(mm=1.5)
    Path("move.csv").write_text(scope.wait().csv())

With an amplitude the axis is driven in open loop meanwhile; moire.analysis.tune makes gains from
such a record.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from moire import units
from moire.client.access import COUNTS, FULL_SCALE
from moire.client.axis import Axis
from moire.client.names import code_name
from moire.errors import MoireError, OutOfRange
from moire.made.bus_tables import OPERATIONS, SCOPE_STATES, SCOPE_TRIGGERS

TRIGGERS = {name: code for code, (name, _) in SCOPE_TRIGGERS.items()}
SAMPLES = 128  # of a record, as many as the firmware stores
LONGEST_TICKS = 200  # from sample to sample
TIME_CYCLES = 64  # cycles in one count of `time` on the bus
AT_ONCE = sum(field.startswith("time_") for field, _ in OPERATIONS["read_scope"].reply)


class NoRecord(MoireError):
    """The scope was not armed, or there was no trigger."""


@dataclass(frozen=True)
class Record:
    """A record: each list has one value for each sample; time 0 is the trigger."""

    before: int  # samples before the trigger
    time_s: list[float]
    position_nm: list[float]
    error_nm: list[float]
    command: list[float]  # of full scale, -1 to 1: in force when the sample was taken
    period_nm: float

    def csv(self) -> str:
        """The record as CSV, with a heading."""
        rows = ["time_s,position_nm,error_nm,command"]
        rows += [
            f"{time:.6f},{position:.3f},{error:.3f},{command:.6f}"
            for time, position, error, command in zip(
                self.time_s, self.position_nm, self.error_nm, self.command
            )
        ]
        return "\n".join(rows) + "\n"

    def picture(self) -> bytes:
        """The record as PNG."""
        from moire.analysis import report

        figure, panels = report.drawing(height=6.0, nrows=3, sharex=True)
        lengths = [
            [position - self.position_nm[self.before] for position in self.position_nm],
            self.error_nm,
        ]
        for number, (panel, values, name) in enumerate(zip(panels, lengths, ("position", "error"))):
            worth, unit = report.length_unit(report.largest([values]))
            panel.plot(
                [time * 1e3 for time in self.time_s],
                [value / worth for value in values],
                color=report.colour(number),
                linewidth=1.2,
            )
            panel.set_ylabel(f"{name} / {unit}")
        panels[2].plot(
            [time * 1e3 for time in self.time_s],
            [100 * command for command in self.command],
            color=report.colour(2),
            linewidth=1.2,
            drawstyle="steps-pre",
        )
        panels[2].set_ylabel("command / %")
        panels[2].set_xlabel(
            f"time / ms; position from {units.format_length(self.position_nm[self.before])}"
        )
        for panel in panels:
            panel.axvline(0, color="#555555", linewidth=0.8, linestyle="--")
        return report.png(figure)


class Scope:
    """The scope of the node of an axis."""

    def __init__(self, axis: Axis):
        self.axis, self.node = axis, axis.node

    def arm(
        self,
        trigger: str = "now",
        before: int = 0,
        every: units.Value = "1ms",
        level: units.Value = "0nm",
        amplitude: units.Value = 0,
    ) -> None:
        """Begins a new record; raises OutOfRange.

        `before` is the number of samples before the trigger. `every` (s, or a text) is rounded to
        servo ticks. `level` (nm, or a text) is the error that triggers. With an amplitude of the
        open loop (of full scale, or "20%"), `level` is how far the axis may move.
        """
        if trigger not in TRIGGERS:
            raise OutOfRange(
                f"the scope has no trigger '{trigger}': there are {', '.join(TRIGGERS)}"
            )
        if not 0 <= before < SAMPLES:
            raise OutOfRange(f"{before} samples before the trigger do not fit: 0 to {SAMPLES - 1}")
        tick_hz = self.node.identity.tick_hz
        ticks, counts = round(units.parse_time(every) * tick_hz), self.axis.to_counts(level)
        if not 1 <= ticks <= LONGEST_TICKS:
            raise OutOfRange(
                f"samples come every {units.format_time(Fraction(1, tick_hz))} to "
                f"{units.format_time(Fraction(LONGEST_TICKS, tick_hz))}"
            )
        share = units.parse_share(amplitude)
        self.axis.request(
            "arm_scope",
            trigger=TRIGGERS[trigger],
            before=before,
            every=ticks,
            level=min(max(counts, 0), (1 << 32) - 1),
            amplitude=min(round(share * FULL_SCALE), FULL_SCALE - 1),
        )

    def state(self) -> str:
        """ "empty", "full" or another name of SCOPE_STATES."""
        return code_name(SCOPE_STATES, self.node.request("scope")["state"], "state")

    def wait(self, timeout: units.Value = "10s") -> Record:
        """The record, as soon as it is complete; raises NoRecord.

        It sends requests often enough for the watchdog.
        """
        transport, patience = self.axis.transport, units.parse_time(timeout)
        end = transport.now() + float(patience)
        while (state := self.state()) != "full":
            if state == "empty":
                raise NoRecord(f"the scope of node {self.node.address} has no record: arm it first")
            if transport.now() > end:
                raise NoRecord(
                    f"the scope of node {self.node.address} has no record after "
                    f"{units.format_time(patience)}: {dict(SCOPE_STATES.values())[state]}"
                )
            self.node.bus.until_next_poll(self.node)
        return self.read()

    def read(
        self, samples: int = SAMPLES, progress: Callable[[int], object] = lambda done: None
    ) -> Record:
        """The record, as far as it is complete: its first samples, at most so many, but all up to
        the trigger. `progress` gets the number of samples read so far.
        """
        reply = self.node.request("scope")
        count = min(reply["count"], max(samples, reply["before"] + 1))
        rows: list[list[int]] = []
        while len(rows) < count:
            progress(len(rows))
            fields = self.node.request("read_scope", first=len(rows))
            rows += [
                [fields[f"{name}_{n}"] for name in ("time", "position", "error", "command")]
                for n in range(AT_ONCE)
            ]
        if not rows:
            raise NoRecord(f"the scope of node {self.node.address} has no record: arm it first")
        times, positions, errors, commands = zip(*rows[:count])
        unit_s = TIME_CYCLES / self.node.identity.clk_hz
        time_s = [units_passed * unit_s for units_passed in itertools.accumulate(times)]
        return Record(
            reply["before"],
            [time - time_s[reply["before"]] for time in time_s],
            [self.axis.to_nm(position) for position in self.unwrapped(positions)],
            [self.axis.to_nm(error) for error in errors],
            [command / FULL_SCALE for command in commands],
            float(self.axis.period_nm),
        )

    def unwrapped(self, low_words: Sequence[int]) -> list[int]:
        """Whole positions from their low 32 bits.

        The last one is less than half the range from the present position, and each of the others
        from its successor.
        """
        near = self.node.request("position", axis=self.axis.number)["position"]
        out: list[int] = []
        for low in reversed(low_words):
            near += (low - near + (1 << 31)) % (1 << 32) - (1 << 31)
            out.append(near)
        return out[::-1]


def excite(
    axis: Axis,
    amplitude: units.Value = "20%",
    every: units.Value = "2ms",
    reach: units.Value = "1mm",
) -> Record:
    """A record of the response of an axis in open loop.

    The axis must be enabled and at rest. It moves up to `reach` (nm, or a text), and at the end
    holds its position.
    """
    scope = Scope(axis)
    scope.arm("now", every=every, level=reach, amplitude=amplitude)
    return axis.stopping_on_error(scope.wait)


def lsb(record: Record) -> tuple[list[float], list[float], list[float]]:
    """Times in s, commands of full scale 2^15 from these times on, and positions in 2^-16 period.

    This is what moire.analysis.tune takes. The command of a sample was in force until that sample.
    """
    commands = [*record.command[1:], 0.0]
    return (
        record.time_s,
        [command * FULL_SCALE for command in commands],
        [position * COUNTS / record.period_nm for position in record.position_nm],
    )

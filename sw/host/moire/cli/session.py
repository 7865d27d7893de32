# SPDX-License-Identifier: Apache-2.0
"""One call of `moire`: the bus that it opens, the drives that it switches on, what it prints."""

import json
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, TextIO

from moire.bus.transport import Transport
from moire.cli import ports
from moire.cli.files import OutputError
from moire.cli.options import Options
from moire.cli.parser import Planned
from moire.client.axis import Axis
from moire.client.bus import Bus
from moire.client.node import Node
from moire.client.records import Status
from moire.description import AxisDescription, Description
from moire.errors import MoireError

KEEP_S = 0.1  # between two requests to nodes with a drive on, while the host computes
WIDTH = 100  # of a line that is overwritten while a motion goes on
OpenTransport = Callable[[Options], Transport]


class Interrupted(MoireError):
    """Ctrl-C, or a signal that asks this process to end. The exit code is that of a shell."""

    def __init__(self, number: int) -> None:
        by = "interrupted" if number == signal.SIGINT else f"ended by {signal.Signals(number).name}"
        super().__init__(f"{by}; what moved was stopped under control")
        self.exit_code = 128 + number


class Session:
    """The port opens at the first command that needs it. close() switches off what was switched
    on.
    """

    def __init__(
        self,
        options: Options,
        open_transport: OpenTransport | None = None,
        out: TextIO | None = None,
        err: TextIO | None = None,
    ) -> None:
        self.options, self.open_transport = options, open_transport or ports.open_port
        self.out, self.err = out or sys.stdout, err or sys.stderr
        self.opened: Bus | None = None
        self.description = Description()
        # by address and axis: those whose drive this call has switched on, and those it may move
        self.switched_on: dict[tuple[int, int], Axis] = {}
        self.used: dict[tuple[int, int], Axis] = {}

    @property
    def bus(self) -> Bus:
        """The bus of the port; it is opened if it is not open yet."""
        if self.opened is None:
            self.opened = Bus(
                self.open(), tries=self.options.tries, answer_s=float(self.options.patience)
            )
        return self.opened

    def open(self) -> Transport:
        """The transport of the port, opened now; whoever calls this closes it."""
        transport = self.open_transport(self.options)
        if self.options.record:
            transport = ports.recorded(transport, self.options.record)
        return transport

    def carry_out(self, planned: Planned) -> None:
        """One command; an error leaves with the name of the command."""
        self.options = planned.options
        try:
            planned.handler(Call(self, planned), **planned.arguments)
        except MoireError as error:
            error.__dict__.setdefault("command", planned.name)
            raise

    def keep_alive(self) -> None:
        """Talk to every node whose drive this call needs, so that no watchdog of a node switches it
        off while nothing else happens.
        """
        for place, axis in list(self.used.items()):
            if not axis.status().enabled:
                self.forget(place)

    def stop_axes(self) -> None:
        """Stop under control what this call may have moved."""
        for axis in self.used.values():
            axis.stop_if_enabled()

    def forget(self, place: tuple[int, int]) -> None:
        """The drive of this axis is off: there is nothing left to stop or to switch off."""
        self.used.pop(place, None)
        self.switched_on.pop(place, None)

    def print(self, text: str) -> None:
        """One answer on the standard output."""
        try:
            print(text, file=self.out, flush=True)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(error) from None

    def complain(self, error: MoireError) -> None:
        """One error, on the standard error or as JSON."""
        values = {
            "command": getattr(error, "command", None),
            "error": type(error).__name__,
            "message": str(error),
            "exit_code": error.exit_code,
        }
        if hasattr(error, "cause"):
            values["cause"] = error.cause
        if self.options.json and not isinstance(error, OutputError):
            self.print(json.dumps(values))
        else:
            print(f"moire: {error}", file=self.err, flush=True)

    @contextmanager
    def computing(self) -> Iterator[None]:
        """For a block that takes long and does not use the bus: the watchdogs of the nodes whose
        drives this call has switched on hear requests meanwhile.
        """
        axes = {axis.node.address: axis for axis in self.switched_on.values()}
        over = threading.Event()

        def keep() -> None:
            while not over.wait(KEEP_S):
                for axis in axes.values():
                    with suppress(MoireError):  # the next request meets it, too
                        axis.request("position")

        thread = threading.Thread(target=keep, name="keep", daemon=True)
        if axes:
            thread.start()
        try:
            yield
        finally:
            over.set()
            if axes:
                thread.join()

    def close(self) -> None:
        """Stop under control what still moves of what this call has switched on, switch it off, and
        close the port. Raises BadFile when the record of the call is not complete.
        """
        if self.opened is None:
            return
        for axis in self.switched_on.values():
            try:
                axis.stop_if_enabled()
            finally:
                with suppress(MoireError):  # else the watchdog of the node does it
                    axis.disable()
        if self.opened.baud_changed:
            with suppress(MoireError):  # else the nodes do it after a while
                self.opened.first_baud()
        self.opened.transport.close()


@dataclass(frozen=True)
class Call:
    """What the function of a command works with: its session, its options, its axis."""

    session: Session
    planned: Planned

    @property
    def options(self) -> Options:
        """The options of every command."""
        return self.planned.options

    @property
    def bus(self) -> Bus:
        """The bus of the session."""
        return self.session.bus

    @property
    def node(self) -> Node:
        """The node of --address."""
        return self.bus.node(self.options.address)

    @property
    def axis(self) -> Axis:
        """The axis of --address and --axis."""
        return self.bus.axis(self.options.address, self.options.axis)

    @property
    def described(self) -> AxisDescription:
        """The name of the axis, and the unit of its lengths."""
        return self.session.description.at(self.options.address, self.options.axis)

    @property
    def where(self) -> str:
        """The axis in words."""
        place = f"node {self.options.address} axis {self.options.axis}"
        known = self.described
        return f"{known.name}, {place}" if known.name in self.session.description.axes else place

    @property
    def watched(self) -> bool:
        """Whether the standard error is a terminal."""
        return not self.options.json and self.session.err.isatty()

    def now(self) -> float:
        """The time of the port, in seconds."""
        return float(self.bus.transport.now())

    def switch_on(self, motion: str = "") -> Axis:
        """The axis with its drive on. If this call has switched it on, it also switches it off at
        its end. A `motion` is one that needs a zero: see Axis.enable_for().
        """
        axis, place = self.axis, (self.options.address, self.options.axis)
        if not axis.status().enabled:
            if motion:
                axis.enable_for(motion)
            else:
                axis.enable()
            self.session.switched_on[place] = axis
        self.session.used[place] = axis
        return axis

    def say(self, values: Mapping[str, Any], text: str) -> None:
        """The answer of the command: the values as JSON, with the name of the command, or text."""
        if self.options.json:
            name = {"command": self.planned.name}
            if self.planned.action:
                name["action"] = self.planned.action
            assert not name.keys() & values.keys(), "a value overwrites the name of the command"
            text = json.dumps({**name, **values}, default=plain)
        self.session.print(text)

    def say_of_axis(self, values: Mapping[str, Any], text: str) -> None:
        """The same, with address and axis among the values."""
        place = {"address": self.options.address, "axis": self.options.axis}
        self.say({**place, **values}, text)

    def overwrite(self, text: str) -> None:
        """Replace the line that follows a motion, where a person can see it."""
        print(f"\r{text:<{WIDTH}}", end="", file=self.session.err, flush=True)

    def progress(self) -> Callable[[Status], None] | None:
        """A function that follows a motion on the screen; None where no person can see it."""
        if not self.watched:
            return None

        length = self.described.length

        def show(status: Status) -> None:
            self.overwrite(
                f"{status.words:<18} {length(status.position_nm):>17}  "
                f"{status.velocity_mm_s:9.4f} mm/s"
            )

        return show

    def end_progress(self) -> None:
        """Wipe the line of progress."""
        if self.watched:
            self.overwrite("")
            print("\r", end="", file=self.session.err, flush=True)


def plain(value: Any) -> float | str:
    """A value that JSON does not know."""
    return float(value) if isinstance(value, Fraction) else str(value)

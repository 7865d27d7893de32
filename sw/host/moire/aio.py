# SPDX-License-Identifier: Apache-2.0
"""The same as moire.connect() for asyncio, with the same names: what waits there is awaited here.

    async with await moire.aio.connect("twin:s2") as machine:
        x, y = await machine.axis("x"), await machine.axis("y")
        async with x.enabled(), y.enabled():
            await asyncio.gather(x.home(), y.home())
            await x.move("1.5 mm")
            async for sample in x.samples(every="20ms", duration="1s"):
                print(sample.status.position_nm)

Each call runs the blocking method in a thread, and the bus takes one request at a time, so any
number of axes may be waited for together. A task that is cancelled while it waits for a motion
stops the axis under control first, as Ctrl-C does.
"""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, Protocol, Self, TypeVar

from moire import machine as blocking
from moire import units
from moire.bus.protocol import Reply
from moire.bus.transport import BAUD, Transport
from moire.client import axis as blocking_axis
from moire.client import node as blocking_node
from moire.client.bus import ANSWER_S, TRIES, Bus
from moire.client.records import Identity, Sample
from moire.description import Description
from moire.errors import MoireError

THREADS = 32  # calls that wait at the same time

P = ParamSpec("P")
Result = TypeVar("Result")


class Cancelled(BaseException):
    """The task that waits for this call has been cancelled."""


class SharedBus(Bus):
    """A bus for calls in several threads, any of which can be cancelled while it waits."""

    def __init__(self, transport: Transport, tries: int, answer_s: float):
        super().__init__(transport, tries=tries, answer_s=answer_s)
        self.lock = threading.RLock()  # of the transport
        self.here = threading.local()  # `cancelled`: the event of the call in this thread

    def exchange(
        self,
        address: int,
        operation: str,
        /,
        tries: int | None = None,
        answer_s: float | None = None,
        **fields: int,
    ) -> Reply:
        """One exchange at a time."""
        with self.lock:
            return super().exchange(address, operation, tries=tries, answer_s=answer_s, **fields)

    def node(self, address: int = 1) -> blocking_node.Node:
        """The node at an address, which is one object for all threads."""
        with self.lock:
            return super().node(address)

    def until_next_poll(self, polled: blocking_node.Node, seconds: float | None = None) -> None:
        """Raises Cancelled, once, where the task has been cancelled."""
        cancelled: threading.Event | None = getattr(self.here, "cancelled", None)
        if cancelled is not None and cancelled.is_set():
            self.here.cancelled = None  # the stop that follows is waited for
            raise Cancelled
        if self.transport.time_is_stopped:  # then time passes by this call alone
            with self.lock:
                super().until_next_poll(polled, seconds)
        else:
            super().until_next_poll(polled, seconds)

    def sync(self) -> None:
        """No exchange at the same time."""
        with self.lock:
            super().sync()


class Caller:
    """Runs blocking calls on a bus in threads."""

    def __init__(self, bus: SharedBus):
        self.bus, self.pool = bus, ThreadPoolExecutor(THREADS, "moire")

    async def call(self, work: Callable[[], Result]) -> Result:
        """The result of `work`; when the task is cancelled, that of what stops it is awaited."""
        cancelled = threading.Event()

        def run() -> Result:
            self.bus.here.cancelled = cancelled
            return work()

        future = asyncio.get_running_loop().run_in_executor(self.pool, run)
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            cancelled.set()
            await asyncio.wait([future])
            if not future.cancelled():
                future.exception()  # seen: the task ends as cancelled
            raise


class Called(Protocol):
    """An object of this module, and the blocking one whose methods it has."""

    caller: Caller
    blocking: Any


def awaited(
    method: Callable[Concatenate[Any, P], Result],
) -> Callable[Concatenate[Called, P], Coroutine[Any, Any, Result]]:
    """The method of a blocking object as a coroutine, with the same arguments."""

    async def call(self: Called, /, *arguments: P.args, **named: P.kwargs) -> Result:
        return await self.caller.call(lambda: method(self.blocking, *arguments, **named))

    call.__name__, call.__doc__ = method.__name__, method.__doc__
    return call


class Axis:
    """One axis; see moire.client.axis.Axis, whose methods these are."""

    def __init__(self, caller: Caller, axis: blocking_axis.Axis):
        self.caller, self.blocking = caller, axis

    status = awaited(blocking_axis.Axis.status)
    enable = awaited(blocking_axis.Axis.enable)
    disable = awaited(blocking_axis.Axis.disable)
    reset = awaited(blocking_axis.Axis.reset)
    drive = awaited(blocking_axis.Axis.drive)
    home = awaited(blocking_axis.Axis.home)
    move = awaited(blocking_axis.Axis.move)
    begin_move = awaited(blocking_axis.Axis.begin_move)
    prepare = awaited(blocking_axis.Axis.prepare)
    stream = awaited(blocking_axis.Axis.stream)
    motion_end = awaited(blocking_axis.Axis.motion_end)
    dwell = awaited(blocking_axis.Axis.dwell)
    stop = awaited(blocking_axis.Axis.stop)
    stop_and_wait = awaited(blocking_axis.Axis.stop_and_wait)
    take_over = awaited(blocking_axis.Axis.take_over)
    set_backlash = awaited(blocking_axis.Axis.set_backlash)
    override = awaited(blocking_axis.Axis.override)
    pause = awaited(blocking_axis.Axis.pause)
    resume = awaited(blocking_axis.Axis.resume)
    survey_index = awaited(blocking_axis.Axis.survey_index)
    calibration = awaited(blocking_axis.Axis.calibration)
    calibrate = awaited(blocking_axis.Axis.calibrate)
    correction = awaited(blocking_axis.Axis.correction)
    set_correction = awaited(blocking_axis.Axis.set_correction)
    encoder = awaited(blocking_axis.Axis.encoder)
    signal = awaited(blocking_axis.Axis.signal)
    capture_from = awaited(blocking_axis.Axis.capture_from)
    capture_now = awaited(blocking_axis.Axis.capture_now)
    captures = awaited(blocking_axis.Axis.captures)
    compare = awaited(blocking_axis.Axis.compare)
    compare_from = awaited(blocking_axis.Axis.compare_from)
    compare_off = awaited(blocking_axis.Axis.compare_off)
    built = awaited(blocking_axis.Axis.built)
    parameters = awaited(blocking_axis.Axis.parameters)
    get_parameter = awaited(blocking_axis.Axis.get_parameter)
    set_parameter = awaited(blocking_axis.Axis.set_parameter)
    tuning = awaited(blocking_axis.Axis.tuning)
    set_tuning = awaited(blocking_axis.Axis.set_tuning)
    save_parameters = awaited(blocking_axis.Axis.save_parameters)
    load_parameters = awaited(blocking_axis.Axis.load_parameters)

    @asynccontextmanager
    async def enabled(self) -> AsyncIterator[Self]:
        """A block in which the drive is on; as the one of the blocking axis."""
        was_enabled = (await self.status()).enabled
        if not was_enabled:
            await self.enable()
        try:
            yield self
        finally:
            try:
                if (await self.status()).in_motion:
                    await self.stop_and_wait()
            finally:
                if not was_enabled:
                    await self.disable()

    async def samples(
        self, every: units.Value = "20ms", duration: units.Value | None = None
    ) -> AsyncIterator[Sample]:
        """The status of the axis every so often, as the iterator of the blocking axis."""
        samples = self.blocking.samples(every, duration)
        while (sample := await self.caller.call(lambda: next(samples, None))) is not None:
            yield sample


class Node:
    """One node; see moire.client.node.Node, whose methods these are."""

    def __init__(self, caller: Caller, node: blocking_node.Node):
        self.caller, self.blocking = caller, node
        self.address, self.identity = node.address, node.identity

    start = awaited(blocking_node.Node.start)
    counters = awaited(blocking_node.Node.counters)
    update = awaited(blocking_node.Node.update)
    read_register = awaited(blocking_node.Node.read_register)
    write_register = awaited(blocking_node.Node.write_register)
    read_named = awaited(blocking_node.Node.read_named)

    async def request(self, operation: str, **fields: int) -> dict[str, int]:
        """Sends one request; see Bus.request()."""
        return await self.caller.call(lambda: self.blocking.request(operation, **fields))

    async def write_named(self, name: str, axis: int = 0, **counts: int) -> None:
        """Writes fields of a register by their names; see the blocking node."""
        await self.caller.call(lambda: self.blocking.write_named(name, axis, **counts))

    async def axis(self, number: int = 0) -> Axis:
        """An axis of this node; raises Refused if there is none of this number."""
        return Axis(self.caller, await self.caller.call(lambda: self.blocking.axis(number)))


class Machine:
    """All axes of one bus; see moire.machine.Machine."""

    def __init__(self, caller: Caller, description: Description):
        self.caller, self.description = caller, description
        self.blocking = blocking.Machine(caller.bus, description)

    async def axis(self, name: str) -> Axis:
        """An axis by its name, or by node and axis such as "1.0"; raises UnknownName."""
        return Axis(self.caller, await self.caller.call(lambda: self.blocking.axis(name)))

    async def axes(self) -> dict[str, Axis]:
        """The named axes, in the order of the description."""
        found = await self.caller.call(self.blocking.axes)
        return {name: Axis(self.caller, axis) for name, axis in found.items()}

    async def node(self, address: int = 1) -> Node:
        """A node by its address; see Bus.node()."""
        return Node(self.caller, await self.caller.call(lambda: self.blocking.node(address)))

    async def find(self) -> list[Identity]:
        """The nodes that answer; see Bus.find()."""
        return await self.caller.call(self.blocking.find)

    async def close(self) -> None:
        """Switches off what was switched on, and closes the port."""
        try:
            await self.caller.call(self.blocking.close)
        finally:
            self.caller.pool.shutdown()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            await self.close()
        except MoireError:
            if error is None:  # otherwise that one explains more
                raise


async def connect(
    port: str | None = None,
    *,
    machine_file: str | None = None,
    baud: int = BAUD,
    parity: str = "auto",
    tries: int = TRIES,
    patience: units.Value = ANSWER_S,
) -> Machine:
    """The machine at a port; see moire.connect()."""
    transport, description = await asyncio.to_thread(
        blocking.opened, port, machine_file, baud, parity
    )
    bus = SharedBus(transport, tries, float(units.parse_time(patience)))
    return Machine(Caller(bus), description)

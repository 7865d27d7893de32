# SPDX-License-Identifier: Apache-2.0
"""Between the clients of the doors and the gateway that owns the bus.

The gateway polls in one thread, the doors run on asyncio in another one, and the host package's own
client code, which waits for replies, in a few more. All of them ask the gateway by its queue, so
that its arbiter sees every request. A reply may be given to several clients if they accept its age.
"""

import asyncio
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from concurrent.futures import Future, InvalidStateError, ThreadPoolExecutor
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from moire.bus.arbiter import Place, request
from moire.bus.gateway import Gateway, Waiting
from moire.bus.protocol import ADDRESSES, MOST_AXES, NAMES, Reply, parse_reply
from moire.bus.recent import Sample
from moire.bus.transport import Transport
from moire.client.access import length_of_counts, status_of
from moire.client.axis import Axis
from moire.client.bus import Bus, accepted
from moire.client.names import CAUSE_CODES
from moire.client.node import Node
from moire.client.records import Identity, Status
from moire.description import Description
from moire.errors import BusError, MoireError, NoAnswer, OutOfRange, PortError, Refused
from moire.made.bus_tables import PARAMETERS
from moire.web.jog import Jog

if TYPE_CHECKING:
    from moire.web.calibrating import Run
    from moire.web.recording import Recording

LEASE_S = 5.0  # of the clock: a client that has asked nothing for so long has left
TIDY_S = 0.05  # of the clock, between two looks at clients and watchdogs
FEED_S = 0.15  # of the bus: a node whose drive a client needs hears something so often
WAIT_S = 0.02  # of the bus: age of a status at which the end of a motion is seen
LOOK_S = 0.002  # of the clock, between two looks at the time of the bus
# of the clock: so long a node that has not answered is not asked again, since that keeps all others
# waiting; and one that has never answered
ABSENT_S, NEVER_S = 1.0, 10.0
NO_NAMES = Description()
# for commands, for what takes a hundred exchanges, for streams, of which a node has one, and for
# calibrations, of which an axis has one
THREADS = {"short": 8, "long": 2, "stream": 8, "calibration": len(ADDRESSES) * MOST_AXES}

Result = TypeVar("Result")


class Numbers:
    """The sequence numbers of a client's requests. Two in a row to the same node are not alike, or
    the second would be taken for a repeated one, whatever others have asked in between.
    """

    def __init__(self) -> None:
        self.last: dict[int, int] = {}  # by address

    def next(self, address: int) -> int:
        """The number of the next request to a node."""
        self.last[address] = number = (self.last.get(address, -1) + 1) % 256
        return number


class Client:
    """A client of the doors, as the arbiter knows it. `given` is the name that it has given itself,
    None if it has not; then it lives as long as its connection.
    """

    def __init__(self, name: str, given: str | None = None):
        self.name, self.given, self.heard = name, given, time.monotonic()
        self.busy = 0  # requests in progress
        self.numbers = Numbers()
        # its last samples of sine and cosine by axis, see moire.web.lissajous
        self.samples: dict[Place, deque[tuple[int, int, int, float]]] = {}
        self.left = False

    def __str__(self) -> str:
        return self.name


class Moment(NamedTuple):
    """The status of an axis and the time of the bus at which it was read, s."""

    time: float
    status: Status


def was_stopped() -> Refused:
    """A stop has come while a motion was being begun."""
    return Refused(
        "stopped", CAUSE_CODES["stopped"], "the motion was stopped while it was being begun"
    )


class Bridge:
    """All clients of the doors in front of one gateway."""

    def __init__(self, gateway: Gateway, description: Description = NO_NAMES):
        self.gateway, self.description = gateway, description
        self.loop: asyncio.AbstractEventLoop | None = None  # that of the doors
        self.numbers = Numbers()
        self.open: set[Future[Sample | None]] = set()  # what has been asked and not answered
        self.lock, self.closed = threading.Lock(), False
        self.named: dict[str, Client] = {}
        self.present: set[Client] = set()
        self.absent: dict[int, float] = {}  # by address: until when, of the clock
        self.seen: set[int] = set()  # addresses that have ever answered
        self.jogs: dict[tuple[Client, Place], Jog] = {}
        # the last one of each recorder, by address and the request that arms it
        self.recordings: dict[tuple[int, str], Recording] = {}
        self.calibrations: dict[Place, Run] = {}  # the last one of each axis
        self.pools = {
            name: ThreadPoolExecutor(count, f"moire-{name}") for name, count in THREADS.items()
        }

    def close(self) -> None:
        """Ends what is in progress: nobody polls any more."""
        with self.lock:
            self.closed, left, self.open = True, self.open, set()
        for one in left:
            settle(partial(one.set_exception, PortError("the server ends")))
        for pool in self.pools.values():
            pool.shutdown(wait=False, cancel_futures=True)

    # requests

    def send(self, client: Hashable, address: int, body: bytes) -> "Future[Sample | None]":
        """Queues a request, a body without its sequence number; the result is the reply, None if
        the node does not answer. Raises OutOfRange for an address that no node can have.
        """
        require_address(address)
        future: Future[Sample | None] = Future()
        numbers = client.numbers if isinstance(client, Client) else self.numbers
        with self.lock:
            if self.closed:
                raise PortError("the server ends")
            self.open.add(future)
            number = bytes([numbers.next(address)])

        def answer(reply: bytes | None) -> None:
            with self.lock:
                if future not in self.open:
                    return
                self.open.discard(future)
            result = None if reply is None else Sample(self.gateway.time, reply[1:])
            settle(partial(future.set_result, result))

        waiting = Waiting(client, address, number + body, answer)
        self.gateway.call_soon(partial(self.enqueue, waiting))
        return future

    def enqueue(self, waiting: Waiting) -> None:
        """In the thread of the gateway: a client that has left gets nothing done any more."""
        if isinstance(waiting.client, Client) and waiting.client.left:
            waiting.answer(None)
        else:
            self.gateway.enqueue(waiting)

    def require_present(self, address: int) -> None:
        """A node that did not answer a moment ago would keep all others waiting again."""
        require_address(address)
        if self.absent.get(address, 0.0) > time.monotonic():
            raise NoAnswer(address)

    def whole(self, client: Hashable, address: int, sample: Sample | None) -> Sample:
        """The reply if there is one; raises NoAnswer."""
        if sample is None:
            if isinstance(client, Client) and client.left:
                raise PortError("the client has left")
            patience = ABSENT_S if address in self.seen else NEVER_S
            self.absent[address] = time.monotonic() + patience
            raise NoAnswer(address)
        self.seen.add(address)
        return sample

    async def ask(self, address: int, body: bytes, oldest: float = math.inf) -> Sample:
        """The reply to a poll, which may be one that another client got after the time `oldest`."""
        found = self.gateway.recent.find(address, body, oldest)
        if found is not None:
            return found
        self.require_present(address)
        found = await asyncio.wrap_future(self.send(self, address, body))
        return self.whole(self, address, found)

    async def ask_at_once(self, client: Client, place: Place, operation: str, **more: int) -> None:
        """Carries out a stop, or the like, without any other exchange before it; raises Refused."""
        body = request(operation, axis=place[1], **more)
        found = await asyncio.wrap_future(self.send(client, place[0], body))
        fields_of(self.whole(client, place[0], found), place[0])

    def ask_here(self, client: Hashable, address: int, body: bytes) -> Sample:
        """The reply to any request; waits for it in this thread."""
        self.require_present(address)
        return self.whole(client, address, self.send(client, address, body).result())

    async def command(
        self, client: Hashable, place: Place, work: Callable[[Axis], Result], pool: str = "short"
    ) -> Result:
        """Calls the host package's own client code for an axis, in a thread that may wait."""
        return await self.in_thread(lambda: work(ClientBus(self, client).axis(*place)), pool)

    async def command_of_node(
        self, client: Hashable, address: int, work: Callable[[Node], Result]
    ) -> Result:
        """The same for a node."""
        return await self.in_thread(lambda: work(ClientBus(self, client).node(address)), "short")

    async def in_thread(self, call: Callable[[], Result], pool: str) -> Result:
        """The result of a call in a thread of a pool."""
        assert self.loop is not None
        return await self.loop.run_in_executor(self.pools[pool], call)

    # what is read often

    async def identity(self, address: int) -> Identity:
        """Which build a node is; raises WrongBuild if this host was made from other tables."""
        sample = await self.ask(address, request("identify"), -math.inf)
        identity = Identity(**{**fields_of(sample, address), "address": address})
        identity.check()
        return identity

    async def period(self, place: Place) -> Fraction:
        """The signal period of an axis in nm."""
        body = request("get_parameter", axis=place[1], parameter=PARAMETERS["period"].id)
        sample = await self.ask(place[0], body, -math.inf)
        return Fraction(fields_of(sample, place[0])["value"], 1000)

    async def status(self, place: Place, oldest: float = math.inf) -> Moment:
        """The status of an axis, not older than a time of the bus."""
        identity, period_nm = await self.identity(place[0]), await self.period(place)
        sample = await self.ask(place[0], request("status", axis=place[1]), oldest)
        fields = fields_of(sample, place[0])
        return Moment(sample.time, status_of(fields, period_nm, identity.tick_hz))

    async def position(self, place: Place, oldest: float = math.inf) -> tuple[float, float]:
        """(time of the bus in s, position in nm), not older than a time of the bus."""
        period_nm = await self.period(place)
        sample = await self.ask(place[0], request("position", axis=place[1]), oldest)
        return sample.time, length_of_counts(fields_of(sample, place[0])["position"], period_nm)

    async def until(self, moment: float) -> None:
        """Waits for a time of the bus; raises PortError when the server ends."""
        while self.gateway.time < moment:
            if self.closed:
                raise PortError("the server ends")
            ahead = (moment - self.gateway.time) / (self.gateway.speed or 1.0)
            await asyncio.sleep(min(max(ahead / 2, LOOK_S), TIDY_S))

    async def end_of_motion(self, place: Place, moving: Callable[[Status], bool]) -> Moment:
        """The first status that does not move any more."""
        while True:
            found = await self.status(place, self.gateway.time - WAIT_S)
            if not moving(found.status):
                return found
            await self.until(found.time + WAIT_S)

    # rights

    def owner(self, place: Place) -> Hashable | None:
        """The client that moved the axis last, or moves it."""
        return self.gateway.arbiter.moved_by.get(place)

    def claim(self, client: Client, place: Place) -> None:
        """The axis belongs to the client from the next poll of the gateway on."""
        self.gateway.call_soon(partial(self.gateway.arbiter.claim, client, place))

    def jog(self, client: Client, place: Place) -> Jog | None:
        """The jog of an axis by a client, None if it has none or it has ended."""
        found = self.jogs.get((client, place))
        return found if found is not None and found.lasts else None

    def begin_jog(self, client: Client, place: Place) -> Jog:
        """The client is going to jog the axis. Another client may jog it until it does."""
        made = self.jogs[client, place] = Jog(
            lambda: self.gateway.stops[place], partial(self.stop_own, client, place)
        )
        return made

    def end_jogs(self, place: Place, but: Jog | None = None) -> None:
        """The axis has begun another motion than these."""
        for (client, where), found in list(self.jogs.items()):
            if where == place and found is not but:
                found.end()
                del self.jogs[client, where]

    async def stop_own(self, client: Client, place: Place) -> None:
        """Stops an axis that belongs to the client; its end stops it otherwise. A node that does
        not answer is asked again.
        """
        pause_s = TIDY_S
        while self.owner(place) is client and not client.left:
            try:
                await self.ask_at_once(client, place, "stop")
                return
            except BusError:
                await asyncio.sleep(pause_s)
                pause_s = min(2 * pause_s, ABSENT_S)
            except MoireError:  # the drive is off, or the server ends
                return

    def client(self, name: str | None, place: str) -> Client:
        """The client of this name, or a new one; `place` says in words where it is."""
        if name is not None and name in self.named:
            return self.named[name]
        made = Client(f"the client '{name}'" if name else f"the {place}", name)
        self.present.add(made)
        if name is not None:
            self.named[name] = made
        return made

    def leave(self, client: Client) -> None:
        """A client has left: what it moves is stopped, and its drives are switched off."""
        if client.left:
            return
        client.left = True
        self.present.discard(client)
        self.named = {name: one for name, one in self.named.items() if one is not client}
        self.jogs = {key: found for key, found in self.jogs.items() if key[0] is not client}
        self.gateway.call_soon(partial(self.gateway.depart, client))

    async def tidy(self) -> None:
        """For ever: sees named clients off that ask nothing any more, and keeps the watchdogs of
        the nodes fed whose drives are needed by a client that is here.
        """
        while True:
            await asyncio.sleep(TIDY_S)
            for client in list(self.named.values()):
                if not client.busy and time.monotonic() - client.heard > LEASE_S:
                    self.leave(client)
            arbiter = self.gateway.arbiter
            owned = [*arbiter.switched_on_by.copy().items(), *arbiter.moved_by.copy().items()]
            needed = {place for place, owner in owned if owner in self.present}
            await asyncio.gather(*map(self.feed, needed), return_exceptions=True)

    async def feed(self, place: Place) -> None:
        """The node of this axis has heard something a moment ago."""
        body = request("position", axis=place[1])
        await self.ask(place[0], body, self.gateway.time - FEED_S)


class ClientBus(Bus):
    """The bus for the host package's client code, of one client, through a gateway."""

    def __init__(self, bridge: Bridge, client: Hashable):
        super().__init__(BridgeTime(bridge.gateway))
        self.bridge, self.client = bridge, client

    def exchange(
        self,
        address: int,
        operation: str,
        /,
        tries: int | None = None,
        answer_s: float | None = None,
        **fields: int,
    ) -> Reply:
        """The reply; what a node is, and the period of an axis, are not read again and again."""
        body = request(operation, **fields)
        lasting = operation == "identify" or (
            operation == "get_parameter" and fields["parameter"] == PARAMETERS["period"].id
        )
        found = self.bridge.gateway.recent.find(address, body, -math.inf) if lasting else None
        if found is None:
            found = self.bridge.ask_here(self.client, address, body)
        reply = parse_reply(b"\0" + found.reply)
        assert reply is not None  # the gateway has checked it
        if reply.cause == CAUSE_CODES["other_client"]:
            self.refuse(address, operation, reply, fields.get("axis", 0))
        return reply

    def refuse(self, address: int, operation: str, reply: Reply, axis: int) -> None:
        """Raises Refused with the name of the client that moves the axis."""
        owner = str(self.bridge.owner((address, axis)) or "a client that has left")
        try:
            accepted(reply, address, operation)
        except Refused as refused:
            more = Refused(refused.cause, refused.code, f"{refused} (it belongs to {owner})")
            more.__dict__["owner"] = owner
            raise more from None


class BridgeTime(Transport):
    """The time of the bus. Words cannot be sent: there are other clients."""

    def __init__(self, gateway: Gateway):
        self.gateway = gateway

    def send(self, words: Sequence[int]) -> None:
        raise PortError("this needs the bus of the nodes itself: it does not work through a server")

    def receive(self, count: int, timeout_s: float) -> list[int]:
        raise PortError("this needs the bus of the nodes itself: it does not work through a server")

    def now(self) -> float:
        return self.gateway.time

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)


def require_address(address: int) -> None:
    """Raises OutOfRange for an address that no node can have."""
    if address not in ADDRESSES:
        raise OutOfRange(
            f"there is no address {address}: allowed are {ADDRESSES[0]} to {ADDRESSES[-1]}"
        )


def settle(work: Callable[[], None]) -> None:
    """Sets the result of a future, unless whoever asked has been cancelled."""
    try:
        work()
    except InvalidStateError:
        pass


def fields_of(sample: Sample, address: int) -> dict[str, int]:
    """The fields of a reply; raises Refused."""
    reply = parse_reply(b"\0" + sample.reply)
    assert reply is not None  # the gateway has checked it
    return accepted(reply, address, NAMES[reply.operation])

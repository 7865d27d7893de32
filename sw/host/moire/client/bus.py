# SPDX-License-Identifier: Apache-2.0
"""The nodes on one RS-485 bus.

    with SerialBus("/dev/ttyUSB0") as port:
        with Bus(port).axis(address=1).enabled() as axis:
            axis.home()
            print(axis.move(mm=1.5).position_nm)

moire.connect() opens port and bus together, and knows the names of axes.
A drive stays on only while this host sends requests: the watchdog of a node switches it off when
it has heard nothing for the time `watchdog_time`. While the host waits for one node, it also polls
the others whose drives it has switched on.
"""

import random
from collections.abc import Iterable
from contextlib import suppress

from moire.bus.exchanges import Exchanges
from moire.bus.protocol import ADDRESSES, Exchange, Reply, Timing, request_body, sync_words
from moire.bus.transport import BAUD, Transport
from moire.client.axis import Axis
from moire.client.names import refusal
from moire.client.node import Node, register_fields
from moire.client.records import Identity, Progress, Status
from moire.errors import BusError, BusGarbled, MoireError, NoAnswer, OutOfRange, PortError

SYNC_S = 0.002  # after this time the firmware, too, knows what the sync began
BAUD_CHANGE_S = 0.005  # a node changes its rate after its reply, at most this much later
RATES = (
    BAUD,
    1_000_000,
    500_000,
    250_000,
    3_000_000,
    2_000_000,
    921_600,
    460_800,
    230_400,
    57_600,
    38_400,
    19_200,
    9_600,
)
TRIES = 5  # of a request, unless a Bus is given another number
ANSWER_S = 0.1  # patience with a node, unless a Bus is given another time
POLL_S = 0.05  # between two polls of a motion, unless a Bus is given another time


class Bus:
    """The nodes on one transport.

    Every request is tried `tries` times, each time with `answer_s` seconds of patience. A motion
    that is waited for is polled every `poll_s` seconds. `random_source` gives the first sequence
    number for each node.
    """

    FIND_ANSWER_S = 0.05
    FIND_TRIES = 2
    SINGLE_CHECKS = 3

    def __init__(
        self,
        transport: Transport,
        tries: int = TRIES,
        answer_s: float = ANSWER_S,
        random_source: random.Random | None = None,
        poll_s: float = POLL_S,
    ):
        self.transport, self.tries, self.answer_s, self.poll_s = transport, tries, answer_s, poll_s
        self.random = random_source or random.SystemRandom()
        self.exchanges = Exchanges(transport)
        self.statistics = self.exchanges.statistics
        self.sequences: dict[int, int] = {}  # the last sequence number for each address
        self.nodes: dict[int, Node] = {}
        self.syncs = 0  # sent by this host
        self.baud_changed = False  # by this host, from the rate after power-up

    # requests

    @property
    def quiet_s(self) -> float:
        """A bus on which nothing arrived for so long, in seconds, is silent."""
        return max(0.01, 3 * self.transport.character_s)

    def exchange(
        self,
        address: int,
        operation: str,
        /,
        tries: int | None = None,
        answer_s: float | None = None,
        **fields: int,
    ) -> Reply:
        """Sends one request, repeated where needed, and returns the reply whatever its cause.

        Raises NoAnswer or BusGarbled when no whole reply came, OutOfRange when a field does not
        fit.
        """
        # after the first, the number differs from that of every frame that the node can remember:
        # a request cannot be taken for an old one
        if address in self.sequences:
            sequence = (self.sequences[address] + 1) % 256
        else:
            sequence = self.random.randrange(256)
        self.sequences[address] = sequence
        timing = Timing(
            self.transport.character_s, answer=answer_s or self.answer_s, quiet=self.quiet_s
        )
        body = request_body(operation, sequence, **fields)
        exchange = Exchange(address, body, tries or self.tries, timing, self.transport.handshake)
        return self.exchanges.run(exchange).result()

    def request(self, address: int, operation: str, /, **fields: int) -> dict[str, int]:
        """Returns the fields of the reply; raises Refused when the node refuses."""
        return accepted(self.exchange(address, operation, **fields), address, operation)

    def identify(
        self, address: int, tries: int | None = None, answer_s: float | None = None
    ) -> Identity:
        """Which build the node is; works with a node of any build."""
        reply = self.exchange(address, "identify", tries=tries, answer_s=answer_s)
        return Identity(**{**accepted(reply, address, "identify"), "address": address})

    def until_next_poll(self, polled: Node, seconds: float | None = None) -> None:
        """Lets the time between two polls of a node pass, `poll_s` unless another is given.

        Each other node with a drive that this host has switched on gets a request, since a node's
        watchdog hears only what is sent to that node. One that does not answer is not an error
        here: whoever waits for it learns that.
        """
        self.transport.wait(self.poll_s if seconds is None else seconds)
        for node in list(self.nodes.values()):  # another thread may add one
            if node is not polled and node.switched_on:
                try:
                    self.exchange(node.address, "position", tries=1, axis=min(node.switched_on))
                except BusError:
                    pass

    # finding nodes

    def find(self, addresses: Iterable[int] = ADDRESSES) -> list[Identity]:
        """The identities of all nodes that answer, of any build.

        Raises BusGarbled when two nodes have the same address.
        """
        found = []
        for address in addresses:
            if not self.transport.reaches(address):
                continue
            try:
                identity = self.identify(
                    address, tries=self.FIND_TRIES, answer_s=self.FIND_ANSWER_S
                )
            except NoAnswer:
                continue
            found.append(identity)
            if identity.matches:
                self.require_single(address)
        return found

    def require_single(self, address: int) -> None:
        """Raises BusGarbled when two nodes have this address.

        They may identify themselves alike, but their times differ. A repeated request may by
        chance be answered by one of them alone; the words of the other come after the reply.
        """
        time_stamp = register_fields("node.time_stamp")[0].address(0)
        for _ in range(self.SINGLE_CHECKS):
            self.request(address, "read_register", address=time_stamp)
            if self.exchanges.wait_for_silence(self.quiet_s):
                raise BusGarbled(address, "words came after a whole reply", self.tries)

    def find_baud(
        self, addresses: Iterable[int] = ADDRESSES, rates: Iterable[int] = RATES
    ) -> tuple[list[Identity], int]:
        """Tries baud rates until nodes answer, and keeps that rate.

        Returns what find() returns, and the rate; the list is empty when no node answers at any
        rate. A node that was not called for 5 s returns to the rate after power-up, which is
        therefore tried again at the end.
        """
        self.require_direct_bus()
        addresses = list(addresses)
        garbled = None  # at a wrong rate, words of other nodes look garbled
        for rate in (*rates, BAUD):
            found = []
            try:
                self.transport.set_baud(rate)
                found = self.find(addresses)
            except PortError:
                if rate == BAUD:  # every port can do this one
                    raise
            except BusGarbled as error:
                garbled = garbled or error
            if found:
                return found, rate
        if garbled is not None:
            raise garbled
        return [], BAUD

    def node(self, address: int = 1) -> Node:
        """The node at an address.

        The first call identifies the node, and raises WrongBuild if it was made from other tables
        than this host.
        """
        if address not in self.nodes:
            self.nodes[address] = Node(self, address)
        return self.nodes[address]

    def axis(self, address: int = 1, axis: int = 0) -> Axis:
        """An axis of the node at an address; see node()."""
        return self.node(address).axis(axis)

    # several nodes together

    def require_direct_bus(self) -> None:
        """Raises BusError unless this host itself drives the 9-bit bus."""
        if not self.transport.handshake:
            raise BusError(
                0, "this needs the bus of the nodes itself: it does not work through a gateway"
            )

    def sync(self) -> None:
        """Sends a sync, which reaches all nodes within a microsecond.

        An axis that captures from "software" latches its position, and a prepared motion that
        waits for a sync begins. No node answers; the nodes count syncs.
        """
        self.require_direct_bus()
        self.syncs += 1
        self.transport.send(sync_words(self.syncs))
        self.transport.wait(SYNC_S)

    def start(self, *axes: Axis, progress: Progress | None = None) -> list[Status]:
        """Begins the prepared motions of these axes within a microsecond, or none of them.

        Returns the Status of each axis when all motions have ended. Whatever interrupts the wait
        stops all axes under control first.
        """
        if not axes:
            raise OutOfRange("no axis is given: name the axes that shall start")
        self.require_direct_bus()
        masks: dict[int, int] = {}
        begun = False
        for axis in dict.fromkeys(axes):
            masks[axis.node.address] = masks.get(axis.node.address, 0) | 1 << axis.number
        try:
            for address, mask in masks.items():
                self.request(address, "start_at_sync", axes=mask)
            begun = True
            self.sync()
            for axis in axes:
                if axis.status().state == "prepared":
                    raise BusError(
                        axis.node.address,
                        f"node {axis.node.address} did not receive the sync at which its motion "
                        "should begin",
                    )
            return [axis.wait(progress) for axis in axes]
        except BaseException:
            for axis in axes if begun else ():
                axis.stop_if_enabled()
            for address in masks:
                with suppress(MoireError):  # a node that does not answer must not keep the others
                    self.request(address, "start_at_sync", axes=0)
            raise

    # baud rate

    def set_baud(self, baud: int, addresses: Iterable[int]) -> None:
        """Changes the baud rate of this host and of these nodes, which must be all on the bus.

        All return to the rate after power-up when one of them does not follow. A node returns to
        it after a break, and by itself when it was not called for 5 s.
        """
        self.require_direct_bus()
        addresses = list(addresses)
        try:
            for address in addresses:
                self.request(address, "set_baud", baud=baud)
            self.transport.wait(BAUD_CHANGE_S)
            self.transport.set_baud(baud)
            for address in addresses:
                self.identify(address)
        except BaseException:
            self.first_baud()
            raise
        self.baud_changed = True

    def first_baud(self) -> None:
        """Returns all nodes, and this host, to the baud rate after power-up."""
        self.transport.send_break()
        self.transport.set_baud(BAUD)
        self.transport.wait(BAUD_CHANGE_S)
        self.baud_changed = False


def accepted(reply: Reply, address: int, operation: str) -> dict[str, int]:
    """The fields of a reply; raises Refused unless its cause is ok."""
    if reply.cause == 0:
        return reply.fields
    raise refusal(address, operation, reply.cause)

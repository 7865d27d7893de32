# SPDX-License-Identifier: Apache-2.0
"""Carries out exchanges over a transport, one after the other, and counts what went wrong.

protocol.Exchange and relay.Exchange are state machines without any input or output; step() does
for them what they ask for.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from moire.bus.protocol import Exchange
from moire.bus.transport import Transport


class StateMachine(Protocol):
    """The part of an exchange that its owner uses."""

    @property
    def finished(self) -> bool:
        """Whether there is a result."""

    @property
    def expected(self) -> int:
        """How many words to receive next at most."""

    @property
    def timeout_s(self) -> float:
        """How long to wait for them."""

    def words_to_send(self) -> list[int]:
        """The words to send now; each is given once."""

    def feed(self, words: Iterable[int]) -> None:
        """Takes the words that arrived."""

    def silence(self) -> None:
        """Fewer words than expected arrived in time."""


def step(transport: Transport, exchange: StateMachine) -> None:
    """Sends and receives once, as the exchange asks for it."""
    if sending := exchange.words_to_send():
        transport.send(sending)
    expected = exchange.expected
    received = transport.receive(expected, exchange.timeout_s)
    exchange.feed(received)
    if len(received) < expected:
        exchange.silence()


@dataclass
class Statistics:
    """What this host has met on the bus."""

    exchanges: int = 0
    repeats: int = 0
    no_answer: int = 0
    garbled: int = 0
    old_reply: int = 0

    def count(self, exchange: Exchange) -> None:
        """Adds the repeats and the events of an exchange."""
        self.repeats += exchange.attempts - 1
        for event in exchange.events:
            name = event.replace(" ", "_")
            setattr(self, name, getattr(self, name) + 1)


class Exchanges:
    """All exchanges of one transport."""

    def __init__(self, transport: Transport):
        self.transport = transport
        self.statistics = Statistics()
        self.in_order = True  # false while words of a broken exchange may still arrive

    def run(self, exchange: Exchange) -> Exchange:
        """Carries out an exchange to its end, successful or not, and returns it."""
        if not self.in_order:
            self.wait_for_silence(exchange.timing.quiet)
        self.in_order = False
        self.statistics.exchanges += 1
        try:
            while not exchange.finished:
                step(self.transport, exchange)
        finally:
            self.statistics.count(exchange)
        self.in_order = exchange.reply is not None
        return exchange

    def wait_for_silence(self, quiet_s: float) -> int:
        """Throws away what still arrives, until nothing does for `quiet_s`; returns how many words
        that were.
        """
        for count in range(Exchange.LONGEST_NOISE):
            if not self.transport.receive(1, quiet_s):
                return count
        return Exchange.LONGEST_NOISE

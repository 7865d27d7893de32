# SPDX-License-Identifier: Apache-2.0
"""Decides what the clients of one bus may do with its axes, request by request.

    arbiter = Arbiter(ask, transport.now)
    reply = arbiter.answer(client, address, body)

An axis that moves belongs to the client whose request began the motion. Another client may read
everything, stop the axis or switch its drive off; to begin a motion of its own, it has to stop the
axis first. A client that has claimed an axis owns it at once, so that it can stop it and move it
without another one coming in between. A client that leaves has its axes stopped under control, and
then the drives switched off that it had switched on. Each client may repeat its last request to a
node, whatever the others have sent in between: it gets the same reply, and the node does not see
the repetition. The two words of a register of 64 bits stay together, too.

Bodies are those of docs/protocol.md. The arbiter does not send or receive; `ask` does.
"""

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass

from moire.bus.protocol import IN_MOTION, MOST_AXES, NAMES, REQUESTS, parse_reply, request_body
from moire.made.bus_tables import CAUSES, OPERATIONS, STATES
from moire.made.registers import BLOCKS, FIELDS

# what begins a motion, or drives the axis in another way; arm_scope does so with an amplitude, and
# excite with a period
MOTIONS = frozenset(
    {
        *("home", "move", "prepare", "start", "start_at_sync", "begin_stream", "set_point"),
        *("turn_to", "arm_scope", "step_fine", "excite"),
    }
)
RECORDS = ("arm_scope", "record_ticks")  # the requests that arm the two recorders of a node
POLLS = frozenset({"identify", "status", "position", "encoder", "signal"})  # may be merged
TABLE_AXIS = 0  # the axis of turn_to
OTHER_CLIENT = next(code for code, (name, _) in CAUSES.items() if name == "other_client")
DRIVE_OFF = ("off", "faulted")  # states of an axis
CLAIM_S = 2.0  # of the time of the bus: so long a claim holds while nothing moves
POLL_S = 0.02  # between two looks at an axis whose client has left, of the time of the bus
SILENCE_S = 0.5  # of the time of the bus: a node that has been silent so long is given up

# address, and a body without its sequence number: the reply of the node without its sequence
# number, None if it does not answer
Ask = Callable[[int, bytes], bytes | None]
Place = tuple[int, int]  # address of a node, number of an axis
Reply = bytes | None


@dataclass
class Farewell:
    """What is left to do for an axis whose client has left."""

    client: Hashable
    place: Place
    due: float  # time of the bus
    silent_since: float | None = None  # the node has not answered since this time


class Arbiter:
    """The rights of all clients of a bus. A client is anything that can be a key."""

    def __init__(self, ask: Ask, now: Callable[[], float]):
        self.ask, self.now = ask, now
        self.moved_by: dict[Place, Hashable] = {}  # the client that began the last motion
        self.switched_on_by: dict[Place, Hashable] = {}
        self.claimed_until: dict[Place, float] = {}  # time of the bus
        # by node and one of RECORDS: the client that armed this recorder last
        self.recorder_of: dict[tuple[int, str], Hashable] = {}
        # the last request of a client to a node, with its reply
        self.last: dict[tuple[Hashable, int], tuple[bytes, bytes]] = {}
        self.farewells: list[Farewell] = []
        self.pairs = WordPairs(ask)

    # requests

    def answer(self, client: Hashable, address: int, body: bytes) -> Reply:
        """The body of the reply to a request; None if the node does not answer."""
        operation = operation_of(body)
        known, reply = self.last.get((client, address), (b"", b""))
        if body == known and operation != "follow":  # each reply to follow has a new position
            return reply
        places = list(places_of(address, operation, body))
        if operation == "enable" and body[-1]:
            self.forget_switched_off(client, places[0])
        if is_motion(operation, body) and any(self.is_of_another(client, one) for one in places):
            answered: Reply = bytes([body[1], OTHER_CLIENT])
        else:
            answered = self.pairs.answer(client, address, operation, body)
        if answered is None:
            return None
        reply = body[:1] + answered
        self.last[client, address] = body, reply
        if accepted(reply):
            for place in places:
                self.note(client, place, operation, body)
        return reply

    def is_of_another(self, client: Hashable, place: Place) -> bool:
        """Whether the axis is in a motion that another client began."""
        owner = self.moved_by.get(place, client)
        if owner == client:
            return False
        if self.is_claimed(place) or self.state(place) in IN_MOTION:
            return True
        self.moved_by.pop(place)
        return False

    def forget_switched_off(self, client: Hashable, place: Place) -> None:
        """Before the client switches a drive on: a fault, or a loss of power, may have switched it
        off since another client switched it on. That one has nothing to switch off any more.
        """
        if self.switched_on_by.get(place, client) != client and self.state(place) in DRIVE_OFF:
            self.switched_on_by.pop(place)

    def claim(self, client: Hashable, place: Place) -> None:
        """The axis belongs to this client now, while it moves and for CLAIM_S from now on."""
        self.moved_by[place] = client
        self.claimed_until[place] = self.now() + CLAIM_S

    def is_claimed(self, place: Place) -> bool:
        """Whether a claim holds."""
        return self.now() < self.claimed_until.get(place, 0.0)

    def note(self, client: Hashable, place: Place, operation: str, body: bytes) -> None:
        """The node has accepted this request for the axis."""
        if operation in RECORDS:
            self.recorder_of[place[0], operation] = client
        if is_motion(operation, body):
            self.moved_by[place] = client
            self.claimed_until.pop(place, None)
        elif operation == "enable" and body[-1]:
            self.switched_on_by.setdefault(place, client)
        elif operation == "enable":
            self.switched_on_by.pop(place, None)
            if not self.is_claimed(place):
                self.moved_by.pop(place, None)

    def state(self, place: Place) -> str | None:
        """The name of the state of an axis; None if the node does not answer."""
        body = self.ask(place[0], request("status", axis=place[1]))
        reply = body and parse_reply(b"\0" + body)
        return STATES[reply.fields["state"]][0] if reply and reply.fields else None

    # clients that leave

    def depart(self, client: Hashable) -> None:
        """A client has left: its axes have to be stopped and switched off."""
        self.last = {key: value for key, value in self.last.items() if key[0] != client}
        self.pairs.forget(client)
        self.recorder_of = {key: one for key, one in self.recorder_of.items() if one != client}
        owned = {*self.moved_by.items(), *self.switched_on_by.items()}
        for place in sorted({place for place, owner in owned if owner == client}):
            self.farewells.append(Farewell(client, place, self.now()))

    def see_off(self) -> None:
        """Sends the next request that is due for an axis whose client has left, if there is one."""
        due = [farewell for farewell in self.farewells if farewell.due <= self.now()]
        if not due:
            return
        farewell = min(due, key=lambda one: one.due)
        place, state, now = farewell.place, self.state(farewell.place), self.now()
        if state is not None:
            farewell.silent_since = None
        elif farewell.silent_since is None:
            farewell.silent_since = now
        if farewell.silent_since is not None and now - farewell.silent_since < SILENCE_S:
            farewell.due = now + POLL_S
            return
        if state in IN_MOTION and self.moved_by.get(place) == farewell.client:
            if state != "stopping":
                self.ask(place[0], request("stop", axis=place[1]))
            farewell.due = self.now() + POLL_S
            return
        self.farewells.remove(farewell)
        self.give_up(farewell.client, place, moves=state in IN_MOTION)

    def give_up(self, client: Hashable, place: Place, moves: bool) -> None:
        """The client has no right to the axis any more, which it does not move."""
        if self.moved_by.get(place) == client:
            self.moved_by.pop(place)
            self.claimed_until.pop(place, None)
        if self.switched_on_by.get(place) != client:
            return
        if place in self.moved_by and (moves or self.is_claimed(place)):
            # another client needs the drive, and now has to switch it off
            self.switched_on_by[place] = self.moved_by[place]
        else:
            self.switched_on_by.pop(place)
            self.ask(place[0], request("enable", axis=place[1], on=0))


# ------------------------------------------------------------------ registers of 64 bits

REGISTER_BYTES = 4
LOW_WORDS = frozenset(
    field.address(axis)
    for field in FIELDS
    if field.low + field.width > 32
    for axis in range(MOST_AXES if BLOCKS[field.block][1] else 1)
)


class WordPairs:
    """Keeps the two words of a register of 64 bits together. A node latches the high word when the
    low one is read, and stores the low word when the high one is written; in between, the same
    register or another one may be accessed for another client.
    """

    def __init__(self, ask: Ask):
        self.ask = ask
        # by client, node and register: the reply with the high word, read together with the low one
        self.high_words: dict[tuple[Hashable, int, int], bytes] = {}
        # by client and node: register and request of the low word that was written last
        self.low_words: dict[tuple[Hashable, int], tuple[int, bytes]] = {}
        self.low_word_of: dict[int, Hashable] = {}  # by node: who wrote the last low word

    def answer(self, client: Hashable, address: int, operation: str, body: bytes) -> Reply:
        """The reply of the node to any request, without its sequence number."""
        if operation not in ("read_register", "write_register"):
            return self.ask(address, body[1:])
        register = fields_of(operation, body)["address"]
        if operation == "read_register":
            return self.read(client, address, register)
        return self.write(client, address, register, body[1:])

    def read(self, client: Hashable, address: int, register: int) -> Reply:
        """One word; after a low word the high one is already here."""
        known = self.high_words.pop((client, address, register), None)
        if known is not None:
            return known
        low = self.ask(address, request("read_register", address=register))
        if low is not None and register in LOW_WORDS:
            high = self.ask(address, request("read_register", address=register + REGISTER_BYTES))
            if high is not None:
                self.high_words[client, address, register + REGISTER_BYTES] = high
        return low

    def write(self, client: Hashable, address: int, register: int, body: bytes) -> Reply:
        """One word; before a high word, the low one again if another client has written since."""
        if register in LOW_WORDS:
            self.low_words[client, address] = register, body
            self.low_word_of[address] = client
        elif self.low_word_of.get(address, client) != client:
            low, low_body = self.low_words.get((client, address), (None, b""))
            if low == register - REGISTER_BYTES:
                self.ask(address, low_body)
                self.low_word_of[address] = client
        return self.ask(address, body)

    def forget(self, client: Hashable) -> None:
        """A client has left."""
        self.high_words = {key: word for key, word in self.high_words.items() if key[0] != client}
        self.low_words = {key: word for key, word in self.low_words.items() if key[0] != client}


# ------------------------------------------------------------------ bodies


def operation_of(body: bytes) -> str:
    """The name of the operation of a request; empty if there is none of its code and length."""
    name = NAMES.get(body[1], "") if len(body) > 1 else ""
    return name if name and len(body) == 2 + REQUESTS[name].size else ""


def request(operation: str, **fields: int) -> bytes:
    """The body of a request without its sequence number."""
    return request_body(operation, 0, **fields)[1:]


def fields_of(operation: str, body: bytes) -> dict[str, int]:
    """The fields of the body of a request, by name."""
    names = [name for name, _ in OPERATIONS[operation].request]
    return dict(zip(names, REQUESTS[operation].unpack(body[2:])))


def places_of(address: int, operation: str, body: bytes) -> Iterator[Place]:
    """The axes that a request is for."""
    if not operation:
        return
    fields = fields_of(operation, body)
    if operation == "turn_to":
        yield address, TABLE_AXIS
    elif "axis" in fields:
        yield address, fields["axis"]
    elif "axes" in fields:
        yield from ((address, axis) for axis in range(MOST_AXES) if fields["axes"] >> axis & 1)


def is_motion(operation: str, body: bytes) -> bool:
    """Whether a request begins a motion: a scope without an amplitude only looks, and without a
    period an excitation ends.
    """
    if operation == "arm_scope":
        return fields_of(operation, body)["amplitude"] != 0
    if operation == "excite":
        return fields_of(operation, body)["period"] != 0
    return operation in MOTIONS


def accepted(body: bytes) -> bool:
    """Whether a reply has the cause ok."""
    reply = parse_reply(body)
    return reply is not None and reply.cause == 0


def is_urgent(body: bytes) -> bool:
    """Whether a request stops an axis or switches a drive off: it goes ahead of all others."""
    operation = operation_of(body)
    return operation == "stop" or operation == "enable" and not body[-1]

# SPDX-License-Identifier: Apache-2.0
"""The server of RFC 2217 (a serial port over Telnet) without any input or output.

It takes the bytes of a client, and returns characters and answers.

Each character carries the parity that was in force when it was sent, so that a change of parity
needs no waiting. The PortManager of pyserial has no such thing; it also raises struct.error on a
sub-negotiation that is cut short, and stores one of any length.
"""

from collections.abc import Callable
from typing import NamedTuple

SE, SB, WILL, WONT, DO, DONT, IAC = 0xF0, 0xFA, 0xFB, 0xFC, 0xFD, 0xFE, 0xFF
BINARY, SUPPRESS_GO_AHEAD, COM_PORT = 0, 3, 44
ACCEPTED = (BINARY, SUPPRESS_GO_AHEAD, COM_PORT)

SET_BAUDRATE, SET_DATASIZE, SET_PARITY, SET_STOPSIZE, SET_CONTROL = 1, 2, 3, 4, 5
SET_LINESTATE_MASK, SET_MODEMSTATE_MASK, PURGE = 10, 11, 12
NOTIFY_MODEMSTATE = 7
OF_SERVER = 100  # added to the number of a command in its answer
PARITIES = {1: "N", 2: "O", 3: "E", 4: "M", 5: "S"}
READY_STATE = 0xB0  # carrier, DSR and CTS are on
LONGEST_OPTION = 16  # bytes of a sub-negotiation; all known ones are shorter


class Character(NamedTuple):
    """One byte, and the parity with which the client sent it."""

    byte: int
    parity: str  # N, O, E, M or S

    @property
    def ninth(self) -> int:
        """The parity bit on the bus, which is the 9th bit of the word."""
        ones = self.byte.bit_count() & 1
        return {"M": 1, "E": ones, "O": ones ^ 1}.get(self.parity, 0)


def escaped(data: bytes) -> bytes:
    """The bytes of Telnet that bring this data to the client."""
    return data.replace(b"\xff", b"\xff\xff")


class Server:
    """The connection to one client: feed() returns its characters, take_answers() the answers."""

    def __init__(self, baud: int):
        self.settings = {
            SET_BAUDRATE: baud.to_bytes(4, "big"),
            SET_DATASIZE: b"\x08",
            SET_PARITY: b"\x01",
            SET_STOPSIZE: b"\x01",
        }
        self.parity = "N"
        self.answers = bytearray()
        self.agreed: set[tuple[int, int]] = set()  # answers to options that were already given
        self.state: Callable[[int, list[Character]], None] = self.plain
        self.option: bytearray | None = None  # the sub-negotiation that is arriving

    def feed(self, arrived: bytes) -> list[Character]:
        """Takes bytes of the client; returns the characters among them."""
        characters: list[Character] = []
        for byte in arrived:
            self.state(byte, characters)
        return characters

    def take_answers(self) -> bytes:
        """The answers since the last call."""
        answers, self.answers = bytes(self.answers), bytearray()
        return answers

    # states: each takes one byte

    def plain(self, byte: int, characters: list[Character]) -> None:
        """The byte is data unless it begins a command."""
        if byte == IAC:
            self.state = self.command
        else:
            self.data(byte, characters)

    def data(self, byte: int, characters: list[Character]) -> None:
        """The byte is a character, or part of a sub-negotiation."""
        if self.option is None:
            characters.append(Character(byte, self.parity))
        elif len(self.option) <= LONGEST_OPTION:
            self.option.append(byte)

    def command(self, byte: int, characters: list[Character]) -> None:
        """The byte follows an IAC."""
        self.state = self.plain
        if byte == IAC:
            self.data(byte, characters)
        elif byte == SB:
            self.option = bytearray()
        elif byte == SE:
            option, self.option = self.option, None
            if option and option[0] == COM_PORT and 1 < len(option) <= LONGEST_OPTION:
                self.com_port(option[1], bytes(option[2:]))
        elif byte in (WILL, WONT, DO, DONT):
            self.state = {WILL: self.will, DO: self.do}.get(byte, self.no)

    def will(self, option: int, _: list[Character]) -> None:
        """The client offers an option."""
        self.agree(DO if option in ACCEPTED else DONT, option)

    def do(self, option: int, _: list[Character]) -> None:
        """The client asks for an option."""
        self.agree(WILL if option in ACCEPTED else WONT, option)

    def no(self, option: int, _: list[Character]) -> None:
        """The client refuses an option: nothing changes."""
        self.state = self.plain

    def agree(self, verb: int, option: int) -> None:
        """Answers an option, once only: two sides that repeat their answers would never end."""
        self.state = self.plain
        if (verb, option) not in self.agreed:
            self.agreed.add((verb, option))
            self.answers += bytes([IAC, verb, option])

    # the port

    def com_port(self, command: int, value: bytes) -> None:
        """A command of RFC 2217: sets the port where needed, and answers."""
        if command in self.settings:
            # a value of zero asks for the present one
            if len(value) == len(self.settings[command]) and any(value):
                self.settings[command] = value
                self.parity = PARITIES.get(self.settings[SET_PARITY][0], "N")
            value = self.settings[command]
        elif command not in (SET_CONTROL, SET_LINESTATE_MASK, SET_MODEMSTATE_MASK, PURGE):
            return
        self.answer(command, value)
        if command == SET_MODEMSTATE_MASK:
            self.answer(NOTIFY_MODEMSTATE, bytes([READY_STATE]))

    def answer(self, command: int, value: bytes) -> None:
        """Answers a command."""
        self.answers += (
            bytes([IAC, SB, COM_PORT, OF_SERVER + command]) + escaped(value) + bytes([IAC, SE])
        )

    @property
    def baud(self) -> int:
        """The rate that the client has set."""
        return int.from_bytes(self.settings[SET_BAUDRATE], "big")

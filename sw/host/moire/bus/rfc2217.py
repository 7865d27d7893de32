# SPDX-License-Identifier: Apache-2.0
"""The server's side of RFC 2217 (a serial port over Telnet) without any input or output: bytes in,
characters and answers out.

Every character comes out with the parity that was in force when it was sent, so a change of parity
costs nothing.
"""

from typing import NamedTuple

SE, SB, WILL, WONT, DO, DONT, IAC = 0xF0, 0xFA, 0xFB, 0xFC, 0xFD, 0xFE, 0xFF
BINARY, SUPPRESS_GO_AHEAD, COM_PORT = 0, 3, 44
TAKEN = (BINARY, SUPPRESS_GO_AHEAD, COM_PORT)

SET_BAUDRATE, SET_DATASIZE, SET_PARITY, SET_STOPSIZE, SET_CONTROL = 1, 2, 3, 4, 5
SET_LINESTATE_MASK, SET_MODEMSTATE_MASK, PURGE = 10, 11, 12
NOTIFY_MODEMSTATE = 7
OF_SERVER = 100  # added to the number of a command in its answer
PARITIES = {1: "N", 2: "O", 3: "E", 4: "M", 5: "S"}
READY_STATE = 0xB0  # carrier, DSR and CTS are there
LONGEST_ASKED = 16  # bytes of a sub-negotiation; all that is known is shorter


class Character(NamedTuple):
    byte: int
    parity: str  # N, O, E, M or S

    @property
    def ninth(self) -> int:
        ones = self.byte.bit_count() & 1
        return {"M": 1, "E": ones, "O": ones ^ 1}.get(self.parity, 0)


def escaped(data: bytes) -> bytes:
    """What the client is to receive, as Telnet has it."""
    return data.replace(b"\xff", b"\xff\xff")


class Server:
    """feed() returns the characters of the client and puts what it is to be answered into
    `answers`.
    """

    def __init__(self, baud: int):
        self.settings = {
            SET_BAUDRATE: baud.to_bytes(4, "big"),
            SET_DATASIZE: b"\x08",
            SET_PARITY: b"\x01",
            SET_STOPSIZE: b"\x01",
        }
        self.parity = "N"
        self.answers = bytearray()
        self.said = set()  # options that this side has spoken of
        self.state, self.asked = self.plain, None

    def feed(self, arrived: bytes) -> list:
        characters = []
        for byte in arrived:
            self.state(byte, characters)
        return characters

    def take_answers(self) -> bytes:
        answers, self.answers = bytes(self.answers), bytearray()
        return answers

    # states; `asked` holds a sub-negotiation while it comes

    def plain(self, byte, characters):
        if byte == IAC:
            self.state = self.command
        else:
            self.keep(byte, characters)

    def keep(self, byte, characters):
        if self.asked is None:
            characters.append(Character(byte, self.parity))
        elif len(self.asked) <= LONGEST_ASKED:
            self.asked.append(byte)

    def command(self, byte, characters):
        self.state = self.plain
        if byte == IAC:
            self.keep(byte, characters)
        elif byte == SB:
            self.asked = bytearray()
        elif byte == SE:
            asked, self.asked = self.asked, None
            if asked and asked[0] == COM_PORT and 1 < len(asked) <= LONGEST_ASKED:
                self.com_port(asked[1], bytes(asked[2:]))
        elif byte in (WILL, WONT, DO, DONT):
            self.state = {WILL: self.will, DO: self.do}.get(byte, self.no)

    def will(self, option, _):
        self.agree(DO if option in TAKEN else DONT, option)

    def do(self, option, _):
        self.agree(WILL if option in TAKEN else WONT, option)

    def no(self, option, _):
        self.state = self.plain

    def agree(self, verb, option):
        """An answer once; a repeated one could go to and fro for ever."""
        self.state = self.plain
        if (verb, option) not in self.said:
            self.said.add((verb, option))
            self.answers += bytes([IAC, verb, option])

    # the port

    def com_port(self, command, value):
        if command in self.settings:
            if len(value) == len(self.settings[command]) and any(
                value
            ):  # zero asks for what is set
                self.settings[command] = value
                self.parity = PARITIES.get(self.settings[SET_PARITY][0], "N")
            value = self.settings[command]
        elif command not in (SET_CONTROL, SET_LINESTATE_MASK, SET_MODEMSTATE_MASK, PURGE):
            return
        self.tell(command, value)
        if command == SET_MODEMSTATE_MASK:
            self.tell(NOTIFY_MODEMSTATE, bytes([READY_STATE]))

    def tell(self, command, value):
        self.answers += (
            bytes([IAC, SB, COM_PORT, OF_SERVER + command]) + escaped(value) + bytes([IAC, SE])
        )

    @property
    def baud(self) -> int:
        return int.from_bytes(self.settings[SET_BAUDRATE], "big")

# SPDX-License-Identifier: Apache-2.0
"""Transports carry 9-bit words: a serial port with the 9th bit as parity, or any byte stream with
COBS packets (plain 8N1). A simulated machine brings its own.

    open_bus("/dev/ttyUSB0")         a serial port
    open_bus("rfc2217://host:2217")  a serial port over the network
    open_bus("socket://host:2218")   COBS packets over TCP
    open_bus("/dev/pts/5")           COBS packets over a pseudo terminal
    open_bus("twin:s2")              a simulated machine, in a checkout of Moire

Only transports wait; nothing else in the package does.
"""

import abc
import errno
import os
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from moire.bus.cobs import (
    FROM_SERVER,
    LONGEST_STUFFED,
    PacketReader,
    nobody_at,
    sealed,
    speed_in,
    speed_request,
)
from moire.bus.protocol import FROM_NODE, NINTH, ODD_ADDRESSES, TO_NODE, ready_byte
from moire.bus.twin_port import machine_of, open_twin
from moire.closing import Closing
from moire.errors import PortError

try:
    import termios

    TERMIOS_ERRORS: tuple[type[Exception], ...] = (termios.error,)  # this is no OSError
except ImportError:  # Windows
    TERMIOS_ERRORS = ()

BAUD = 115200
BITS = 11  # start, eight data, 9th, stop
CMSPAR_OF_LINUX = 0o10000000000
# one wait for a byte; pyserial configures the whole port again when its time-out changes, so this
# never changes
POLL_S = 0.005
BREAK_S = 0.01  # nodes need 2 ms
SERVER_S = 0.1  # of patience with a server that may be too old to say its speed
NETWORK_S = 0.1  # what a network may add to an answer, and to the gaps in it
PARITIES = ("auto", "mark", "odd", "none")
PARITY_OF_RFC2217 = {"O": b"\x02", "E": b"\x03", "M": b"\x04", "S": b"\x05"}

OpenPort = Callable[..., Any]  # as serial.serial_for_url
Result = TypeVar("Result")
Key = TypeVar("Key")


class Transport(Closing):
    """Sends and receives words from 0 to 511; bit 8 is the 9th bit.

    `character_s` is the time of one word. As a context manager it closes itself.
    """

    character_s = BITS / BAUD
    time_is_stopped = False  # true: time passes only in send, receive and wait
    handshake = True  # false: a request is sent as a whole, without the node's ready byte

    @abc.abstractmethod
    def send(self, words: Sequence[int]) -> None:
        """Sends words; returns when they are sent."""

    @abc.abstractmethod
    def receive(self, count: int, timeout_s: float) -> list[int]:
        """At most `count` words; fewer when `timeout_s` has passed."""

    @abc.abstractmethod
    def now(self) -> float:
        """Seconds since any beginning, of the time in which the machine lives."""

    @abc.abstractmethod
    def wait(self, seconds: float) -> None:
        """Lets time pass."""

    def reaches(self, address: int) -> bool:
        """Whether this transport can call the address."""
        return True

    def set_baud(self, baud: int) -> None:
        """Sends and receives at this rate from now on."""
        self.character_s = BITS / baud

    def send_break(self) -> None:
        """Holds the bus low for BREAK_S, which returns every node to the rate after power-up.

        Nothing happens where no bus of nodes is at the other end.
        """

    def speed(self) -> float | None:
        """How fast the machine of a server runs, in simulated seconds per second of the clock; None
        where nothing is simulated, or it is not known.
        """
        return None

    def close(self) -> None:
        """Releases the port; the transport cannot be used any more."""


def open_bus(
    port: str, baud: int = BAUD, parity: str = "auto", open_port: OpenPort | None = None
) -> Transport:
    """The transport for a port; see the top of this file for the kinds of port.

    `parity` is as in SerialBus, or "none" for 8N1 with COBS packets; "auto" chooses that for
    socket:// and pseudo terminals, since those carry no parity. Raises PortError, or UnknownName
    for an unknown simulated machine.
    """
    if parity not in PARITIES:
        raise PortError(f"there is no parity '{parity}': allowed are {', '.join(PARITIES)}")
    if machine := machine_of(port):
        return open_twin(baud, machine)
    if parity == "none" or parity == "auto" and carries_bytes_only(port):
        return CobsBus(port, baud, open_port)
    return SerialBus(port, baud, parity, open_port)


def carries_bytes_only(port: str) -> bool:
    """Whether a port cannot carry a parity bit."""
    return port.startswith("socket://") or os.path.realpath(port).startswith("/dev/pts/")


class PortBus(Transport):
    """A port of pyserial: a local device, or a URL that pyserial knows."""

    def __init__(self, port: str, baud: int, open_port: OpenPort | None = None):
        self.name, self.character_s = port, BITS / baud
        self.network_s = NETWORK_S if "://" in port else 0.0
        self.port = self.open(port, baud, open_port)

    @staticmethod
    def open(port: str, baud: int, open_port: OpenPort | None) -> Any:
        """The open port of pyserial; raises PortError."""
        try:
            import serial
        except ImportError:
            raise PortError("the package pyserial is missing: pip install pyserial") from None
        arguments: dict[str, Any] = dict(baudrate=baud, bytesize=8, stopbits=1, timeout=POLL_S)
        if "://" not in port and open_port is None:
            # a second program on the bus would break the exchanges of both
            arguments["exclusive"] = True
        if open_port is None and port.startswith("socket://"):
            from moire.bus.tcp_port import TcpPort

            open_port = TcpPort
        try:
            return (open_port or serial.serial_for_url)(port, **arguments)
        except port_errors(ValueError) as error:
            raise PortError(refusal(port, baud, error)) from None

    def read(self, count: int, end: float) -> bytes:
        """At most `count` bytes, as soon as one is there or the moment `end` has come."""
        first: bytes = self.checked(lambda: self.port.read(1))
        while not first and time.monotonic() < end:
            first = self.checked(lambda: self.port.read(1))
        more = min(count - 1, self.checked(lambda: self.port.in_waiting)) if first else 0
        return first + self.checked(lambda: self.port.read(more)) if more > 0 else first

    def write(self, data: bytes) -> None:
        """Hands bytes to the port."""
        self.checked(lambda: self.port.write(data))

    def set_baud(self, baud: int) -> None:
        super().set_baud(baud)
        self.checked(lambda: setattr(self.port, "baudrate", baud))

    def now(self) -> float:
        return time.monotonic()

    def wait(self, seconds: float) -> None:
        if seconds > 0:
            time.sleep(seconds)

    def close(self) -> None:
        self.port.close()

    def checked(self, action: Callable[[], Result]) -> Result:
        """Calls `action`; a port that has vanished becomes a PortError."""
        try:
            return action()
        except port_errors() as error:
            raise PortError(f"the port {self.name} failed: {plain(error)}") from None


class SerialBus(PortBus):
    """A serial port that sends a parity bit, of which the 9th bit is made.

    parity "mark": MARK sends a 1, SPACE a 0; this reaches all addresses. "odd": odd or even
    parity, whichever gives the required bit; a command byte then needs an address with an odd
    number of ones (1, 2, 4, 7, 8, 11, 13, 14), as in S0. "auto" chooses "mark" where the port can
    do it. Received parity bits are not evaluated: a node never sets the 9th bit, and the CRC-32
    finds a wrong frame.
    """

    LATENCY_S = 0.002  # of a USB adapter, before the parity may change
    GAP_S = 0.02  # that an adapter may leave between two bytes of an answer
    # of a character: the driver of the node releases the bus after its last stop bit
    TURNAROUND = 2 / BITS

    def __init__(
        self,
        port: str,
        baud: int = BAUD,
        parity: str = "auto",
        open_port: OpenPort | None = None,
    ):
        if parity not in ("auto", "mark", "odd"):
            raise PortError(
                f"there is no parity '{parity}' with a 9th bit: allowed are auto, mark, odd"
            )
        super().__init__(port, baud, open_port)
        self.mark_and_space = parity != "odd" and self.can("M")
        if parity == "mark" and not self.mark_and_space:
            self.close()
            raise PortError(
                f"{port} has no MARK and SPACE parity: use parity odd with one of the addresses "
                f"{addresses(ODD_ADDRESSES)}"
            )
        if not self.mark_and_space and not self.can("O"):
            self.close()
            raise PortError(
                f"the port {port} sends no parity bit, which the bus needs as 9th bit: use parity "
                "none where COBS packets are spoken"
            )
        self.current: str | None = None  # the parity that was set last
        self.checked(self.port.reset_input_buffer)

    def can(self, parity: str) -> bool:
        """Whether the port really sends this parity."""
        try:
            self.port.parity = parity
        except port_errors(ValueError):
            return False
        return self.kernel_has(parity)

    def kernel_has(self, parity: str) -> bool:
        """Drivers without parity, or without MARK and SPACE, drop the flags without an error."""
        if not TERMIOS_ERRORS:
            return True
        try:
            flags = termios.tcgetattr(self.port.fileno())[2]
        except port_errors(AttributeError, ValueError):
            return True  # no local device: a URL
        cmspar: int = getattr(termios, "CMSPAR", CMSPAR_OF_LINUX)
        required = termios.PARENB | (cmspar if parity in "MS" else 0)
        return bool(flags & required == required)

    def reaches(self, address: int) -> bool:
        return self.mark_and_space or address in ODD_ADDRESSES

    def send_break(self) -> None:
        self.checked(lambda: self.port.send_break(BREAK_S))

    def parity_for(self, word: int) -> str:
        """The parity setting that sends the 9th bit of this word."""
        if self.mark_and_space:
            return "M" if word & NINTH else "S"
        ones, ninth = (word & 0xFF).bit_count() & 1, word >> 8
        return "O" if ones ^ 1 == ninth else "E"

    def send(self, words: Sequence[int]) -> None:
        for word in words:
            # the rule of S0: a command byte is sent with odd parity
            if word & NINTH and not self.mark_and_space and self.parity_for(word) != "O":
                raise PortError(
                    f"{self.name} has no MARK parity, and odd parity reaches only the addresses "
                    f"{addresses(ODD_ADDRESSES)}"
                )
        self.wait(self.TURNAROUND * self.character_s)
        for parity, part in runs(words, self.parity_for):
            self.set_parity(parity)
            began = time.monotonic()
            self.write(bytes(word & 0xFF for word in part))
            self.checked(self.port.flush)
            self.sleep_until(began + len(part) * self.character_s + self.LATENCY_S)

    def set_parity(self, parity: str) -> None:
        """Changes the parity of the port if it must change.

        Over RFC 2217, pyserial waits 0.15 s for the answer; the order in the stream suffices here.
        """
        if parity == self.current:
            return
        in_stream = getattr(self.port, "rfc2217_send_subnegotiation", None)
        if in_stream is None:
            self.checked(lambda: setattr(self.port, "parity", parity))
        else:
            self.checked(lambda: in_stream(b"\x03", PARITY_OF_RFC2217[parity]))
        self.current = parity

    def receive(self, count: int, timeout_s: float) -> list[int]:
        words: list[int] = []
        end = time.monotonic() + timeout_s + self.network_s
        while len(words) < count:
            arrived = self.read(count - len(words), end)
            if not arrived:
                break
            words += arrived
            # an adapter or a network may leave gaps
            end = max(end, time.monotonic() + self.GAP_S + self.network_s)
        return words

    def sleep_until(self, moment: float) -> None:
        """Waits until time.monotonic() has reached `moment`."""
        self.wait(moment - time.monotonic())


class CobsBus(PortBus):
    """A stream of plain bytes with COBS packets.

    What is sent between two command bytes becomes one packet, and received packets are unpacked.
    Where the server says that its simulated machine runs slowly, a reply has so much more time;
    where it says that no node has identified itself, none.
    """

    handshake = False
    SLOWEST = 0.01  # simulated seconds per second for which a reply is waited for

    def __init__(self, port: str, baud: int = BAUD, open_port: OpenPort | None = None):
        super().__init__(port, baud, open_port)
        self.packets = PacketReader()
        self.arrived: list[int] = []
        self.request = bytearray()
        self.awaited: int | None = None  # first byte of the reply that is awaited
        self.said: float | None = None  # the speed that the server has said last
        self.has_said = False
        self.checked(self.port.reset_input_buffer)

    def send(self, words: Sequence[int]) -> None:
        for word in words:
            if word & NINTH == 0:
                self.request.append(word)
            elif word >> 4 & 3 == TO_NODE:
                self.request = bytearray([word & 0xFF])
            else:
                self.arrived, self.awaited = [], ready_byte(word & 0xF, FROM_NODE)
                self.write(sealed(bytes(self.request)))

    def receive(self, count: int, timeout_s: float) -> list[int]:
        began = time.monotonic()

        def complete() -> bool:
            return len(self.arrived) >= count or self.awaited is None

        if not self.take(began + timeout_s + self.network_s, complete):
            share = min(1.0, max(self.speed() or 1.0, self.SLOWEST))
            self.take(began + timeout_s / share + self.network_s, complete)
        words, self.arrived = self.arrived[:count], self.arrived[count:]
        return words

    def take(self, end: float, complete: Callable[[], bool]) -> bool:
        """Takes packets until this is complete; false if it is not until the moment `end`."""
        while not complete():
            data = self.read(LONGEST_STUFFED, end)
            if not data:
                return False
            for content in self.packets.feed(data):
                if (address := nobody_at(content)) is not None:
                    if self.awaited == ready_byte(address, FROM_NODE):
                        self.arrived, self.awaited = [], None
                elif content[0] == FROM_SERVER:
                    self.said, self.has_said = speed_in(content), True
                elif content[0] == self.awaited:
                    self.arrived, self.awaited = list(content), None
        return True

    def speed(self) -> float | None:
        self.said, self.has_said = None, False
        self.write(speed_request(0))
        self.take(time.monotonic() + SERVER_S + self.network_s, lambda: self.has_said)
        return self.said


def port_errors(*more: type[Exception]) -> tuple[type[Exception], ...]:
    """The exceptions that a port may raise, and `more`."""
    import serial

    return (serial.SerialException, OSError, *TERMIOS_ERRORS, *more)


def runs(words: Iterable[int], key: Callable[[int], Key]) -> list[tuple[Key, list[int]]]:
    """Neighbouring words with the same key, together."""
    parts: list[tuple[Key, list[int]]] = []
    for word in words:
        if parts and parts[-1][0] == key(word):
            parts[-1][1].append(word)
        else:
            parts.append((key(word), [word]))
    return parts


def addresses(several: Iterable[int]) -> str:
    """Addresses as text."""
    return ", ".join(map(str, several))


def plain(error: Exception) -> str:
    """The text of an exception, in one line."""
    return getattr(error, "strerror", None) or str(error).splitlines()[0].rstrip(".")


def refusal(port: str, baud: int, error: Exception) -> str:
    """Why a port did not open, in one sentence."""
    number, words = getattr(error, "errno", None), str(error).lower()
    if number == errno.ENOENT or "no such file" in words or "filenotfounderror" in words:
        return f"there is no port {port}"
    if "connection refused" in words or "timed out" in words:
        return f"nobody listens at {port}: is the server there, such as 'moire twin'?"
    in_use = any(sign in words for sign in ("exclusively lock", "busy", "access is denied"))
    if in_use or number in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        return f"the port {port} is in use by another program"
    if number in (errno.EACCES, errno.EPERM) or "permission denied" in words:
        return (
            f"no permission to use the port {port}: on Linux, join the group dialout and log in "
            "again"
        )
    if "baud" in words:
        return f"the port {port} cannot do {baud} baud"
    return f"the port {port} does not open: {plain(error)}"

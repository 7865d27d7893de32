# SPDX-License-Identifier: Apache-2.0
"""What carries 9-bit words: a serial port with the 9th bit as parity, or any byte stream with COBS
packets (plain 8N1).
A simulated machine brings its own (twin.TwinTransport).

    open_bus("/dev/ttyUSB0")  open_bus("rfc2217://host:2217")  open_bus("socket://host:2218")
    open_bus("/dev/pts/5")

Only transports wait; nothing else in the package does.
"""

import abc
import errno
import os
import time

try:
    import termios
except ImportError:  # not here: Windows
    termios = None

from moire.bus.cobs import LONGEST_STUFFED, PacketReader, sealed
from moire.bus.protocol import FROM_NODE, NINTH, ODD_ADDRESSES, TO_NODE, ready_byte
from moire.errors import PortError

BAUD = 115200
BITS = 11  # start, eight data, 9th, stop
CMSPAR_OF_LINUX = 0o10000000000
# one wait for a byte; pyserial sets the whole port again when its time-out changes, so this stays
POLL_S = 0.005
BREAK_S = 0.01  # nodes want 2 ms
NETWORK_S = 0.1  # what a network may add to an answer, and to the gaps in it
PARITIES = ("auto", "mark", "odd", "none")
PARITY_OF_RFC2217 = {"O": b"\x02", "E": b"\x03", "M": b"\x04", "S": b"\x05"}


class Transport(abc.ABC):
    """A word is 0…511, bit 8 is the 9th bit. `character_s` is the time that one takes."""

    character_s = BITS / BAUD
    time_is_stopped = False  # true: time passes only in send, receive and wait
    handshake = True  # false: a request goes out as a whole, without the node's ready byte

    @abc.abstractmethod
    def send(self, words):
        """Returns when the words are on their way."""

    @abc.abstractmethod
    def receive(self, count: int, timeout_s: float) -> list:
        """At most `count` words; fewer when `timeout_s` has passed."""

    @abc.abstractmethod
    def now(self) -> float:
        """Seconds since any beginning, of the time in which the machine lives."""

    @abc.abstractmethod
    def wait(self, seconds: float):
        """Let time pass."""

    def reaches(self, address: int) -> bool:
        """Whether this transport can call the address."""
        return True

    def set_baud(self, baud: int):
        """From here on at this rate."""
        self.character_s = BITS / baud

    def send_break(self):
        """The line low for BREAK_S: every node is at the first baud rate again. Nothing where no
        line of nodes is at the other end.
        """

    def close(self):
        """After this the transport is of no use any more."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def open_bus(port: str, baud: int = BAUD, parity: str = "auto", open_port=None) -> Transport:
    """The transport for a port. parity: as in SerialBus; "none": 8N1 with COBS packets, which
    "auto" takes for socket:// and
    pseudo terminals, since those carry no parity."""
    if parity not in PARITIES:
        raise PortError(f"there is no parity '{parity}': allowed are {', '.join(PARITIES)}")
    if parity == "none" or parity == "auto" and carries_bytes_only(port):
        return CobsBus(port, baud, open_port)
    return SerialBus(port, baud, parity, open_port)


def carries_bytes_only(port: str) -> bool:
    return port.startswith("socket://") or os.path.realpath(port).startswith("/dev/pts/")


class PortBus(Transport):
    """A port through pyserial: a local device, or a URL that pyserial knows."""

    def __init__(self, port: str, baud: int, open_port=None):
        self.name, self.character_s = port, BITS / baud
        self.network_s = NETWORK_S if "://" in port else 0.0
        self.port = self.open(port, baud, open_port)

    @staticmethod
    def open(port, baud, open_port):
        try:
            import serial
        except ImportError:
            raise PortError("the package pyserial is missing: pip install pyserial") from None
        try:
            # a second program on the line would break the exchanges of both
            arguments = dict(baudrate=baud, bytesize=8, stopbits=1, timeout=POLL_S)
            if "://" not in port and open_port is None:
                arguments["exclusive"] = True
            return (open_port or serial.serial_for_url)(port, **arguments)
        except (ValueError, *port_errors()) as error:
            raise PortError(refusal(port, baud, error)) from None

    def read(self, count: int, end: float) -> bytes:
        """At most `count` bytes, once one is there or `end` has come."""
        first = self.checked(self.port.read, 1)
        while not first and time.monotonic() < end:
            first = self.checked(self.port.read, 1)
        more = min(count - 1, self.checked(lambda: self.port.in_waiting)) if first else 0
        return first + self.checked(self.port.read, more) if more > 0 else first

    def set_baud(self, baud):
        super().set_baud(baud)
        self.checked(setattr, self.port, "baudrate", baud)

    def now(self):
        return time.monotonic()

    def wait(self, seconds):
        if seconds > 0:
            time.sleep(seconds)

    def close(self):
        self.port.close()

    def checked(self, action, *arguments):
        """A port that vanishes is one clear sentence too."""
        try:
            return action(*arguments)
        except port_errors() as error:
            raise PortError(f"the port {self.name} failed: {plain(error)}") from None


class SerialBus(PortBus):
    """A serial port that sends a parity bit; the 9th bit is made of it.

    parity "mark": MARK sends a 1, SPACE a 0: all addresses. "odd": odd or even parity, whichever
    gives the bit that is
    wanted; a command byte then needs an address with an odd number of ones (1, 2, 4, 7, 8, 11, 13,
    14), as in S0.
    "auto" takes "mark" where the port can do it. Received parity bits are not looked at: a node
    never sets the 9th bit,
    and the CRC-32 tells a wrong frame.
    """

    LATENCY_S = 0.002  # a USB adapter's own, before the parity may change
    GAP_S = 0.02  # that an adapter may leave between two bytes of an answer
    TURNAROUND = (
        2 / BITS
    )  # of a character: the node's driver lets go of the line after its last stop bit

    def __init__(self, port: str, baud: int = BAUD, parity: str = "auto", open_port=None):
        if parity not in ("auto", "mark", "odd"):
            raise PortError(
                f"there is no parity '{parity}' with a 9th bit: allowed are auto, mark, odd"
            )
        super().__init__(port, baud, open_port)
        self.sync = parity != "odd" and self.can("M")
        if parity == "mark" and not self.sync:
            self.close()
            raise PortError(
                f"{port} has no MARK and SPACE parity: use parity odd with one of the addresses {addresses(ODD_ADDRESSES)}"
            )
        if not self.sync and not self.can("O"):
            self.close()
            raise PortError(
                f"the port {port} sends no parity bit, which the line needs as 9th bit: use parity none where COBS packets "
                "are spoken"
            )
        self.current = None
        self.checked(self.port.reset_input_buffer)

    def can(self, parity: str) -> bool:
        """Whether the port really sends this parity."""
        try:
            self.port.parity = parity
        except (ValueError, *port_errors()):
            return False
        return self.kernel_kept(parity)

    def kernel_kept(self, parity: str) -> bool:
        """Drivers without parity, or without MARK and SPACE, drop the flags without an error."""
        if termios is None:
            return True
        try:
            flags = termios.tcgetattr(self.port.fileno())[2]
        except (AttributeError, ValueError, *port_errors()):
            return True  # no local device: a URL
        wanted = termios.PARENB | (
            getattr(termios, "CMSPAR", CMSPAR_OF_LINUX) if parity in "MS" else 0
        )
        return flags & wanted == wanted

    def reaches(self, address):
        return self.sync or address in ODD_ADDRESSES

    def send_break(self):
        self.checked(self.port.send_break, BREAK_S)

    def parity_for(self, word: int) -> str:
        """The parity setting that sends the 9th bit of this word."""
        if self.sync:
            return "M" if word & NINTH else "S"
        ones, ninth = (word & 0xFF).bit_count() & 1, word >> 8
        return "O" if ones ^ 1 == ninth else "E"

    def send(self, words):
        for word in words:
            # S0's rule: a command byte goes out with odd parity
            if word & NINTH and not self.sync and self.parity_for(word) != "O":
                raise PortError(
                    f"{self.name} has no MARK parity, and odd parity reaches only the addresses {addresses(ODD_ADDRESSES)}"
                )
        self.wait(self.TURNAROUND * self.character_s)
        for parity, part in runs(words, self.parity_for):
            self.checked(self.set_parity, parity)
            began = time.monotonic()
            self.checked(self.port.write, bytes(word & 0xFF for word in part))
            self.checked(self.port.flush)
            self.sleep_until(began + len(part) * self.character_s + self.LATENCY_S)

    def set_parity(self, parity: str):
        """pyserial's own way over RFC 2217 polls for the answer and costs 0.15 s; the order in the
        stream is all that is needed.
        """
        if parity == self.current:
            return
        in_stream = getattr(self.port, "rfc2217_send_subnegotiation", None)
        if in_stream is None:
            self.port.parity = parity
        else:
            in_stream(b"\x03", PARITY_OF_RFC2217[parity])
        self.current = parity

    def receive(self, count, timeout_s):
        """The patience begins anew with every byte that comes: an adapter or a network may leave
        gaps.
        """
        words, end = [], time.monotonic() + timeout_s + self.network_s
        while len(words) < count:
            arrived = self.read(count - len(words), end)
            if not arrived:
                break
            words += arrived
            end = max(end, time.monotonic() + self.GAP_S + self.network_s)
        return words

    def sleep_until(self, moment: float):
        self.wait(moment - time.monotonic())


class CobsBus(PortBus):
    """A stream of plain bytes with COBS packets: what stands between two command bytes goes out as
    one, and what comes is unpacked.
    """

    handshake = False

    def __init__(self, port: str, baud: int = BAUD, open_port=None):
        super().__init__(port, baud, open_port)
        self.packets, self.arrived = PacketReader(), []
        self.asked, self.awaited = bytearray(), None
        self.checked(self.port.reset_input_buffer)

    def send(self, words):
        for word in words:
            if word & NINTH == 0:
                self.asked.append(word)
            elif word >> 4 & 3 == TO_NODE:
                self.asked = bytearray([word & 0xFF])
            else:
                self.arrived, self.awaited = [], ready_byte(word & 0xF, FROM_NODE)
                self.checked(self.port.write, sealed(bytes(self.asked)))

    def receive(self, count, timeout_s):
        end = time.monotonic() + timeout_s + self.network_s
        while len(self.arrived) < count and self.awaited is not None:
            bytes_arrived = self.read(LONGEST_STUFFED, end)
            if not bytes_arrived:
                break
            for content in self.packets.feed(bytes_arrived):
                if content[0] == self.awaited:
                    self.arrived, self.awaited = list(content), None
        words, self.arrived = self.arrived[:count], self.arrived[count:]
        return words


def port_errors() -> tuple:
    """What a port may raise; termios.error is no OSError."""
    import serial

    return (
        (serial.SerialException, OSError)
        if termios is None
        else (serial.SerialException, OSError, termios.error)
    )


def runs(words, key):
    """Neighbours with the same key, together."""
    parts = []
    for word in words:
        if parts and parts[-1][0] == key(word):
            parts[-1][1].append(word)
        else:
            parts.append((key(word), [word]))
    return parts


def addresses(several) -> str:
    return ", ".join(map(str, several))


def plain(error) -> str:
    return getattr(error, "strerror", None) or str(error).splitlines()[0].rstrip(".")


def refusal(port: str, baud: int, error) -> str:
    """Why a port did not open."""
    number, words = getattr(error, "errno", None), str(error).lower()
    if number == errno.ENOENT or "no such file" in words or "filenotfounderror" in words:
        return f"there is no port {port}"
    if "connection refused" in words or "timed out" in words:
        return f"nobody listens at {port}: is the server there, such as 'moire twin'?"
    in_use = any(sign in words for sign in ("exclusively lock", "busy", "access is denied"))
    if in_use or number in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        return f"the port {port} is in use by another program"
    if number in (errno.EACCES, errno.EPERM) or "permission denied" in words:
        return f"no permission to use the port {port}: on Linux, join the group dialout and log in again"
    if "baud" in words:
        return f"the port {port} cannot do {baud} baud"
    return f"the port {port} does not open: {plain(error)}"

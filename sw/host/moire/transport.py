# SPDX-License-Identifier: Apache-2.0
"""What carries 9-bit words. Here: the serial line; the simulated stage brings its own (twin.TwinTransport).

Only transports wait; nothing else in the package does.
"""
import abc
import errno
import time

try:
    import termios
except ImportError:              # not here: Windows
    termios = None

from .errors import PortError
from .protocol import NINTH, ODD_ADDRESSES

BAUD = 115200
BITS = 11                    # start, eight data, 9th, stop
CMSPAR_OF_LINUX = 0o10000000000


class Transport(abc.ABC):
    """A word is 0…511, bit 8 is the 9th bit. `character_s` is the time that one takes."""

    character_s = BITS / BAUD
    time_stands = False          # true: time passes only in send, receive and wait

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

    def close(self):
        """After this the transport is of no use any more."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class SerialLine(Transport):
    """A serial port through pyserial; the 9th bit is made of the parity bit.

    parity "mark": MARK sends a 1, SPACE a 0: all addresses. "odd": odd or even parity, whichever gives the bit that is
    wanted; a command byte then needs an address with an odd number of ones (1, 2, 4, 7, 8, 11, 13, 14), as in S0.
    "auto" takes "mark" where the port can do it. Received parity bits are not looked at: a node never sets the 9th bit,
    and the CRC-32 tells a wrong frame.
    """

    LATENCY_S = 0.002        # a USB adapter's own, before the parity may change
    TURNAROUND = 2 / BITS    # of a character: the node's driver lets go of the line after its last stop bit

    def __init__(self, port: str, baud: int = BAUD, parity: str = "auto", open_port=None):
        if parity not in ("auto", "mark", "odd"):
            raise PortError(f"there is no parity '{parity}': allowed are auto, mark, odd")
        self.name, self.character_s = port, BITS / baud
        self.port = self.open(port, baud, open_port)
        self.mark = parity != "odd" and self.can("M")
        if parity == "mark" and not self.mark:
            self.close()
            raise PortError(f"{port} has no MARK and SPACE parity: use parity odd with one of the addresses {addresses(ODD_ADDRESSES)}")
        if not self.mark and not self.can("O"):
            self.close()
            raise PortError(f"the port {port} sends no parity bit, which the line needs as 9th bit: a pseudo terminal does not do")
        self.current = None
        self.guarded(self.port.reset_input_buffer)

    @staticmethod
    def open(port, baud, open_port):
        try:
            import serial
        except ImportError:
            raise PortError("the package pyserial is missing: pip install pyserial") from None
        try:
            # a second program on the line would break the exchanges of both
            arguments = dict(baudrate=baud, bytesize=8, stopbits=1, timeout=0)
            if "://" not in port and open_port is None:
                arguments["exclusive"] = True
            return (open_port or serial.serial_for_url)(port, **arguments)
        except (ValueError, *port_errors()) as error:
            raise PortError(refusal(port, baud, error)) from None

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
            return True            # no local device: a URL
        wanted = termios.PARENB | (getattr(termios, "CMSPAR", CMSPAR_OF_LINUX) if parity in "MS" else 0)
        return flags & wanted == wanted

    def reaches(self, address):
        return self.mark or address in ODD_ADDRESSES

    def parity_for(self, word: int) -> str:
        """The parity setting that sends the 9th bit of this word."""
        if self.mark:
            return "M" if word & NINTH else "S"
        ones, ninth = (word & 0xFF).bit_count() & 1, word >> 8
        return "O" if ones ^ 1 == ninth else "E"

    def send(self, words):
        for word in words:
            # S0's rule: a command byte goes out with odd parity
            if word & NINTH and not self.mark and self.parity_for(word) != "O":
                raise PortError(f"{self.name} has no MARK parity, and odd parity reaches only the addresses {addresses(ODD_ADDRESSES)}")
        self.wait(self.TURNAROUND * self.character_s)
        for parity, part in runs(words, self.parity_for):
            self.guarded(self.set_parity, parity)
            began = time.monotonic()
            self.guarded(self.port.write, bytes(word & 0xFF for word in part))
            self.guarded(self.port.flush)
            self.sleep_until(began + len(part) * self.character_s + self.LATENCY_S)

    def set_parity(self, parity: str):
        if parity != self.current:
            self.port.parity, self.current = parity, parity

    def receive(self, count, timeout_s):
        end, words = time.monotonic() + timeout_s, []
        while len(words) < count:
            left = end - time.monotonic()
            if left <= 0:
                words += self.guarded(self.port.read, min(count - len(words), self.guarded(lambda: self.port.in_waiting)))
                break
            self.port.timeout = left
            words += self.guarded(self.port.read, count - len(words))
        return words

    def now(self):
        return time.monotonic()

    def wait(self, seconds):
        if seconds > 0:
            time.sleep(seconds)

    def close(self):
        self.port.close()

    def sleep_until(self, moment: float):
        self.wait(moment - time.monotonic())

    def guarded(self, action, *arguments):
        """A port that vanishes is one clear sentence too."""
        try:
            return action(*arguments)
        except port_errors() as error:
            raise PortError(f"the port {self.name} failed: {plain(error)}") from None


def port_errors() -> tuple:
    """What a port may raise; termios.error is no OSError."""
    import serial
    return (serial.SerialException, OSError) if termios is None else (serial.SerialException, OSError, termios.error)


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
    in_use = any(sign in words for sign in ("exclusively lock", "busy", "access is denied"))
    if in_use or number in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        return f"the port {port} is in use by another program"
    if number in (errno.EACCES, errno.EPERM) or "permission denied" in words:
        return f"no permission to use the port {port}: on Linux, join the group dialout and log in again"
    if "baud" in words:
        return f"the port {port} cannot do {baud} baud"
    return f"the port {port} does not open: {plain(error)}"

# SPDX-License-Identifier: Apache-2.0
"""Everything that can go wrong. Each error is one sentence that says what to do about it.

`exit_code` is the exit code of the command line.
"""

from typing import TypeVar


class MoireError(Exception):
    """The base of all errors; its text is the whole sentence."""

    exit_code = 1


class UnitError(MoireError, ValueError):
    """A value that is no length, no speed, or no other quantity that it should be."""

    exit_code = 2


class OutOfRange(MoireError, ValueError):
    """A value outside the range that the host knows; nothing was sent."""

    exit_code = 2


class UnknownName(MoireError, KeyError):
    """There is no parameter, register or other thing of this name."""

    exit_code = 2

    def __str__(self) -> str:
        return str(self.args[0])


class BadFile(MoireError):
    """A file that cannot be read or written, or has the wrong content."""

    exit_code = 2


class PortError(MoireError):
    """The port is missing, in use or not permitted, or cannot do what the bus needs."""

    exit_code = 4


class TwinNotBuilt(PortError):
    """The simulated machine cannot be loaded."""


class BusError(MoireError):
    """The exchange with the node at `address` failed, however often it was repeated."""

    exit_code = 3

    def __init__(self, address: int, sentence: str):
        super().__init__(sentence)
        self.address = address


class NoAnswer(BusError):
    """Nothing at all came back."""

    def __init__(self, address: int, tries: int = 1):
        super().__init__(
            address,
            f"nobody answers at address {address}, asked {times(tries)}: check power, wiring, "
            "baud rate and address",
        )


class BusGarbled(BusError):
    """Words came back, but no correct reply; `reason` is the last thing that was wrong."""

    def __init__(self, address: int, reason: str, tries: int = 1):
        super().__init__(
            address,
            f"the bus to address {address} is garbled, tried {times(tries)}: {reason}; as from "
            f"noise, a wrong baud rate, two masters or two nodes with the address {address}",
        )
        self.reason = reason


class WrongBuild(MoireError):
    """Node and host were not made from the same tables; `node` and `host` are the two CRCs."""

    exit_code = 5

    def __init__(self, address: int, what: str, node: int, host: int):
        super().__init__(
            f"node {address} was made from another {what}: CRC-32 {node:08X} in the node, "
            f"{host:08X} in this host package; build both from the same sources"
        )
        self.address, self.what, self.node, self.host = address, what, node, host


class Refused(MoireError):
    """The node refused a request. `cause` is the name of the `code` in bus.toml."""

    def __init__(self, cause: str, code: int, sentence: str):
        super().__init__(sentence)
        self.cause, self.code = cause, code


class MotionFailed(MoireError):
    """The motion began, but did not reach its target. `cause` is as in Refused."""

    def __init__(self, cause: str, code: int, sentence: str):
        super().__init__(sentence)
        self.cause, self.code = cause, code


class NotCalibrated(MoireError):
    """The calibration has not ended in time. `cause` is the name of the reason in bus.toml."""

    def __init__(self, cause: str, sentence: str):
        super().__init__(sentence)
        self.cause = cause


class NotSurveyed(MoireError):
    """The index could not be surveyed. `cause` is two_indexes, index_missed, index_on_edge, no_room
    or unsteady.
    """

    def __init__(self, cause: str, sentence: str):
        super().__init__(sentence)
        self.cause = cause


Failure = TypeVar("Failure", Refused, MotionFailed)


def with_more(error: Failure, more: str) -> Failure:
    """The same error with a fact in brackets at the end of its sentence."""
    return type(error)(error.cause, error.code, f"{error} ({more})")


def times(count: int) -> str:
    """ "once", "5 times"."""
    return "once" if count == 1 else f"{count} times"

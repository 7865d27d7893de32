# SPDX-License-Identifier: Apache-2.0
"""Everything that can go wrong, each in one sentence that a person can act on, each with the exit
code of the command line.
"""


class MoireError(Exception):
    """The text is the whole sentence."""

    exit_code = 1


class UnitError(MoireError, ValueError):
    """A value that is no length, speed, …"""

    exit_code = 2


class OutOfRange(MoireError, ValueError):
    """A value outside what the host knows to be allowed; nothing was sent."""

    exit_code = 2


class UnknownName(MoireError, KeyError):
    """No such parameter or register."""

    exit_code = 2

    def __str__(self):
        return self.args[0]


class BadFile(MoireError):
    """A file that cannot be read or written, or says nothing sensible."""

    exit_code = 2


class PortError(MoireError):
    """The port is missing, in use, not permitted, or cannot do what the line needs."""

    exit_code = 4


class TwinNotBuilt(PortError):
    """The simulated machine cannot be loaded."""


class BusError(MoireError):
    """The exchange did not succeed, however often it was repeated."""

    exit_code = 3

    def __init__(self, address: int, sentence: str):
        super().__init__(sentence)
        self.address = address


class NoAnswer(BusError):
    """Not one word came back."""

    def __init__(self, address: int, tries: int = 1):
        super().__init__(
            address,
            f"nobody answers at address {address}, asked {times(tries)}: check power, wiring, baud rate and address",
        )


class BusGarbled(BusError):
    """Words came back, but no right reply."""

    def __init__(self, address: int, reason: str, tries: int = 1):
        super().__init__(
            address,
            f"the line to address {address} is garbled, tried {times(tries)}: {reason}; as from noise, a wrong baud "
            f"rate, two masters or two nodes with the address {address}",
        )
        self.reason = reason


class WrongBuild(MoireError):
    """Node and host were not made from the same tables."""

    exit_code = 5

    def __init__(self, address: int, what: str, node: int, host: int):
        super().__init__(
            f"node {address} was made from another {what}: CRC-32 {node:08X} in the node, {host:08X} in this host package; "
            "build both from the same sources"
        )
        self.address, self.what, self.node, self.host = address, what, node, host


class Refused(MoireError):
    """The node said no. `cause` is the name of the code in bus.toml."""

    def __init__(self, cause: str, code: int, sentence: str):
        super().__init__(sentence)
        self.cause, self.code = cause, code


class MotionFailed(MoireError):
    """The motion began, but did not end as asked. `cause` as in Refused."""

    def __init__(self, cause: str, code: int, sentence: str):
        super().__init__(sentence)
        self.cause, self.code = cause, code


class NotCalibrated(MoireError):
    """The correction was not learned in time. `cause` is the name of the reason in bus.toml."""

    def __init__(self, cause: str, sentence: str):
        super().__init__(sentence)
        self.cause = cause


def times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"

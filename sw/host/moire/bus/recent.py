# SPDX-License-Identifier: Apache-2.0
"""The last replies to polls and to reads of parameters, for clients that accept a reply of a given
age instead of an exchange of their own.

A reply is forgotten as soon as a request changes something at its node, or the node does not
answer. The thread that owns the bus writes; any other thread may read.
"""

from collections.abc import Callable
from typing import NamedTuple

from moire.bus.arbiter import MOTIONS, POLLS, operation_of

KEPT = POLLS | {"get_parameter"}
READINGS = KEPT | {  # change nothing that a kept reply says
    *("counters", "follow", "get_correction", "get_harmonic", "get_segments", "read_register"),
    *("read_scope", "scope", "segments", "record_ticks", "read_ticks", "load_excitation"),
}
# after these a node is still the same, and so are its parameters
OF_AN_AXIS = MOTIONS | {"stop", "enable", "reset_faults"}
LASTING = {"identify", "get_parameter"}


class Sample(NamedTuple):
    """A reply without its sequence number, and the time of the bus at which it was complete."""

    time: float
    reply: bytes


class Recent:
    """The replies, by node and by the body of the request without its sequence number."""

    def __init__(self) -> None:
        self.samples: dict[int, dict[bytes, Sample]] = {}

    def note(self, address: int, body: bytes, reply: bytes | None, time: float) -> None:
        """An exchange has ended; `reply` is None if the node did not answer."""
        operation = operation_of(b"\0" + body)
        if operation in KEPT and reply is not None and reply[1:2] == b"\0":
            self.samples.setdefault(address, {})[body] = Sample(time, reply)
        elif operation in OF_AN_AXIS and reply is not None:
            self.keep(address, lambda known: operation_of(b"\0" + known) in LASTING)
        elif operation not in READINGS or reply is None:
            self.keep(address, lambda known: False)

    def keep(self, address: int, kept: Callable[[bytes], bool]) -> None:
        """Forgets what is not kept. Readers see the old samples or the new ones, as a whole."""
        known = self.samples.get(address, {})
        self.samples[address] = {body: known[body] for body in known if kept(body)}

    def clear(self) -> None:
        """Forgets everything: something was sent that is not known."""
        self.samples = {}

    def find(self, address: int, body: bytes, oldest: float) -> Sample | None:
        """The reply to this request if it is not older than `oldest`, of the time of the bus."""
        sample = self.samples.get(address, {}).get(body)
        return sample if sample is not None and sample.time >= oldest else None

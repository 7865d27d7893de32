# SPDX-License-Identifier: Apache-2.0
"""What a node keeps without power: the parameters of its axes and its settings, in its EEPROM (image `station`).

    kept = Kept(line.node(2))
    kept.keep()                  all that differs from the defaults; the next power-up begins with it
    kept.state().cause           "ok", or why the defaults are in force
"""
from dataclasses import dataclass

from .client import CAUSE_CODES, named, words
from .errors import MotionFailed
from .line_tables import CAUSES, KEEP_ACTIONS

ACTIONS = {name: code for code, (name, _) in KEEP_ACTIONS.items()}
KEEP_S = 10                      # a node with two axes takes less than one second
NOTHING = "nothing_kept"


@dataclass(frozen=True)
class KeptState:
    cause: str
    torn: bool                   # one of the two copies was damaged, the other one is in force
    generation: int              # each keeping has a higher one
    values: int                  # that differ from their defaults

    @property
    def words(self) -> str:
        kept = "1 value is kept" if self.values == 1 else f"{self.values} values are kept"
        return (kept if self.cause == "ok" else words(CAUSES, [self.cause])) + "; one copy of them was damaged" * self.torn


class Kept:
    def __init__(self, node):
        self.node = node

    def state(self) -> KeptState:
        """Waits until the EEPROM is not being read or written."""
        transport = self.node.line.transport
        begun = transport.now()
        while (told := self.node.request("kept"))["writing"] and transport.now() - begun < KEEP_S:
            transport.wait(self.node.line.poll_s)
        cause = "store_busy" if told["writing"] else named(CAUSES, told["cause"], "cause")
        return KeptState(cause, bool(told["torn"]), told["generation"], told["values"])

    def keep(self) -> KeptState:
        """MotionFailed says why it is not kept."""
        return self._do("keep", ("ok", NOTHING))

    def forget(self) -> KeptState:
        """The next power-up begins with the defaults."""
        return self._do("forget", (NOTHING,))

    def _do(self, action, good):
        self.state()
        self.node.request("keep", action=ACTIONS[action])
        state = self.state()
        if state.cause not in good:
            raise MotionFailed(state.cause, CAUSE_CODES[state.cause],
                               f"node {self.node.address} did not {action} its values: {state.words}")
        return state

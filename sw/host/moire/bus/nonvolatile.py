# SPDX-License-Identifier: Apache-2.0
"""What a node keeps without power: the parameters of its axes and its settings, in its EEPROM
(image `station`).

saved = SavedSettings(bus.node(2))
saved.save()                  all that differs from the defaults; the next power-up begins with it
saved.state().cause           "ok", or why the defaults are in force
"""

from dataclasses import dataclass

from moire.bus.client import CAUSE_CODES, named, words
from moire.errors import MotionFailed
from moire.made.bus_tables import CAUSES, SAVE_ACTIONS

ACTIONS = {name: code for code, (name, _) in SAVE_ACTIONS.items()}
SAVE_TIMEOUT_S = 10  # a node with two axes takes less than one second
NOTHING = "nothing_saved"


@dataclass(frozen=True)
class SavedState:
    cause: str
    torn: bool  # one of the two copies was damaged, the other one is in force
    generation: int  # each keeping has a higher one
    values: int  # that differ from their defaults

    @property
    def words(self) -> str:
        kept = "1 value is kept" if self.values == 1 else f"{self.values} values are kept"
        return (
            kept if self.cause == "ok" else words(CAUSES, [self.cause])
        ) + "; one copy of them was damaged" * self.torn


class SavedSettings:
    def __init__(self, node):
        self.node = node

    def state(self) -> SavedState:
        """Waits until the EEPROM is not being read or written."""
        transport = self.node.bus.transport
        begun = transport.now()
        while (told := self.node.request("saved_settings"))[
            "writing"
        ] and transport.now() - begun < SAVE_TIMEOUT_S:
            transport.wait(self.node.bus.poll_s)
        cause = "eeprom_busy" if told["writing"] else named(CAUSES, told["cause"], "cause")
        return SavedState(cause, bool(told["damaged"]), told["generation"], told["values"])

    def save(self) -> SavedState:
        """MotionFailed says why it is not kept."""
        return self._do("save", ("ok", NOTHING))

    def restore_defaults(self) -> SavedState:
        """The next power-up begins with the defaults."""
        return self._do("clear", (NOTHING,))

    def _do(self, action, good):
        self.state()
        self.node.request("save_settings", action=ACTIONS[action])
        state = self.state()
        if state.cause not in good:
            raise MotionFailed(
                state.cause,
                CAUSE_CODES[state.cause],
                f"node {self.node.address} did not {action} its values: {state.words}",
            )
        return state

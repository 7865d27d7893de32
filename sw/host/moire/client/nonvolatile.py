# SPDX-License-Identifier: Apache-2.0
"""What a node keeps without power: the parameters of its axes and its settings, in the EEPROM of a
node with the firmware image `station`.

    saved = SavedSettings(bus.node(2))
    saved.save()                  # all that differs from the defaults; the next power-up uses it
    saved.state().cause           # "ok", or why the defaults are in force
    saved.parameters(0)           # what the parameters of its axis 0 are after the next power-up
"""

from collections.abc import Sequence
from dataclasses import dataclass

from moire.client.names import CAUSE_CODES, code_name, descriptions
from moire.client.node import Node
from moire.errors import MotionFailed, Refused
from moire.made.bus_tables import CAUSES, PARAMETERS, SAVE_ACTIONS

ACTIONS = {name: code for code, (name, _) in SAVE_ACTIONS.items()}
SAVE_TIMEOUT_S = 10  # a node with two axes needs less than one second
NOTHING = "nothing_saved"
IN_FORCE = ("ok", "saved_refused")  # causes with which the next power-up uses what is saved
DEFAULTS = (NOTHING, "saved_damaged", "saved_other_build")  # and those with which it does not


@dataclass(frozen=True)
class SavedState:
    """What is in the EEPROM, or why nothing there can be used."""

    cause: str
    damaged: bool  # one of the two copies is damaged, the other one is in force
    generation: int  # rises by one with every save
    values: int  # how many differ from their defaults

    @property
    def words(self) -> str:
        """The state in words."""
        if self.cause != "ok":
            state = descriptions(CAUSES, [self.cause])
        else:
            state = "1 value is kept" if self.values == 1 else f"{self.values} values are kept"
        return state + "; one copy of them was damaged" * self.damaged


def when_written(node: Node, operation: str, timeout_s: float) -> dict[str, int]:
    """The reply to an operation that reports on the EEPROM, as soon as that is not being read or
    written; after timeout_s seconds the reply as it is, with `writing`.
    """
    transport = node.bus.transport
    began = transport.now()
    reply = node.request(operation)
    while reply["writing"] and transport.now() - began < timeout_s:
        node.bus.until_next_poll(node)
        reply = node.request(operation)
    return reply


def cause_of(writing: int, code: int) -> str:
    """The cause with which the work of the EEPROM ended: that of the code, unless it goes on."""
    return "eeprom_busy" if writing else code_name(CAUSES, code, "cause")


class SavedSettings:
    """The saved values of a node."""

    def __init__(self, node: Node):
        self.node = node

    def state(self) -> SavedState:
        """The state, as soon as the EEPROM is not being read or written."""
        reply = when_written(self.node, "saved_settings", SAVE_TIMEOUT_S)
        cause = cause_of(reply["writing"], reply["cause"])
        return SavedState(cause, bool(reply["damaged"]), reply["generation"], reply["values"])

    def parameters(self, axis: int) -> dict[str, int]:
        """The counts of all parameters of an axis after the next power-up: the saved ones, and else
        the defaults. A node without this memory has the defaults. Raises MotionFailed when what is
        saved cannot be read.
        """
        counts = {name: known.default for name, known in PARAMETERS.items()}
        try:
            state = self.state()
        except Refused as refused:
            if refused.cause != "not_built":
                raise
            return counts
        if state.cause in DEFAULTS:
            return counts
        if state.cause not in IN_FORCE:
            raise self._failed(state, "read")
        names = {known.id: name for name, known in PARAMETERS.items()}
        for number in range(state.values):
            saved = self._value(number)
            if saved["owner"] == axis:
                counts[names[saved["id"]]] = saved["value"]
        return counts

    def _value(self, number: int) -> dict[str, int]:
        """One of the saved values, as soon as the node has read it."""
        transport = self.node.bus.transport
        began = transport.now()
        while True:
            try:
                return self.node.request("saved_value", number=number)
            except Refused as refused:
                is_late = transport.now() - began > SAVE_TIMEOUT_S
                if refused.cause != "eeprom_busy" or is_late:
                    raise
            self.node.bus.until_next_poll(self.node)

    def save(self) -> SavedState:
        """Saves the present values; raises MotionFailed with the reason when that fails."""
        return self._do("save", ("ok", NOTHING))

    def restore_defaults(self) -> SavedState:
        """Erases the saved values: the next power-up uses the defaults. Raises MotionFailed."""
        return self._do("clear", (NOTHING,))

    def _do(self, action: str, good: Sequence[str]) -> SavedState:
        self.state()
        self.node.request("save_settings", action=ACTIONS[action])
        state = self.state()
        if state.cause not in good:
            raise self._failed(state, action)
        return state

    def _failed(self, state: SavedState, action: str) -> MotionFailed:
        return MotionFailed(
            state.cause,
            CAUSE_CODES[state.cause],
            f"node {self.node.address} did not {action} its values: {state.words}",
        )

# SPDX-License-Identifier: Apache-2.0
"""The settings of a station. A node whose firmware is the image `station` has one set of them.

settings = Settings(node)
settings.get("turn_tolerance").value                  # Fraction(1, 2), in arcsec
settings.set("turn_tolerance", "0.3arcsec")
"""

from collections.abc import Mapping
from fractions import Fraction

from moire import units
from moire.client.node import Node
from moire.client.values import ParameterValue, counts_of, one_count, value_of
from moire.errors import UnknownName
from moire.made.bus_tables import SETTINGS, Parameter
from moire.nearest import unknown

NO_PERIOD = Fraction(1)  # no setting is counted in signal periods


def known(name: str) -> Parameter:
    """The entry of the protocol table; raises UnknownName."""
    if name not in SETTINGS:
        raise UnknownName(unknown("setting", name, SETTINGS, "Settings.save()"))
    return SETTINGS[name]


def setting_value(name: str, counts: int) -> ParameterValue:
    """The value in real units of so many counts."""
    setting = known(name)
    return value_of(setting, counts, one_count(setting, NO_PERIOD))


def setting_counts(name: str, value: units.Value) -> int:
    """The counts on the bus of a value; raises OutOfRange with the allowed range."""
    setting = known(name)
    return counts_of(setting, value, one_count(setting, NO_PERIOD))


class Settings:
    """The settings of a node."""

    def __init__(self, node: Node):
        self.node = node

    def get(self, name: str) -> ParameterValue:
        """Reads one setting; raises UnknownName."""
        reply = self.node.request("get_setting", setting=known(name).id)
        return setting_value(name, reply["value"])

    def set(self, name: str, value: units.Value) -> ParameterValue:
        """Sets one setting and returns its new value, which is the nearest count.

        `value` is a number in the unit of get(), or a text with a unit. Raises UnknownName,
        OutOfRange or Refused.
        """
        counts = setting_counts(name, value)
        self.node.request("set_setting", setting=known(name).id, value=counts)
        return setting_value(name, counts)

    def all(self) -> dict[str, ParameterValue]:
        """All settings, by name."""
        return {name: self.get(name) for name in SETTINGS}

    def save(self) -> dict[str, str]:
        """All settings as exact texts, ready for a JSON file."""
        return {name: value.written() for name, value in self.all().items()}

    def load(self, texts: Mapping[str, units.Value]) -> dict[str, ParameterValue]:
        """Sets some or all from the texts of save(); checks every one before it sets the first."""
        for name, text in texts.items():
            setting_counts(name, text)
        return {name: self.set(name, text) for name, text in texts.items()}

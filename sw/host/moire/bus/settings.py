# SPDX-License-Identifier: Apache-2.0
"""The settings of a station: one set a node, in a node whose firmware is the image `station`.

settings = Settings(node)
settings.get("turn_tolerance").value                  Fraction(1, 2), arcsec
settings.set("turn_tolerance", "0.3arcsec")
"""

from fractions import Fraction

from moire.bus.client import ParameterValue, counts_of, one_count, value_of
from moire.errors import UnknownName
from moire.made.bus_tables import SETTINGS

NO_PERIOD = Fraction(1)  # no setting is counted in periods


def known(name: str):
    if name not in SETTINGS:
        raise UnknownName(f"there is no setting '{name}': known are {', '.join(SETTINGS)}")
    return SETTINGS[name]


def setting_value(name: str, counts: int) -> ParameterValue:
    setting = known(name)
    return value_of(setting, counts, one_count(setting, NO_PERIOD))


def setting_counts(name: str, value) -> int:
    """What the wire carries; OutOfRange says what is allowed."""
    setting = known(name)
    return counts_of(setting, value, one_count(setting, NO_PERIOD))


class Settings:
    def __init__(self, node):
        self.node = node

    def get(self, name: str) -> ParameterValue:
        return setting_value(
            name, self.node.request("get_setting", setting=known(name).id)["value"]
        )

    def set(self, name: str, value) -> ParameterValue:
        """`value` is a number in the unit of get(), or a text with a unit. Returns what was set:
        the nearest count.
        """
        counts = setting_counts(name, value)
        self.node.request("set_setting", setting=known(name).id, value=counts)
        return setting_value(name, counts)

    def all(self) -> dict:
        return {name: self.get(name) for name in SETTINGS}

    def save(self) -> dict:
        """All as exact texts, ready for a JSON file."""
        return {name: value.written() for name, value in self.all().items()}

    def load(self, texts: dict) -> dict:
        """Some or all, as saved; every one is checked before the first is written."""
        for name, text in texts.items():
            setting_counts(name, text)
        return {name: self.set(name, text) for name, text in texts.items()}

# SPDX-License-Identifier: Apache-2.0
"""What an axis was built with, and which parameter of rtl/node.sv builds what it lacks."""

from collections.abc import Mapping
from dataclasses import dataclass

from moire.made.bus_tables import PARAMETERS
from moire.made.registers import FIELDS

FEATURES = tuple(f.field for f in FIELDS if (f.block, f.register) == ("axis", "built"))
SIZES = ("filters", "segments")  # these are numbers; the others are 0 or 1
NEEDS = {  # what a request needs; what a parameter needs is in its table
    **dict.fromkeys(("enable", "home", "move", "prepare", "arm_scope"), "drive"),
    "signal": "monitor",
    "calibration": "recorder",
    "step_fine": "fine_stage",
    **dict.fromkeys(("get_correction", "set_correction", "get_harmonic"), "sine"),
    "set_harmonic": "harmonics",
    "set_segments": "segments",
}
NEEDS_OF_VALUE = {  # and parameters that choose between things that may be built or not
    "drive": ("bridge", "stepper", "dac"),
    "position_source": ("sine", "", "stepper"),
}
PARAMETER_OF_ID = {parameter.id: parameter for parameter in PARAMETERS.values()}


@dataclass(frozen=True)
class Built:
    """What an axis was built with."""

    sizes: Mapping[str, int]  # of each feature; 0: not built

    def has(self, feature: str) -> bool:
        """Whether the axis has this feature, one of FEATURES."""
        return bool(self.sizes[feature])

    @property
    def names(self) -> tuple[str, ...]:
        """The features that the axis has."""
        return tuple(name for name in FEATURES if self.sizes[name])


def parameter_of(feature: str) -> str:
    """The parameter of rtl/node.sv that builds a feature."""
    return feature.upper() if feature in SIZES else f"HAS_{feature.upper()}"


def feature_of(operation: str, fields: Mapping[str, int]) -> str:
    """The feature that a request needs, or "" if it needs none."""
    if operation != "set_parameter":
        return NEEDS.get(operation, "")
    parameter = PARAMETER_OF_ID[fields["parameter"]]
    if parameter.name in NEEDS_OF_VALUE:
        return NEEDS_OF_VALUE[parameter.name][fields["value"]]
    return parameter.needs.lower()


def remedy(feature: str) -> str:
    """How to get what is not built."""
    return f"it needs {parameter_of(feature)} of rtl/node.sv"

# SPDX-License-Identifier: Apache-2.0
"""The description of a machine, machine.toml: the port, and a name for each axis, with the unit in
which its lengths are shown, its parameters and its wiring in words. All clients use it.

    port = "/dev/ttyUSB0"

    [axes.x]
    node = 1
    axis = 0
    unit = "um"
    wiring = "grating on J3, bridge on J4, limit switches on J5"

    [axes.x.parameters]
    travel_high = "40 mm"

A machine of one node may have a single file for `make board` and the host: each [[axis]] of the
file of `make board` is an axis with this name, and may have `unit` and `parameters`.

    port = "/dev/ttyUSB0"

    [node]
    address = 1

    [[axis]]
    name = "X"
    unit = "um"
    parameters = { travel_high = "40 mm" }

The file is the one that is named, that of the variable MOIRE_MACHINE_FILE, machine.toml in the
present folder, or machine.toml in the folder of the user's settings; the first that there is.
"""

import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from moire import units
from moire.bus.protocol import ADDRESSES
from moire.bus.twin_port import AXES, machine_of
from moire.errors import BadFile, UnknownName
from moire.made.bus_tables import PARAMETERS

FILE = "machine.toml"
VARIABLE, PORT_VARIABLE = "MOIRE_MACHINE_FILE", "MOIRE_PORT"
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,23}")
PLACE = re.compile(r"([0-9]{1,2})\.([0-9]{1,3})")
DECIMALS = {"mm": 6, "um": 3, "nm": 1}  # with which a length is shown in this unit
LARGEST_AXIS = 255
BUILT = ("title", "node", "axis", "between", "wiring", "linuxcnc")  # in a file of `make board`


@dataclass(frozen=True)
class AxisDescription:
    """One axis. `parameters` are texts with units, as Axis.load_parameters() takes them."""

    name: str
    node: int  # address
    axis: int = 0
    unit: str = "mm"
    wiring: str = ""
    parameters: Mapping[str, str] = field(default_factory=dict)

    @property
    def place(self) -> tuple[int, int]:
        """Address of the node, and number of the axis."""
        return self.node, self.axis

    def length(self, nm: float) -> str:
        """A length in the unit of this axis."""
        return f"{nm / units.LENGTHS[self.unit]:.{DECIMALS[self.unit]}f} {self.unit}"


@dataclass(frozen=True)
class Description:
    """A machine; without a file it has no named axes, or those of a simulated machine."""

    file: str = ""
    text: str = ""
    port: str | None = None
    axes: Mapping[str, AxisDescription] = field(default_factory=dict)

    def axis(self, name: str) -> AxisDescription:
        """An axis by its name, or by node and axis as in "1.0"; raises UnknownName."""
        if name in self.axes:
            return self.axes[name]
        if place := PLACE.fullmatch(name):
            return self.at(int(place[1]), int(place[2]))
        known = ", ".join(self.axes) or "none"
        raise UnknownName(
            f"there is no axis '{name}': named axes are {known}; node and axis, such as 1.0, name "
            "any"
        )

    def at(self, node: int, axis: int) -> AxisDescription:
        """The axis at this place, whose name is "1.0" if it has no other."""
        for one in self.axes.values():
            if one.place == (node, axis):
                return one
        return AxisDescription(f"{node}.{axis}", node, axis)

    def of(self, port: str | None) -> "Description":
        """This description with the port that holds: the given one, that of the variable MOIRE_PORT
        or that of the file. Without axes in a file, those of a simulated machine have their names.

        Raises UnknownName for a simulated machine that does not exist.
        """
        port = port or os.environ.get(PORT_VARIABLE) or self.port
        machine = machine_of(port) if port and not self.axes else None
        axes = self.axes if machine is None else axes_of_twin(machine)
        return replace(self, port=port, axes=axes)


def axes_of_twin(machine: str) -> dict[str, AxisDescription]:
    """The named axes of a simulated machine."""
    return {name: AxisDescription(name, *place) for name, place in AXES[machine].items()}


def found_file(named: str | None = None) -> Path | None:
    """The file that holds; None if there is none. A file that is named need not exist."""
    if named or (named := os.environ.get(VARIABLE)):
        return Path(named)
    return next(filter(Path.is_file, (Path(FILE), settings_folder() / FILE)), None)


def settings_folder() -> Path:
    """The folder of the settings of this user."""
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA", "~")).expanduser() / "moire"
    return Path(os.environ.get("XDG_CONFIG_HOME", "~/.config")).expanduser() / "moire"


def describe(named: str | None = None) -> Description:
    """The description in the file that holds, an empty one without a file; raises BadFile."""
    file = found_file(named)
    return Description() if file is None else parse(read_toml(file), str(file))


def read_toml(file: Path | str) -> dict[str, Any]:
    """The content of a TOML file; raises BadFile."""
    import tomllib  # only where there is a file

    try:
        return tomllib.loads(Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise BadFile(f"the file {file} cannot be read: {error.strerror}") from None
    except ValueError as error:  # no UTF-8, or no TOML
        raise BadFile(f"the file {file} is no TOML: {error}") from None


def named_axes(content: Mapping[str, Any], file: str) -> dict[str, Any]:
    """What the file of `make board` says to the host, in the form of a file for the host alone.
    What else it says, sw/boards/machine.py checks. Raises BadFile.
    """

    def wrong(what: str) -> BadFile:
        return BadFile(f"{file}: {what}")

    if "relay" in content:
        raise wrong("this is a relay: it has no axes that a host moves")
    if "axes" in content:
        raise wrong("use [axes.NAME] or [[axis]], not both")
    node, rows, axes = content["node"], content.get("axis"), {}
    if not isinstance(node, dict) or not isinstance(rows, list):
        raise wrong("a node has the tables [node] and [[axis]]")
    for number, row in enumerate(rows):
        if not isinstance(row, dict) or not isinstance(name := row.get("name"), str):
            raise wrong(f'axis {number} has no name: write [[axis]] and name = "X"')
        if name in axes:
            raise wrong(f"two axes have the name {name}")
        known = {key: row[key] for key in ("unit", "parameters") if key in row}
        axes[name] = {"node": node.get("address", 1), "axis": number, **known}
    host = {key: value for key, value in content.items() if key not in BUILT}
    return {**host, "text": content.get("title", ""), "axes": axes}


def parse(content: Mapping[str, Any], file: str) -> Description:
    """The description in the content of a file; raises BadFile with the place of the mistake."""

    def wrong(what: str) -> BadFile:
        return BadFile(f"{file}: {what}")

    def text(table: Mapping[str, Any], name: str, where: str) -> str:
        value = table.get(name, "")
        if not isinstance(value, str):
            raise wrong(f"{where}{name} is no text")
        return value

    def number(table: Mapping[str, Any], name: str, preset: int, ends: tuple[int, int]) -> int:
        value = table.get(name, preset)
        if isinstance(value, bool) or not isinstance(value, int) or not ends[0] <= value <= ends[1]:
            raise wrong(f"{name} = {value!r} is no number from {ends[0]} to {ends[1]}")
        return value

    def known(table: Mapping[str, Any], names: tuple[str, ...], where: str) -> None:
        for name in table:
            if name not in names:
                raise wrong(f"there is no '{where}{name}': allowed are {', '.join(names)}")

    if content.keys() & {"node", "relay"}:
        content = named_axes(content, file)
    known(content, ("text", "port", "axes"), "")
    tables, axes = content.get("axes", {}), {}
    if not isinstance(tables, dict):
        raise wrong("axes is no table: write [axes.x]")
    for name, table in tables.items():
        where = f"axes.{name}."
        if not NAME.fullmatch(name) or name in PARAMETERS:
            raise wrong(
                f"'{name}' is no name for an axis: use letters and digits, and no parameter"
            )
        if not isinstance(table, dict):
            raise wrong(f"axes.{name} is no table: write [axes.{name}]")
        known(table, ("node", "axis", "unit", "wiring", "parameters"), where)
        unit, parameters = text(table, "unit", where) or "mm", table.get("parameters", {})
        if unit not in DECIMALS:
            raise wrong(f"{where}unit = '{unit}': allowed are {', '.join(DECIMALS)}")
        if not isinstance(parameters, dict):
            raise wrong(f"{where}parameters is no table: write [axes.{name}.parameters]")
        known(parameters, tuple(PARAMETERS), f"{where}parameters.")
        axes[name] = AxisDescription(
            name,
            number(table, "node", 1, (ADDRESSES[0], ADDRESSES[-1])),
            number(table, "axis", 0, (0, LARGEST_AXIS)),
            unit,
            text(table, "wiring", where),
            {each: text(parameters, each, f"{where}parameters.") for each in parameters},
        )
    places = [one.place for one in axes.values()]
    if len(set(places)) < len(places):
        raise wrong("two names mean the same axis: give each its own node and axis")
    return Description(file, text(content, "text", ""), text(content, "port", "") or None, axes)

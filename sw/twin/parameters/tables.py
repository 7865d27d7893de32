# SPDX-License-Identifier: Apache-2.0
"""The parameters of the machines: <machine>.toml as dictionaries, and as the C++ structures that
build.py writes beside the libraries.
"""

import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
WORLDS = ("typical", "bad")
MACHINES = tuple(sorted(file.stem for file in HERE.glob("*.toml")))


def source(machine: str) -> Path:
    """The file of a machine; KeyError names the machines that there are."""
    if machine not in MACHINES:
        raise KeyError(f"there is no machine {machine}; there are {', '.join(MACHINES)}")
    return HERE / f"{machine}.toml"


@cache
def load(machine: str = "stage") -> dict[str, dict[str, Any]]:
    """{name: entry} with name = section_key; an entry has value, unit and why."""
    with open(source(machine), "rb") as file:
        sections = tomllib.load(file)
    return {
        f"{section}_{key}": entry
        for section, entries in sections.items()
        for key, entry in entries.items()
    }


def values(
    overrides: Mapping[str, float] | None = None, machine: str = "stage"
) -> dict[str, float]:
    """{name: value} with the overrides applied; KeyError for a name that does not exist."""
    result = {name: float(entry["value"]) for name, entry in load(machine).items()}
    for name, value in (overrides or {}).items():
        if name not in result:
            raise KeyError(
                f"the machine {machine} has no parameter {name}; see {source(machine).name}"
            )
        result[name] = float(value)
    return result


def world(name: str, machine: str = "stage") -> dict[str, float]:
    """{parameter: value} of all effects of a machine in a "typical" or a "bad" world.

    An effect is a parameter with a bad value; its typical value is `value` unless it is given.
    ValueError for another world.
    """
    if name not in WORLDS:
        raise ValueError(f"there is no world {name}; there are {', '.join(WORLDS)}")
    return {
        parameter: float(entry.get(name, entry["value"]))
        for parameter, entry in load(machine).items()
        if "bad" in entry
    }


def structure(machine: str) -> str:
    """The C++ structure of a machine's parameters, and the function that finds one by name."""
    name = "".join(word.capitalize() for word in machine.split("_")) + "Parameters"
    fields = "\n".join(
        f"    double {field};    // {entry['unit']}" for field, entry in load(machine).items()
    )
    table = "\n".join(
        f'    if (!std::strcmp(name, "{field}")) return &p.{field};' for field in load(machine)
    )
    return f"""struct {name} {{
{fields}
}};

inline double* find_parameter({name}& p, const char* name) {{
{table}
    return nullptr;
}}
"""


def header() -> str:
    """Text of parameters.h."""
    structures = "\n".join(structure(machine) for machine in MACHINES)
    return f"""// SPDX-License-Identifier: Apache-2.0
// Made by sw/twin/parameters/tables.py from sw/twin/parameters/*.toml; do not edit.
#pragma once
#include <cstring>

namespace twin {{

{structures}
}}  // namespace twin
"""

# SPDX-License-Identifier: Apache-2.0
"""The parameters of the machines: <machine>.toml as dictionaries, and as the C++ structures that
build.py puts beside
the libraries."""

import tomllib
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
MACHINES = tuple(sorted(file.stem for file in HERE.glob("*.toml")))


def source(machine):
    if machine not in MACHINES:
        raise KeyError(f"there is no machine {machine}; there are {', '.join(MACHINES)}")
    return HERE / f"{machine}.toml"


@cache
def load(machine="stage"):
    """{name: entry}, name = section_key, entry = value, unit, why."""
    with open(source(machine), "rb") as file:
        sections = tomllib.load(file)
    return {
        f"{section}_{key}": entry
        for section, entries in sections.items()
        for key, entry in entries.items()
    }


def values(overrides=None, machine="stage"):
    """{name: value} with the overrides in place; a name that does not exist is refused."""
    result = {name: float(entry["value"]) for name, entry in load(machine).items()}
    for name, value in (overrides or {}).items():
        if name not in result:
            raise KeyError(
                f"the machine {machine} has no parameter {name}; see {source(machine).name}"
            )
        result[name] = float(value)
    return result


def structure(machine):
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


def header():
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

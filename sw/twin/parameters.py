# SPDX-License-Identifier: Apache-2.0
"""The plant's parameters: parameters.toml as a dictionary, and as the C++ structure that build.py puts beside the library."""
import tomllib
from pathlib import Path

SOURCE = Path(__file__).with_name("parameters.toml")


def load():
    """{name: entry}, name = section_key, entry = value, unit, why."""
    with open(SOURCE, "rb") as file:
        sections = tomllib.load(file)
    return {f"{section}_{key}": entry for section, entries in sections.items() for key, entry in entries.items()}


def values(overrides=None):
    """{name: value} with the overrides in place; a name that does not exist is refused."""
    result = {name: float(entry["value"]) for name, entry in load().items()}
    for name, value in (overrides or {}).items():
        if name not in result:
            raise KeyError(f"the plant has no parameter {name}; see {SOURCE.name}")
        result[name] = float(value)
    return result


def header():
    """Text of parameters.h."""
    names = list(load())
    fields = "\n".join(f"    double {name};    // {entry['unit']}" for name, entry in load().items())
    table = "\n".join(f'    if (!std::strcmp(name, "{name}")) return p.{name} = value, true;' for name in names)
    return f"""// SPDX-License-Identifier: Apache-2.0
// Made by sw/twin/parameters.py from parameters.toml; do not edit.
#pragma once
#include <cstring>

namespace twin {{

struct Parameters {{
{fields}
}};
constexpr int PARAMETER_COUNT = {len(names)};

inline bool set_parameter(Parameters& p, const char* name, double value) {{
{table}
    return false;
}}

}}  // namespace twin
"""

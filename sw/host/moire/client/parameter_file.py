# SPDX-License-Identifier: Apache-2.0
"""Files of parameters: TOML with the unit in each value and the purpose beside it, or JSON.

A TOML file, as toml_of() writes it:

    segment_points = [0, 12, 25]         # where there is a segment table, in counts

    [parameters]
    # motion
    velocity = "5mm/s"                   # top speed of a move; 800nm/s to 800mm/s
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from typing import Any

from moire.client.groups import GROUPS, OTHERS, group_of
from moire.client.values import ParameterValue, whole
from moire.errors import BadFile

VALUE_WIDTH = 36  # in front of a comment
ORDER = {group: number for number, group in enumerate((*GROUPS, OTHERS))}


def toml_lines(values: Iterable[ParameterValue]) -> list[str]:
    """A line for each parameter, under the name of its group; each says what the value may be."""

    def of_group(value: ParameterValue) -> int:
        return ORDER[group_of(value.name)]

    lines: list[str] = []
    for _, members in groupby(sorted(values, key=of_group), of_group):
        found = list(members)
        lines += ["", f"# {group_of(found[0].name)}"]
        for value in found:
            setting = f'{value.name} = "{value.written()}"'
            changed = "" if value.is_default else f"; default {value.default_written}"
            lines.append(f"{setting:<{VALUE_WIDTH}} # {value.text}; {value.range_words}{changed}")
    return lines


def toml_of(values: Iterable[ParameterValue], points: Sequence[int], where: str) -> str:
    """The text of a TOML file. `where` names the axis in words."""
    segments = [f"segment_points = {list(points)}", ""] if points else []
    head = [
        f"# Parameters of {where}, written by 'moire params save'. 'moire params load' reads them.",
        "# A parameter that is left out keeps its value.",
        "",
    ]
    return "\n".join([*head, *segments, "[parameters]", *toml_lines(values), ""])


def json_of(values: Iterable[ParameterValue], points: Sequence[int]) -> str:
    """The text of a JSON file."""
    content: dict[str, Any] = {"parameters": {value.name: value.written() for value in values}}
    if points:
        content["segment_points"] = list(points)
    return json.dumps(content, indent=4) + "\n"


def parsed(content: Any, file: str) -> tuple[Mapping[str, str], list[int]]:
    """The parameters as texts, and the points of a segment table in counts; raises BadFile."""
    texts = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise BadFile(
            f"the file {file} holds no parameters: it must have a table of texts, such as "
            '[parameters] with velocity = "5mm/s"'
        )
    points = content.get("segment_points", [])
    if not isinstance(points, list) or not all(map(whole, points)):
        raise BadFile(f"the segment_points in the file {file} are no list of whole numbers")
    return texts, points

# SPDX-License-Identifier: Apache-2.0
"""The page of the figures: all of them as a table, and those for which others have a number as bars
beside theirs (peers.toml).
"""

import math
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from experiments.report_page import render
from figures.common import Figure

PEERS = Path(__file__).with_name("peers.toml")
OURS = "Moire, measured now"
WIDTH, LABEL, BAR, ROW = 960, 260, 220, 26  # px: picture, names, longest bar, height of a row
DECADES = 1.5  # from here on bars are logarithmic
GOOD, BAD, PEER = "#1d6b3a", "#a3161f", "#b6c2cf"

Result = tuple[str, Figure, float | None, Any]  # name, figure, value, seconds or the error


@dataclass(frozen=True)
class Peer:
    name: str
    value: float
    source: str


@dataclass(frozen=True)
class Comparison:
    better: str  # less, more
    peers: Sequence[Peer] = ()
    limit: tuple[float, str] | None = None  # value, what sets it


SIGNS = {"<=": "≤", ">=": "≥", "+-": "±", "um": "µm", "us": "µs", " arcsec": "″", " - ": " − "}
SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def typeset(text: str) -> str:
    """With the signs and powers that readers of a page expect instead of those of a terminal."""
    for plain, sign in SIGNS.items():
        at_word = r"(?![a-z])" if plain[-1].isalpha() else ""
        before = r"(?<![a-z])" if plain[0].isalpha() else ""
        text = re.sub(before + re.escape(plain) + at_word, sign, text)
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(SUPERSCRIPTS), text)


def comparisons(path: Path = PEERS) -> dict[str, Comparison]:
    """{name of a figure: Comparison}"""
    found = {}
    for name, entry in tomllib.loads(path.read_text(encoding="utf-8")).items():
        if entry["better"] not in ("less", "more"):
            raise ValueError(f"{path.name}: {name}: better is less or more, not {entry['better']}")
        limit = (entry["limit"]["value"], entry["limit"]["what"]) if "limit" in entry else None
        peers = [Peer(**peer) for peer in entry["peers"]]
        found[name] = Comparison(entry["better"], peers, limit)
    return found


def scale(values: Sequence[float]) -> tuple[Callable[[float], float], bool]:
    """A function from a value to its share of the longest bar, and whether it is logarithmic."""
    most, least = max(values), min((v for v in values if v > 0), default=0)
    if least > 0 and math.log10(most / least) > DECADES:
        low = math.floor(math.log10(least) - 0.01)
        return lambda v: (math.log10(v) - low) / (math.log10(most) - low) if v > 0 else 0.0, True
    return lambda v: v / most if most > 0 else 0.0, False


def number(value: float, digits: int) -> str:
    """With the digits of the figure, without the zeros at the end."""
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def bars(figure: Figure, value: float, comparison: Comparison) -> tuple[Markup, str]:
    """An SVG picture and its caption: ours and the peers' bars, the best first, and the limit as a
    broken line.
    """
    entries = [(OURS, value, "", True)]
    entries += [(peer.name, peer.value, peer.source, False) for peer in comparison.peers]
    entries.sort(key=lambda entry: entry[1], reverse=comparison.better == "more")
    limit = comparison.limit
    share, logarithmic = scale([entry[1] for entry in entries] + ([limit[0]] if limit else []))
    drawn = [
        {
            "y": 4 + ROW * n,
            "length": max(1.0, BAR * share(size)),
            "colour": (GOOD if figure.good(size) else BAD) if ours else PEER,
            "name": name,
            "value": f"{number(size, figure.digits)} {figure.unit}",
            "source": source,
            "ours": ours,
        }
        for n, (name, size, source, ours) in enumerate(entries)
    ]
    broken = limit and {
        "x": LABEL + BAR * share(limit[0]),
        "y": ROW * len(entries) + 4,
        "words": f"limit: {number(limit[0], figure.digits)} {figure.unit}, {limit[1]}",
    }
    svg = render(
        "bars.svg",
        width=WIDTH,
        height=ROW * (len(entries) + (limit is not None)) + 4,
        label=LABEL,
        row=ROW,
        what=figure.what,
        bars=drawn,
        limit=broken,
    )
    kind = ", logarithmic" if logarithmic else ""
    note = f"{typeset(figure.what)}; {comparison.better} is better{kind}"
    return svg, note


def row(result: Result) -> dict[str, str]:
    name, figure, value, took = result
    made = {"name": name, "what": typeset(figure.what), "bound": typeset(figure.bound_words)}
    if value is None:
        return {**made, "value": f"failed: {took}", "kind": "bad", "took": ""}
    kind = "good" if figure.good(value) else "bad"
    measured = typeset(f"{value:.{figure.digits}f} {figure.unit}")
    return {**made, "value": measured, "kind": kind, "took": f"{took:.0f} s"}


def page(results: Sequence[Result], known: Mapping[str, Comparison] | None = None) -> str:
    known = comparisons() if known is None else known
    pictures = []
    for name, figure, value, _ in results:
        if name in known and value is not None and (known[name].peers or known[name].limit):
            svg, note = bars(figure, value, known[name])
            pictures.append({"name": name, "svg": svg, "note": note})
    reached = sum(value is not None and figure.good(value) for _, figure, value, _ in results)
    summary = f"{reached} of {len(results)} are within their bounds."
    if pictures:
        summary += " Below the table are those for which others have a number."
    values = {"rows": [row(result) for result in results], "pictures": pictures}
    return str(render("figures.html", title="Moire: figures", summary=summary, **values))

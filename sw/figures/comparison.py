# SPDX-License-Identifier: Apache-2.0
"""The page of the figures: all as a table, and those that others have a number for as bars beside
theirs (peers.toml).
"""

import html
import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from moire.analysis.report import STYLE

PEERS = Path(__file__).with_name("peers.toml")
OURS = "Moire, measured now"
WIDTH, LABEL, BAR, ROW = (
    960,
    260,
    220,
    26,
)  # of a picture, in px: all, names, longest bar, height of a row
DECADES = 1.5  # from here on bars are logarithmic
BARS = """\
svg text { font-size: 13px; fill: #1c2733; }
svg .source { font-size: 12px; fill: #64748b; }
svg .ours { font-weight: 600; }
"""


@dataclass(frozen=True)
class Peer:
    name: str
    value: float
    source: str


@dataclass(frozen=True)
class Comparison:
    better: str  # less, more
    peers: list = field(default_factory=list)
    limit: tuple | None = None  # value, what sets it


def comparisons(path=PEERS):
    """{name of a figure: Comparison}"""
    found = {}
    for name, told in tomllib.loads(path.read_text(encoding="utf-8")).items():
        if told["better"] not in ("less", "more"):
            raise ValueError(f"{path.name}: {name}: better is less or more, not {told['better']}")
        limit = (told["limit"]["value"], told["limit"]["what"]) if "limit" in told else None
        found[name] = Comparison(told["better"], [Peer(**peer) for peer in told["peers"]], limit)
    return found


def scale(values):
    """A function from a value to the part of the longest bar, and whether it is logarithmic."""
    most, least = max(values), min((v for v in values if v > 0), default=0)
    if least > 0 and math.log10(most / least) > DECADES:
        low = math.floor(math.log10(least) - 0.01)
        return lambda v: (math.log10(v) - low) / (math.log10(most) - low) if v > 0 else 0.0, True
    return lambda v: v / most if most > 0 else 0.0, False


def number(value, digits):
    """With the digits of the figure, but none that say nothing."""
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def bars(figure, value, comparison):
    """An SVG picture: ours and the peers' in the order of their merit, the limit as a broken line."""
    rows = [
        (OURS, value, "", True),
        *((peer.name, peer.value, peer.source, False) for peer in comparison.peers),
    ]
    rows.sort(key=lambda row: row[1], reverse=comparison.better == "more")
    limit = comparison.limit
    part, logarithmic = scale([row[1] for row in rows] + ([limit[0]] if limit else []))
    height = ROW * (len(rows) + (limit is not None)) + 4
    lines = [
        f'<svg viewBox="0 0 {WIDTH} {height}" width="100%" role="img" aria-label="{html.escape(figure.what, quote=True)}">'
    ]
    for n, (name, told, source, ours) in enumerate(rows):
        y, long = 4 + ROW * n, max(1.0, BAR * part(told))
        kind = ("#1d6b3a" if figure.good(told) else "#a3161f") if ours else "#b6c2cf"
        style = ' class="ours"' if ours else ""
        label = f"{number(told, figure.digits)} {figure.unit}"
        lines += [
            f'<text x="{LABEL - 10}" y="{y + 15}" text-anchor="end"{style}>{html.escape(name)}</text>',
            f'<rect x="{LABEL}" y="{y + 2}" width="{long:.1f}" height="{ROW - 8}" rx="2" fill="{kind}"/>',
            f'<text x="{LABEL + long + 6:.1f}" y="{y + 15}"><tspan{style}>{html.escape(label)}</tspan>'
            f'<tspan class="source" dx="8">{html.escape(source)}</tspan></text>',
        ]
    if limit:
        x, y = LABEL + BAR * part(limit[0]), ROW * len(rows) + 4
        lines += [
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{y}" stroke="#1c2733" stroke-dasharray="4 3"/>',
            f'<text class="source" x="{x:.1f}" y="{y + 14}">limit: {number(limit[0], figure.digits)} {figure.unit}, '
            f"{html.escape(limit[1])}</text>",
        ]
    note = f"{figure.what}; {comparison.better} is better{', logarithmic' if logarithmic else ''}"
    return "\n".join([*lines, "</svg>"]), note


def row(name, figure, value, took):
    if value is None:
        told, kind = f"failed: {took}", "bad"
    else:
        told, kind = (
            f"{value:.{figure.digits}f} {figure.unit}",
            "good" if figure.good(value) else "bad",
        )
    cells = "".join(
        f"<td class=text>{html.escape(text)}</td>" for text in (name, figure.what, figure.wanted)
    )
    return f'<tr>{cells}<td class="{kind}">{html.escape(told)}</td><td>{f"{took:.0f} s" if value is not None else ""}</td></tr>'


def page(rows, known=None):
    """rows: (name, figure, value or None, seconds or the error)."""
    known, pictures = comparisons() if known is None else known, []
    for name, figure, value, _ in rows:
        if name in known and value is not None and (known[name].peers or known[name].limit):
            picture, note = bars(figure, value, known[name])
            pictures.append(
                f"<h2>{html.escape(name)}</h2><figure>{picture}<figcaption>{html.escape(note)}</figcaption></figure>"
            )
    reached = sum(value is not None and figure.good(value) for _, figure, value, _ in rows)
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Moire: figures</title>',
            f"<style>\n{STYLE}{BARS}</style></head><body><main><h1>Figures, measured afresh</h1>",
            f'<p class="summary">{reached} of {len(rows)} are what is wanted of them. Below, those that others have a number for.</p>',
            "<section><table><thead><tr><th class=text>name</th><th class=text>what</th><th class=text>wanted</th><th>measured</th>"
            "<th>took</th></tr></thead><tbody>",
            *(row(*told) for told in rows),
            "</tbody></table></section>",
            *pictures,
            "</main></body></html>",
            "",
        ]
    )

# SPDX-License-Identifier: Apache-2.0
"""One page with the results of an experiment: moves, pictures, and the numbers of the paper.

    result = report.Result(title="S0", moves=moves, traces=traces, compared=[...], seed=1)
    report.write(result, "build/report/s0_stage.html")

The page is one file: the pictures are inside it. An error is target minus true position, in nm.
"""

import base64
import html
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from moire.errors import BadFile, MoireError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Cell = str | tuple[str, str]  # the text of a cell of a table, or (text, class)
Values = Sequence[float]

PAPER_ERROR_NM = 800.0  # S0, its Fig. 6: below one pulse equivalent
COLOURS = ("#1f5fa8", "#c2571a", "#2c7a4b", "#7a3b8f")
DOTS_PER_INCH = 110


@dataclass(frozen=True)
class Move:
    """One move of an axis."""

    axis: str
    target_nm: float
    reached_nm: float  # by the encoder
    true_nm: float
    error_nm: float  # target - true
    time_s: float


@dataclass(frozen=True)
class Trace:
    """The motion of an axis over time; sequences of equal length."""

    axis: str
    time_s: Values
    target_nm: Values
    position_nm: Values  # by the encoder
    true_nm: Values | None = None  # of the model, at the same times, if known


@dataclass(frozen=True)
class Lissajous:
    """Samples of sine and cosine, in ADC counts."""

    axis: str
    sin: Values
    cos: Values


# the heads of a table of numbers of a paper and ours
AGAINST_THE_PAPER = ("", "the paper: a real machine", "here: its model in the twin", "")


@dataclass(frozen=True)
class Compared:
    """A number of the paper, measured on a real machine, and ours, from the twin. `reached` is
    whether ours is at least as good; None where the paper has no number, or where the two are not
    the same quantity.
    """

    what: str
    paper: str
    ours: str
    reached: bool | None = None


@dataclass
class Result:
    """The content of a page."""

    title: str
    moves: list[Move]
    traces: list[Trace] = field(default_factory=list)
    lissajous: list[Lissajous] = field(default_factory=list)
    compared: list[Compared] = field(default_factory=list)
    seed: int | None = None
    facts: dict[str, str] = field(default_factory=dict)  # what else a reader should know
    summary: str = ""
    claim: str = ""  # the result in one sentence
    left_out: str = ""  # what the model of the machine leaves out
    paper_error_nm: float = PAPER_ERROR_NM
    # more pictures, of this experiment only: name -> (caption, PNG)
    drawn: dict[str, tuple[str, bytes]] = field(default_factory=dict)


@dataclass(frozen=True)
class Errors:
    """The errors of many moves, in nm."""

    count: int
    largest: float
    rms: float
    mean: float

    @classmethod
    def of(cls, moves: Iterable[Move]) -> "Errors":
        """The errors of these moves; raises MoireError without a move."""
        errors = [move.error_nm for move in moves]
        if not errors:
            raise MoireError("a report needs at least one move")
        rms = math.sqrt(sum(error * error for error in errors) / len(errors))
        return cls(len(errors), max(map(abs, errors)), rms, sum(errors) / len(errors))


# ------------------------------------------------------------------ pictures


def drawing(
    width: float = 9.0, height: float = 3.4, **panels: Any
) -> "tuple[Figure, Sequence[Axes]]":
    """A figure and its panels; width and height in inches, `panels` as for Figure.subplots."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MoireError(
            "the package matplotlib is missing, a report needs it: pip install matplotlib"
        ) from None
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")
    axes: Sequence[Axes] = figure.subplots(squeeze=False, **panels).ravel().tolist()
    for panel in axes:
        panel.grid(True, color="#dddddd", linewidth=0.6)
        panel.set_axisbelow(True)
        for side in {"top", "right"} & set(panel.spines):  # a polar panel has none
            panel.spines[side].set_visible(False)
    return figure, axes


def png(figure: "Figure") -> bytes:
    """The figure as PNG."""
    out = io.BytesIO()
    figure.savefig(out, format="png")
    return out.getvalue()


def legend(figure: "Figure", panel: "Axes") -> None:
    """Puts the legend above the panels, where it hides nothing."""
    figure.legend(
        *panel.get_legend_handles_labels(),
        loc="outside upper center",
        ncols=4,
        frameon=False,
        fontsize="small",
    )


def colour(number: int) -> str:
    """The colour of a curve."""
    return COLOURS[number % len(COLOURS)]


def length_unit(largest_nm: float) -> tuple[float, str]:
    """The unit, as nm and name, that suits a scale up to this length."""
    return next(
        (
            (worth, name)
            for worth, name in ((1e6, "mm"), (1e3, "\N{MICRO SIGN}m"))
            if largest_nm >= worth
        ),
        (1.0, "nm"),
    )


def largest(arrays: Iterable[Values]) -> float:
    """The largest magnitude in all arrays."""
    return max(
        (abs(float(value)) for array in arrays for value in (min(array), max(array))), default=0.0
    )


def trajectories(traces: Sequence[Trace]) -> bytes:
    """A picture of target and position over time."""
    worth, unit = length_unit(largest([trace.position_nm for trace in traces]))
    figure, (panel,) = drawing()
    for number, trace in enumerate(traces):
        panel.plot(
            trace.time_s,
            [value / worth for value in trace.target_nm],
            color="#555555",
            linewidth=0.9,
            linestyle="--",
            label="target" if number == 0 else None,
        )
        panel.plot(
            trace.time_s,
            [value / worth for value in trace.position_nm],
            color=colour(number),
            linewidth=1.4,
            label=trace.axis,
        )
    panel.set_xlabel("time / s")
    panel.set_ylabel(f"position / {unit}")
    legend(figure, panel)
    return png(figure)


def following_errors(traces: Sequence[Trace]) -> bytes:
    """A picture of the following error over time."""
    errors = [
        [target - position for target, position in zip(trace.target_nm, trace.position_nm)]
        for trace in traces
    ]
    hidden = [
        []
        if trace.true_nm is None
        else [target - true for target, true in zip(trace.target_nm, trace.true_nm)]
        for trace in traces
    ]
    worth, unit = length_unit(largest(errors + [error for error in hidden if error]))
    figure, panels = drawing(height=2.2 * len(traces) + 0.6, nrows=len(traces), sharex=True)
    for number, (panel, trace) in enumerate(zip(panels, traces)):
        if hidden[number]:
            panel.plot(
                trace.time_s,
                [value / worth for value in hidden[number]],
                color="#999999",
                linewidth=0.9,
                label="of the true position",
            )
        panel.plot(
            trace.time_s,
            [value / worth for value in errors[number]],
            color=colour(number),
            linewidth=0.9,
            label="seen by the encoder",
        )
        panel.set_ylabel(f"{trace.axis}: error / {unit}")
    panels[-1].set_xlabel("time / s")
    legend(figure, panels[0])
    return png(figure)


def circles(several: Sequence[Lissajous]) -> bytes:
    """A picture of sine against cosine."""
    figure, panels = drawing(width=min(4.5 * len(several), 9.0), height=4.3, ncols=len(several))
    for number, (panel, signal) in enumerate(zip(panels, several)):
        radius = math.sqrt(
            sum(float(s) ** 2 + float(c) ** 2 for s, c in zip(signal.sin, signal.cos))
            / max(1, len(signal.sin))
        )
        turns = [math.tau * step / 180 for step in range(181)]
        panel.plot(
            [radius * math.cos(turn) for turn in turns],
            [radius * math.sin(turn) for turn in turns],
            color="#999999",
            linewidth=0.8,
        )
        panel.plot(
            signal.cos, signal.sin, linestyle="", marker=".", markersize=2.5, color=colour(number)
        )
        panel.set_aspect("equal")
        panel.set_xlabel(f"{signal.axis}: cosine / ADC counts")
        panel.set_ylabel("sine / ADC counts")
        panel.set_title(f"samples, and a circle of {radius:.1f}", fontsize="medium")
    return png(figure)


def histogram(moves: Sequence[Move], paper_error_nm: float) -> bytes:
    """A picture of the errors: left on the scale of the paper, right on that of the errors."""
    names = list(dict.fromkeys(move.axis for move in moves))
    errors = [[move.error_nm for move in moves if move.axis == name] for name in names]
    widest = largest(errors) or 1.0
    figure, (whole, fine) = drawing(height=3.6, ncols=2)
    for panel, reach in ((whole, max(1.25 * paper_error_nm, 1.05 * widest)), (fine, 1.05 * widest)):
        worth, unit = length_unit(reach / 2) if panel is fine else (1e3, "\N{MICRO SIGN}m")
        edges = [reach / worth * (step / 20 - 1) for step in range(41)]
        panel.hist(
            [[error / worth for error in group] for group in errors],
            bins=edges,
            stacked=True,
            label=names,
            color=[colour(number) for number in range(len(names))],
        )
        panel.set_xlabel(f"error (target \N{MINUS SIGN} true position) / {unit}")
        panel.set_ylabel("moves")
        if paper_error_nm <= reach:
            for side in (-1, 1):
                panel.axvline(
                    side * paper_error_nm / worth,
                    color="#b00020",
                    linewidth=1.2,
                    linestyle="--",
                    label=f"paper: \N{PLUS-MINUS SIGN}{paper_error_nm / 1e3:g} \N{MICRO SIGN}m"
                    if side > 0
                    else None,
                )
    legend(figure, whole)
    whole.locator_params(axis="x", nbins=5)
    whole.set_title("on the scale of the paper's Fig. 6", fontsize="medium")
    fine.set_title("the same, closer", fontsize="medium")
    return png(figure)


def pictures(result: Result) -> dict[str, tuple[str, bytes]]:
    """The pictures of a page: name -> (caption, PNG)."""
    drawn = dict(result.drawn)
    if result.traces:
        drawn["trajectories"] = (
            "Trajectories: target and position by the encoder",
            trajectories(result.traces),
        )
        drawn["following_error"] = (
            "Following error: target minus position",
            following_errors(result.traces),
        )
    if result.lissajous:
        drawn["lissajous"] = ("Sine against cosine, as sampled", circles(result.lissajous))
    drawn["histogram"] = (
        f"Final errors of {len(result.moves)} moves",
        histogram(result.moves, result.paper_error_nm),
    )
    return drawn


# ------------------------------------------------------------------ page

STYLE = """\
:root { color-scheme: light; }
body {
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; color: #1c2733;
  background: #f4f6f8; margin: 0;
}
main { max-width: 62rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 1.7rem; margin: 0 0 .25rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
p.summary { margin: 0 0 1.2rem; color: #48586a; max-width: 46rem; }
section, figure { background: #fff; border: 1px solid #dde3e9; border-radius: 8px; }
section { overflow-x: auto; }
section.tall { max-height: 34rem; overflow-y: auto; }
figure { margin: 1rem 0; padding: 1rem; }
figure img { max-width: 100%; height: auto; display: block; margin: 0 auto; }
figcaption { color: #48586a; font-size: .9rem; margin-top: .5rem; }
table {
  border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums;
  font-size: .92rem;
}
th, td {
  padding: .4rem .8rem; text-align: right; border-bottom: 1px solid #e8edf2;
  white-space: nowrap;
}
th {
  background: #eef2f6; position: sticky; top: 0; font-weight: 600; white-space: normal;
  vertical-align: bottom;
}
th.text, td.text { text-align: left; white-space: normal; }
tbody tr:last-child td { border-bottom: 0; }
p.left-out { color: #48586a; font-size: .92rem; margin: .5rem 0 0; max-width: 46rem; }
.good { color: #1d6b3a; font-weight: 600; }
.bad { color: #a3161f; font-weight: 600; }
.numbers {
  display: grid; grid-template-columns: repeat(auto-fit, minmax(10rem, 1fr)); gap: .8rem;
  margin: 1rem 0;
}
.numbers div {
  background: #fff; border: 1px solid #dde3e9; border-radius: 8px; padding: .7rem .9rem;
}
.numbers b { display: block; font-size: 1.35rem; font-variant-numeric: tabular-nums; }
.numbers span { color: #48586a; font-size: .85rem; }
"""


def cell(text: object, tag: str = "td", kind: str = "") -> str:
    """One cell of a table; `kind` is its class. A unit stays on the line of its slash."""
    text = str(text).replace(" / ", " /\N{NO-BREAK SPACE}") if tag == "th" else text
    attribute = f' class="{kind}"' if kind else ""
    return f"<{tag}{attribute}>{html.escape(str(text))}</{tag}>"


def table(
    head: Sequence[Cell], rows: Iterable[Sequence[Cell]], text_columns: int = 1, tall: bool = False
) -> str:
    """A table; the first columns hold text, the others numbers. A tall one scrolls."""

    def line(cells: Sequence[Cell], tag: str) -> str:
        made = []
        for number, content in enumerate(cells):
            text, kind = content if isinstance(content, tuple) else (content, "")
            made.append(
                cell(
                    text,
                    tag,
                    " ".join(filter(None, ("text" if number < text_columns else "", kind))),
                )
            )
        return "<tr>" + "".join(made) + "</tr>"

    body = "\n".join(line(row, "td") for row in rows)
    section = "<section class=tall>" if tall else "<section>"
    return (
        f"{section}<table><thead>{line(head, 'th')}</thead><tbody>\n{body}\n</tbody></table>"
        "</section>"
    )


def verdict(reached: bool | None) -> tuple[str, str]:
    """The text and the class of a comparison."""
    if reached is None:
        return ("not compared", "")
    return ("reached", "good") if reached else ("not reached", "bad")


def against_the_paper(compared: Sequence[Compared], left_out: str) -> str:
    """The numbers of a paper and ours, and beside them what the model leaves out."""
    rows: list[Sequence[Cell]] = [
        (entry.what, entry.paper, entry.ours, verdict(entry.reached)) for entry in compared
    ]
    note = f'<p class="left-out">The model leaves out: {html.escape(left_out)}.</p>'
    return (
        "<h2>Against the paper</h2>" + table(AGAINST_THE_PAPER, rows) + (note if left_out else "")
    )


def meta(claim: str, left_out: str) -> str:
    """What a start page reads from the head of a page."""
    contents = {"description": claim, "left-out": left_out}
    return "\n".join(
        f'<meta name="{name}" content="{html.escape(text)}">' for name, text in contents.items()
    )


def move_rows(result: Result) -> Iterator[Sequence[Cell]]:
    """The rows of the table of moves."""
    for number, move in enumerate(result.moves, 1):
        kind = "bad" if abs(move.error_nm) > result.paper_error_nm else ""
        yield (
            move.axis,
            str(number),
            f"{move.target_nm / 1e6:.6f}",
            f"{move.reached_nm / 1e6:.6f}",
            f"{move.true_nm / 1e6:.6f}",
            (f"{move.error_nm:+.1f}", kind),
            f"{move.time_s:.3f}",
        )


def page(result: Result) -> str:
    """The whole page as HTML."""
    errors = Errors.of(result.moves)
    share = 100 * errors.largest / result.paper_error_nm
    numbers = [
        (f"{errors.count}", "moves"),
        (f"{errors.largest:.1f} nm", "largest error"),
        (f"{errors.rms:.1f} nm", "rms error"),
        (f"{errors.mean:+.1f} nm", "mean error"),
        (
            f"{share:.2g} %" if share < 100 else f"{share:.0f} %",
            "largest error, of the paper's bound",
        ),
    ]
    tiles = "".join(
        f"<div><b>{html.escape(value)}</b><span>{html.escape(name)}</span></div>"
        for value, name in numbers
    )
    parts = [f"<h1>{html.escape(result.title)}</h1>", f'<div class="numbers">{tiles}</div>']
    if result.summary:
        parts.insert(1, f'<p class="summary">{html.escape(result.summary)}</p>')
    if result.compared:
        parts.append(against_the_paper(result.compared, result.left_out))
    parts.append("<h2>Pictures</h2>")
    for name, (caption, image) in pictures(result).items():
        source = "data:image/png;base64," + base64.b64encode(image).decode()
        words = html.escape(caption)
        parts.append(
            f'<figure id="{name}"><img alt="{words}" src="{source}">'
            f"<figcaption>{words}</figcaption></figure>"
        )
    head = ("axis", "move", "target / mm", "encoder / mm", "true / mm", "error / nm", "time / s")
    parts += ["<h2>Moves</h2>", table(head, move_rows(result), tall=True)]
    seed = {} if result.seed is None else {"seed": str(result.seed)}
    facts = list({**seed, **result.facts}.items())
    if facts:
        parts += ["<h2>How it was measured</h2>", table(("", ""), facts, text_columns=2)]
    title = html.escape(result.title)
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            meta(result.claim, result.left_out),
            f"<title>{title}</title>",
            f"<style>\n{STYLE}</style></head>",
            "<body><main>",
            *parts,
            "</main></body></html>",
            "",
        ]
    )


def write(result: Result, path: str | Path) -> Path:
    """Writes the page and returns its path; raises BadFile."""
    return write_text(Path(path), page(result))


def write_text(path: Path, text: str) -> Path:
    """Writes a file, in a new directory if needed, and returns its path; raises BadFile."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadFile(f"the report {path} cannot be written: {error.strerror}") from None
    return path

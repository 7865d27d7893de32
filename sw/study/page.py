# SPDX-License-Identifier: Apache-2.0
"""How a study is shown: the page with its pictures, the table for the terminal, the raw data."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import isfinite, isinf
from typing import Any

import numpy as np
import pyarrow
from pyarrow import csv, parquet

from campaigns.campaign import CONFIDENCE
from experiments.report_page import picture, text_of
from moire import units
from moire.analysis import report
from study import quantities
from study.analysis import QUANTILES, Findings, Importance, chance_correlation
from study.machines import MACHINES
from study.runs import Outcome
from study.study_file import Effect, Study

SHOWN = 15  # effects in the picture and in the table for the terminal
BAD, CURVE = "#a3161f", "#555555"


def nm_words(error_nm: float | None) -> str:
    """An error, or what stands in its place."""
    if error_nm is None:
        return ""
    return "faults" if isinf(error_nm) else f"{error_nm:+.1f} nm"


def correlation_words(one: Importance) -> str:
    if one.correlation is None:
        return ""
    return f"{one.correlation:+.2f}{'' if one.certain else ' ?'}"


def distribution_words(effect: Effect, unit: str) -> str:
    """The distribution of an effect in a few words."""
    made = effect.distribution
    low, high = (f"{end:g}" for end in (made.low, made.high))
    short = quantities.text_of(0.0, unit).partition(" ")[2] or unit
    if made.normal is None:
        return f"{low} to {high} {short}"
    mean, deviation = made.normal
    limits = [f"from {low}"] * isfinite(made.low) + [f"up to {high}"] * isfinite(made.high)
    return " ".join([f"normal, {mean:g} and {deviation:g} {short}", *limits])


def error_name(study: Study) -> str:
    return "rms error" if study.spec.largest_nm is None else "largest error"


def limit_nm(study: Study) -> float | None:
    """The limit of the error that is shown."""
    return study.spec.rms_nm if study.spec.largest_nm is None else study.spec.largest_nm


def measure_words(study: Study) -> str:
    measure = study.measure
    shortest, longest, travel = (
        units.format_length(value, 6)
        for value in (measure.shortest_move_nm, measure.longest_move_nm, measure.travel_nm)
    )
    before = ["homed"] + ["sine and cosine calibrated"] * measure.calibrated
    before += ["scale measured each 0.5 mm and corrected"] * measure.scale_corrected
    return (
        f"{', '.join(before)}; then {measure.moves} moves of {shortest} to {longest} "
        f"between 0 and {travel}, the same in each run"
    )


# ------------------------------------------------------------------ pictures


def distribution_picture(found: Findings) -> bytes:
    """Histogram of the error and its cumulative distribution, with the limit."""
    errors = found.errors_nm[np.isfinite(found.errors_nm)]
    worth, unit = report.length_unit(float(errors.max()) / 2)
    figure, (left, right) = report.drawing(height=3.6, ncols=2)
    left.hist(errors / worth, bins="auto" if len(errors) > 1 else 1, color=report.colour(0))
    left.set_ylabel("machines")
    ordered = np.sort(found.errors_nm)
    shares = np.arange(1, len(ordered) + 1) / len(ordered)
    right.step(ordered[: len(errors)] / worth, shares[: len(errors)], where="post", color=CURVE)
    right.set_ylabel("share of the machines")
    right.set_ylim(0, 1.02)
    limit = limit_nm(found.study)
    for panel in (left, right):
        panel.set_xlabel(f"{error_name(found.study)} / {unit}")
        panel.set_xlim(left=0)
        if limit is not None:
            label = "specification"
            panel.axvline(limit / worth, color=BAD, linewidth=1.2, linestyle="--", label=label)
    if limit is not None:
        report.legend(figure, left)
    return report.png(figure)


def ranking_picture(found: Findings) -> bytes:
    """The effects that matter most: their increase alone and their rank correlation."""
    shown = list(found.ranking[:SHOWN])[::-1]
    names = [one.name for one in shown]
    figure, (left, right) = report.drawing(
        height=0.8 + 0.27 * len(shown), ncols=2, sharey=True, width_ratios=(1.4, 1)
    )
    alone = [one.increase_nm for one in shown]
    finite = [value for value in alone if value is not None and isfinite(value)]
    longest = max([abs(value) for value in finite] or [1.0])
    left.barh(
        names,
        [0.0 if v is None else longest * 1.1 if isinf(v) else v for v in alone],
        color=[BAD if v is not None and isinf(v) else report.colour(0) for v in alone],
    )
    left.set_xlabel(f"increase of the {error_name(found.study)}, alone / nm (red: faults)")
    right.barh(
        names,
        [one.correlation or 0.0 for one in shown],
        color=[report.colour(1) if one.certain else "#d9b8a3" for one in shown],
    )
    right.set_xlabel("rank correlation, all effects drawn")
    right.set_xlim(-1, 1)
    if len(found.drawn) > 2:
        chance = min(1.0, chance_correlation(found.study, found.drawn))
        for side in (-chance, chance):
            right.axvline(side, color=CURVE, linewidth=0.8, linestyle=":")
    return report.png(figure)


# ------------------------------------------------------------------ page and terminal


def yield_words(found: Findings) -> str:
    """The yield with its bound, in one sentence."""
    share = f"{found.good} of {len(found.drawn)} machines keep the specification"
    return (
        f"{share}: a yield of {found.share:.1%}, at least {found.least_share:.1%} with "
        f"{CONFIDENCE:.0%} confidence"
    )


def fault_rows(found: Findings) -> list[tuple[str, str, str]]:
    return [(str(one.part), str(one.run.seed), one.ended) for one in found.faulted]


def ranking_rows(found: Findings) -> list[list[report.Cell]]:
    effects = {effect.name: effect for effect in found.study.effects}
    entries = MACHINES[found.study.machine].parameters
    rows: list[list[report.Cell]] = []
    for number, one in enumerate(found.ranking, 1):
        effect, unit = effects[one.name], str(entries[one.name]["unit"])
        words = distribution_words(effect, unit)
        alone = f"{effect.alone:g}"
        increase, correlation = nm_words(one.increase_nm), correlation_words(one)
        rows.append([f"{number} {one.name}", unit, words, alone, increase, correlation])
    return rows


def baseline_words(found: Findings) -> str:
    if found.baseline_nm is None:
        return "not run"
    scatter = ""
    if found.scatter_nm is not None:
        scatter = f", {found.scatter_nm:.1f} nm apart over the repeats"
    return f"{nm_words(found.baseline_nm).removeprefix('+')}{scatter}"


def page(found: Findings, facts: Mapping[str, object]) -> str:
    """The whole page, as HTML."""
    study = found.study
    parts: list[str] = []
    numbers: list[tuple[str, str]] = []
    if found.drawn:
        numbers = [
            (f"{found.share:.1%}", f"yield: {found.good} of {len(found.drawn)} machines"),
            (
                f"\N{GREATER-THAN OR EQUAL TO} {found.least_share:.1%}",
                f"{CONFIDENCE:.0%} confidence",
            ),
            *(
                (quantile_words(found, q), f"{error_name(study)}, {q:.0%} of the machines")
                for q in (0.5, 0.95)
            ),
        ]
        if np.isfinite(found.errors_nm).any():
            caption = f"The {error_name(study)} of {len(found.drawn)} machines"
            parts.append(picture("distribution", caption, distribution_picture(found)))
        rows = [(f"{q:.0%}", quantile_words(found, q)) for q in QUANTILES]
        parts += ["<h2>Distribution</h2>", report.table(("machines", error_name(study)), rows)]
    caption = "What matters: each effect alone at its bad value, and its rank correlation"
    parts.append(picture("ranking", caption, ranking_picture(found)))
    head = ("effect", "unit", "distribution", "alone", "increase", "rank correlation")
    parts += ["<h2>What matters</h2>", report.table(head, ranking_rows(found), text_columns=3)]
    if found.faulted:
        columns = ("run", "seed", "why the machine faulted")
        parts += ["<h2>Faults</h2>", report.table(columns, fault_rows(found), text_columns=3)]
    others = {
        "specification": study.spec.words,
        "each run": measure_words(study),
        f"{error_name(study)} with the effects at their baseline": baseline_words(found),
        "increase": "the error with this effect alone at its bad value less that of the baseline "
        "with the same random numbers; one that is smaller than the scatter of the repeats says "
        "nothing",
        "rank correlation": "Spearman's, of the magnitude of the effect with the error of the "
        f"drawn machines; ? where it may be chance, with {CONFIDENCE:.0%} confidence for all "
        "effects together",
        "yield": "share of the drawn machines that keep the specification; its bound is that of "
        "Clopper and Pearson, one side",
    }
    summary = f"Tolerances of the machine {study.machine}: {MACHINES[study.machine].what}."
    title = f"Study of the machine {study.machine}"
    return text_of(title, summary, parts, {**others, **facts}, numbers)


def quantile_words(found: Findings, share: float) -> str:
    return nm_words(found.quantile(share)).removeprefix("+")


def terminal(found: Findings) -> str:
    """The results as text."""
    study, rows = found.study, [f"specification: {found.study.spec.words}"]
    if found.drawn:
        quantiles = ", ".join(f"{q:.0%} {quantile_words(found, q)}" for q in QUANTILES)
        rows += [yield_words(found), f"{error_name(study)} of the machines: {quantiles}"]
    if found.faulted:
        rows.append(f"{len(found.faulted)} machines faulted; the first: {found.faulted[0].ended}")
    rows.append(f"{error_name(study)} with all effects at their baseline: {baseline_words(found)}")
    rows += ["", f"{'effect':<28}{'alone':>14}  {'rank correlation':>18}"]
    rows += [
        f"{one.name:<28}{nm_words(one.increase_nm):>14}  {correlation_words(one):>18}"
        for one in found.ranking[:SHOWN]
    ]
    if len(found.ranking) > SHOWN:
        rows.append(f"and {len(found.ranking) - SHOWN} more, on the page")
    return "\n".join(rows)


# ------------------------------------------------------------------ data


def values_of(found: Findings) -> dict[str, Any]:
    """The results for JSON; an infinite error is the text "faults"."""

    def plain(value: float | None) -> float | str | None:
        return "faults" if value is not None and isinf(value) else value

    values: dict[str, Any] = {
        "machine": found.study.machine,
        "baseline_nm": plain(found.baseline_nm),
        "scatter_nm": found.scatter_nm,
        "ranking": [
            {**asdict(one), "increase_nm": plain(one.increase_nm)} for one in found.ranking
        ],
    }
    if found.drawn:
        values |= {
            "machines": len(found.drawn),
            "good": found.good,
            "yield": found.share,
            "yield_at_least": found.least_share,
            "quantiles_nm": {f"{q:g}": plain(found.quantile(q)) for q in QUANTILES},
        }
    return values


def row(outcome: Outcome, moves: int) -> dict[str, Any]:
    """One run of the raw data."""
    errors: list[float | None] = [*outcome.errors_nm, *[None] * (moves - len(outcome.errors_nm))]
    faulted = bool(outcome.ended)
    return {
        "run": outcome.part,
        "drawn": outcome.run.drawn,
        "effect": outcome.run.effect,
        "seed": outcome.run.seed,
        "largest_nm": None if faulted else outcome.largest_nm,
        "rms_nm": None if faulted else outcome.rms_nm,
        "ended": outcome.ended,
        "seconds": outcome.seconds,
        **{f"error_{n}_nm": error for n, error in enumerate(errors)},
        **outcome.run.values,
    }


def raw_data(study: Study, outcomes: Sequence[Outcome]) -> dict[str, bytes]:
    """{name of a file: its content}: a row for each run, with what was drawn and each error."""
    table = pyarrow.Table.from_pylist([row(one, study.measure.moves) for one in outcomes])
    as_parquet, as_csv = io.BytesIO(), io.BytesIO()
    parquet.write_table(table, as_parquet)
    csv.write_csv(table, as_csv)
    return {"runs.parquet": as_parquet.getvalue(), "runs.csv": as_csv.getvalue()}

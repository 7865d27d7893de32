# SPDX-License-Identifier: Apache-2.0
"""What a figure is: its bound, its short form and its seed; the record of the measured values, and
README's table that is made from it.
"""

import inspect
import io
import json
import math
from datetime import date

import pytest
from rich.console import Console

from experiments import start_page
from figures import comparison, record, synthesis
from figures import figure as command
from figures.common import Absent, Bar, Figure, Quick, collected, seeds, shares, within
from tables import readme_figures


@pytest.mark.parametrize(
    "bound, good, bad",
    [
        ("<= 0.5", 0.5, 0.51),
        ("< 3", 2.99, 3),
        (">= 4", 4, 3.99),
        ("> 5", 5.01, 5),
        ("0", 0, 1),
    ],
)
def test_a_bound_holds_on_one_side(bound, good, bad):
    assert within(good, bound) and not within(bad, bound)


def test_what_is_no_bound_is_refused():
    with pytest.raises(ValueError):
        within(1, "at most 3")


def test_every_figure_has_a_bound_a_short_form_and_words():
    for name, figure in collected("FIGURES").items():
        within(1, figure.bound)
        assert figure.what and figure.quick.words, name
        if figure.quick.bound:
            within(1, figure.quick.bound)
        for argument in figure.quick.arguments:
            parameters = inspect.signature(figure.measure).parameters
            assert argument in parameters, f"{name}: no {argument}"


def drawn(count=10, seed=1):
    return 100 * seed + count


def test_short_form_and_seed_reach_the_function():
    figure = Figure(drawn, "", "a sum", "> 0", Quick({"count": 2}, "two"))
    assert figure.seeded and not Figure(lambda: 1, "", "one", "1", Quick()).seeded
    assert [figure.measured(quick, seed) for quick in (False, True) for seed in (None, 3)] == [
        110,
        310,
        102,
        302,
    ]


def test_a_short_form_is_judged_by_its_own_bound_or_not_at_all():
    strict, loose, free = (
        Figure(drawn, "", "", "0", Quick(bound=bound)) for bound in (None, "< 3", "")
    )
    assert [figure.passes(2, quick=True) for figure in (strict, loose, free)] == [0, 1, 1]
    assert [figure.passes(2) for figure in (strict, loose, free)] == [0, 0, 0]
    assert not free.passes(math.nan, quick=True) and not free.passes(math.inf, quick=True)


def test_shares_cover_the_whole_with_seeds_of_their_own():
    assert list(shares(25, 10, 1)) == [(10, 1), (10, 2), (5, 3)]
    assert not set(seeds(1, 1000)) & set(seeds(2, 1000))


def test_the_command_judges_records_and_passes_the_seed_on(monkeypatch, tmp_path, capsys):
    figures = {
        "small": Figure(drawn, "nm", "a small one", "< 5", Quick({"count": -98}, "less"), 1),
        "fixed": Figure(lambda: 2.0, "nm", "a fixed one", "2", Quick(), 1),
    }
    path = tmp_path / "figures.toml"
    monkeypatch.setattr(command, "collected", lambda attribute: figures)
    monkeypatch.setattr(record.add, "__defaults__", (path,))
    assert command.main(["small"]) == 1 and command.main(["fixed"]) == 0
    assert command.main(["small", "--quick"]) == 0
    assert capsys.readouterr().out == "small 110.0 nm\nfixed 2.0 nm\nsmall 2.0 nm\n"
    entries = record.read(path)
    assert {name: entry.value for name, entry in entries.items()} == {"small": 110, "fixed": 2}
    assert entries["fixed"].date == date.today() and entries["fixed"].bound == "2"
    with pytest.raises(SystemExit):
        command.main(["fixed", "--seed", "2"])
    before = path.read_text()
    assert command.main(["small", "--seed", "2"]) == 1 and path.read_text() == before
    path.unlink()
    assert command.main(["fixed", "--unrecorded"]) == 0 and not path.exists()


def needs_what_is_absent():
    raise Absent("Chromium is not installed: make chromium")


def test_a_figure_whose_program_is_absent_is_not_measured_and_does_not_fail_all_figures(
    monkeypatch, tmp_path, capsys
):
    figures = {
        "drawn": Figure(needs_what_is_absent, "ms", "a picture", "< 5", Quick()),
        "fixed": Figure(lambda: 2.0, "nm", "a fixed one", "2", Quick(), 1),
    }
    path = tmp_path / "figures.toml"
    monkeypatch.setattr(command, "collected", lambda attribute: figures)
    monkeypatch.setattr(start_page.publish, "__defaults__", (tmp_path,))
    monkeypatch.setattr(record.add, "__defaults__", (path,))
    assert command.main(["drawn"]) == 1
    assert "drawn: not measured: Chromium is not installed" in capsys.readouterr().err
    assert command.main(["--all"]) == 0
    assert capsys.readouterr().out == "fixed 2.0 nm\n" and set(record.read(path)) == {"fixed"}
    assert "make chromium" in (tmp_path / "figures.html").read_text()
    assert (
        "fixed" not in (start := (tmp_path / "index.html").read_text()) and "figures.html" in start
    )
    figures["fixed"] = Figure(lambda: 3.0, "nm", "a fixed one", "2", Quick(), 1)
    capsys.readouterr()
    assert command.main(["--all"]) == 1
    last = capsys.readouterr().err.strip().splitlines()[-1]
    assert last == "0 of 2 pass; not measured: drawn; failed: fixed"


def test_the_record_holds_figures_of_today_with_their_units_and_bounds():
    figures, entries = collected("FIGURES"), record.read()
    assert set(entries) <= set(figures)
    table = readme_figures.table(figures, entries)
    assert all(f"| `{name}`: " in table for name in figures)


def test_the_table_refuses_a_record_of_another_bound():
    figure = Figure(drawn, "nm", "a small one", "< 5", Quick())
    good = record.Entry(3.0, "nm", "< 5", date(2026, 1, 2), "2 cores")
    other = record.Entry(3.0, "nm", "< 6", date(2026, 1, 2), "2 cores")
    assert "| 3 nm | < 5 |" in readme_figures.table({"small": figure}, {"small": good})
    with pytest.raises(ValueError):
        readme_figures.table({"small": figure}, {"small": other})


def test_signs_and_powers_are_typeset():
    text = "10^5 moves <= 3 um, +-2 arcsec, sum of 20 us"
    assert comparison.typeset(text) == "10⁵ moves ≤ 3 µm, ±2″, sum of 20 µs"


def test_lut4s_count_carry_cells_twice_and_lut_ram_six_times(tmp_path):
    kinds = ["LUT4", "LUT4", "CCU2C", "TRELLIS_DPR16X4", "TRELLIS_FF", "PFUMX"]
    cells = {str(n): {"type": kind} for n, kind in enumerate(kinds)}
    netlist = tmp_path / "netlist.json"
    netlist.write_text(json.dumps({"modules": {"top": {"cells": cells}}}))
    assert synthesis.lut4s(netlist, "top") == 2 + 2 + 6


def test_a_design_that_does_not_fit_is_reported_with_what_is_too_much(tmp_path):
    log = tmp_path / "log"
    log.write_text(
        "Info: \t         ICESTORM_LC: 11472/   5280   217%\n"
        "Info: \t        ICESTORM_RAM:    30/     30   100%\n"
    )
    assert synthesis.overfull(log) == "11472 ICESTORM_LC of 5280"
    assert synthesis.overfull(tmp_path / "none") == ""


@pytest.mark.parametrize("terminal", [False, True])
def test_where_there_is_no_terminal_a_line_tells_each_tenth_of_long_work(terminal):
    text = io.StringIO()
    with Bar("moves", Console(file=text, force_terminal=terminal)) as progress:
        task = progress.add_task("", total=40)
        for _ in range(40):
            progress.advance(task)
        task = progress.add_task("", total=2.5)
        progress.update(task, completed=1.0)
    told = [line.split(" after ")[0] for line in text.getvalue().splitlines() if "after" in line]
    tenths = [f"moves: {percent} %" for percent in (*range(10, 100, 10), 40)]
    assert told == ([] if terminal else tenths)

# SPDX-License-Identifier: Apache-2.0
"""`moire study`: its file, its runs, what they say, and the command. Most runs are of a machine
whose error is a formula; one study is of the stage in the twin.
"""

import csv
import io
import json
import tomllib
from contextlib import contextmanager
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from pyarrow import parquet

from campaigns import runner
from moire.cli import command_line
from moire.errors import BadFile, MotionFailed, NoAnswer, UnitError
from study import command, quantities
from study.analysis import findings, rank_correlation
from study.machines import MACHINES, Machine, Measured
from study.page import page
from study.runs import Outcome, run_of
from study.study_file import Distribution, read
from tb.bench import seed
from twin.parameters import tables

SEED = seed()
TWO = """\
machine = "formula"
[spec]
largest_error = "100 nm"
[measure]
moves = 3
[monte_carlo]
runs = 40
[effects]
scale_linear = { uniform = ["0 ppm", "20 ppm"] }
motor_cogging = "typical to bad"
"""


# ------------------------------------------------------------------ values and their units


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("0.3 um", "m", 0.3e-6),
        ("-0.3\N{MICRO SIGN}m", "m", -0.3e-6),
        ("12.5 um/s", "m/s rms in each third of an octave", 12.5e-6),
        ("20 ppm", "m/m", 20e-6),
        ("2 %", "of the torque", 0.02),
        (0.02, "of amplitude at 120 mm", 0.02),
        ("2e-2", "of sine", 0.02),
        ("6 arcmin", "degree at 120 mm", 0.1),
        ("1 arcsec", "rad", np.pi / 180 / 3600),
        ("11 ppm/K", "1/K", 11e-6),
        ("5 pm/sqrt(Hz)", "m/sqrt(Hz)", 5e-12),
        ("100 kHz", "Hz", 1e5),
    ],
)
def test_a_value_has_the_unit_of_its_parameter_or_a_prefix(text, unit, value):
    assert quantities.parse(text, unit) == pytest.approx(value)


@pytest.mark.parametrize(
    "text, unit, reason",
    [
        ("0.3", "m", "0.3 has no unit: write a number with m, pm, nm, um"),
        (3, "V", "3 has no unit"),
        ("0.3 um", "V", "has the unit 'um': write a number with V,"),
        ("3 V", "of the torque", "has the unit 'V': write a number with no unit, %"),
        ("large", "m", "'large' is no value"),
        (True, "of amplitude", "True is no value"),
    ],
)
def test_another_unit_is_refused_with_those_that_may_be_written(text, unit, reason):
    with pytest.raises(UnitError) as refused:
        quantities.parse(text, unit)
    assert reason in str(refused.value)


def test_every_parameter_can_be_written_and_read_back():
    for name, entry in tables.load("stage").items():
        for value in (entry["value"], entry.get("bad", 1.0), -0.25):
            text = quantities.text_of(float(value), entry["unit"])
            assert quantities.parse(text, entry["unit"]) == pytest.approx(value, rel=1e-5), name


# ------------------------------------------------------------------ the file


def test_the_example_is_a_study_of_all_effects_of_the_machine_with_their_sources():
    text = command.example()
    study = read(text, "study.toml")
    typical, bad = tables.world("typical"), tables.world("bad")
    found = {effect.name: effect for effect in study.effects}
    assert found.keys() == {name for name in bad if not name.startswith("piezo_")}
    for name, effect in found.items():
        assert effect.alone == pytest.approx(bad[name]), name
        assert effect.baseline == typical[name]
        ends = sorted((typical[name], bad[name]))
        assert [effect.distribution.at(1e-9), effect.distribution.at(1 - 1e-9)] == pytest.approx(
            ends, rel=1e-4
        )
        assert tables.load("stage")[name]["why"] in text
    assert study.spec.largest_nm == 300 and study.runs == 100 and study.measure.moves == 10


def changed(old, new):
    """The example with something changed that it has once, and the line where that is."""
    text = command.example()
    assert text.count(old) == 1, old
    return text.replace(old, new), text[: text.index(old)].count("\n") + 1


@pytest.mark.parametrize(
    "old, new, reason",
    [
        ("scale_walk =", "scale_wlak =", "no effect of s0 'scale_wlak', did you mean scale_walk"),
        ("scale_walk =", "piezo_noise =", "there is no effect of s0 'piezo_noise'"),
        ('"300 mV"', '"0.3 um"', "'0.3 um' has the unit 'um': write a number with V, pV"),
        ('"300 mV"', "0.3", "0.3 has no unit"),
        ('"300 mV"', '"1e999 V"', "'1e999 V' is too large"),
        ('"50 mV", "300 mV"', '"0.3 V", "50 mV"', "uniform of supply_ripple is empty: 0.3 V to 50"),
        ('"50 mV"', '"-50 mV"', "supply_ripple cannot be below 0 V: it is '-50 mV' here"),
        ('uniform = ["50 mV", "300 mV"]', "uniform = []", "uniform is a pair [low, high], not []"),
        ('{ uniform = ["50 mV", "300 mV"] }', '"0.1 V"', "supply_ripple needs a distribution"),
        ('uniform = ["50 mV"', 'unifrom = ["50 mV"', "did you mean uniform?"),
        (
            'uniform = ["50 mV", "300 mV"]',
            'normal = ["0.1 V", "0 V"]',
            "the standard deviation of supply_ripple is above zero",
        ),
        (
            'uniform = ["50 mV", "300 mV"]',
            'normal = ["0.1 V", "0.01 V"], within = ["0.2 V", "0.3 V"]',
            "the normal distribution of supply_ripple is not within these",
        ),
        ("drift_time =", "drift_times =", "no parameter of s0 'drift_times', did you mean"),
        ('temperature_time = "10 s"', 'temperature_time = "0 s"', "cannot be below 1 s"),
        ('temperature_time = "10 s"', 'scale_walk = "1 nm"', "'scale_walk' is in [effects], too"),
        ('machine = "s0"', 'machine = "s9"', "no machine for a study 's9': there are s0"),
        ('largest_error = "0.3 um"', "largest_error = 0.3", "0.3 has no unit: write a length"),
        ('largest_error = "0.3 um"', 'largest_error = "0 um"', "is a length above zero"),
        ('largest_error = "0.3 um"', 'largest_error = "1e999 nm"', "and below 1000 m, not '1e999"),
        ('largest_error = "0.3 um"', 'biggest_error = "3 um"', "no key of [spec] 'biggest_error'"),
        ("moves = 10 ", "moves = 0 ", "moves is a whole number from 1 to 10000, not 0"),
        ('travel = "10 mm"', 'travel = "1 m"', "the travel of s0 is 100mm"),
        ('travel = "10 mm"', 'travel = "1 mm"', "longest_move is longer than the travel"),
        ("calibrated = false", 'calibrated = "no"', "calibrated is true or false, not 'no'"),
        ('others = "typical"', 'others = "good"', "others is 'typical' or 'nominal', not 'good'"),
        ("runs = 100", "runs = -1", "runs is a whole number from 0 to 100000, not -1"),
        ("[monte_carlo]", "[monte_carlos]", "no key 'monte_carlos', did you mean monte_carlo?"),
        ('machine = "s0"', 'machine = "s0', "this is no TOML: "),
    ],
)
def test_what_is_wrong_in_a_file_is_refused_with_its_line(old, new, reason):
    text, line = changed(old, new)
    if "longer than the travel" in reason:
        line += 2
    with pytest.raises(BadFile) as refused:
        read(text, "my.toml")
    assert reason in str(refused.value)
    assert str(refused.value).startswith(f"my.toml, line {line}: ")


def test_what_is_missing_is_refused():
    for text, reason in (
        ("", "the machine is missing"),
        (
            'machine = "s0"\n[effects]\nscale_walk = "typical to bad"\n',
            "[spec] needs largest_error",
        ),
        ('machine = "s0"\n[spec]\nrms_error = "1 nm"\n', "[effects] has none"),
    ):
        with pytest.raises(BadFile, match="^my.toml"):
            read(text, "my.toml")
        with pytest.raises(BadFile) as refused:
            read(text, "my.toml")
        assert reason in str(refused.value)


def test_tables_may_be_written_out_and_errors_still_have_the_line():
    text = (
        'machine = "s0"\nspec.rms_error = "10 nm"\n[effects.scale_walk]\n'
        'normal = ["5 nm", "5 nm"]\nwithin = ["0 nm", "{}"]\nalone = "12 nm"\n'
    )
    (effect,) = read(text.format("20 nm"), "f").effects
    assert effect.alone == pytest.approx(12e-9)
    assert effect.distribution == Distribution(0.0, pytest.approx(20e-9), (5e-9, 5e-9))
    with pytest.raises(BadFile, match="^f, line 5: '20 V' has the unit 'V'"):
        read(text.format("20 V"), "f")


# ------------------------------------------------------------------ what is drawn


def test_a_distribution_gives_each_value_its_share():
    even = Distribution(-1.0, 3.0)
    assert [even.at(share) for share in (0.25, 0.5)] == [0.0, 1.0]
    bell = Distribution(-inf, inf, (5.0, 2.0))
    assert bell.at(0.5) == pytest.approx(5) and bell.at(0.9772498) == pytest.approx(9, abs=1e-4)
    half = Distribution(5.0, inf, (5.0, 2.0))
    assert half.at(0.5) == pytest.approx(5 + 0.6744898 * 2, abs=1e-5)
    assert half.at(1e-12) == pytest.approx(5, abs=1e-6) and half.end(upper=True) == 9
    assert Distribution(4.0, 6.0, (5.0, 2.0)).end(upper=False) == 4


def formula_study(text=TWO, **changes):
    for old, new in changes.items():
        text = text.replace(old, new)
    return read(text, "two.toml")


def test_runs_alone_share_random_numbers_and_drawn_ones_are_independent(formula):
    study = formula_study()
    first = 1 + 10**6
    runs = [run_of(study, part, first + part) for part in range(study.parts)]
    alone, drawn = runs[: study.singles], runs[study.singles :]
    assert [run.effect for run in alone] == ["", "scale_linear", "motor_cogging"] * 2
    assert [run.seed for run in alone] == [first] * 3 + [first + 1] * 3
    assert alone[0].values == {"scale_linear": 5e-6, "motor_cogging": 3e-4}
    assert alone[1].values == {"scale_linear": pytest.approx(20e-6), "motor_cogging": 3e-4}
    assert alone[5].values == {"scale_linear": 5e-6, "motor_cogging": pytest.approx(2e-3)}
    assert len({run.seed for run in drawn}) == len(drawn) == 40
    values = np.array([run.values["scale_linear"] for run in drawn])
    assert 0 <= values.min() < 4e-6 and 16e-6 < values.max() <= 20e-6
    more = formula_study(**{"runs = 40": "runs = 50"})
    assert [run_of(more, part, first + part) for part in range(study.parts)] == runs


# ------------------------------------------------------------------ studies


@pytest.fixture
def formula(monkeypatch):
    """A machine whose largest error is a formula, and the seeds that it was run with."""
    seeds = []

    def run(values, measure, seed, targets):
        seeds.append(seed)
        noise = np.random.default_rng(seed).normal()
        error = 7e6 * values["scale_linear"] + 1e3 * values["motor_cogging"] + noise
        if values.get("scale_walk", 0.0) > 15e-9:
            raise MotionFailed("ended_by_fault", 1, "the axis cannot home")
        return Measured([error / 4, -error, error / 2][: measure.moves], 1.5)

    machine = Machine(
        "formula", "a formula", "stage", 1e8, run, lambda: None, lambda measure: 2.0, ("piezo_",)
    )
    monkeypatch.setitem(MACHINES, "formula", machine)
    threads = runner.local

    @contextmanager
    def local(workers):
        with threads(workers, processes=False) as client:
            yield client

    monkeypatch.setattr(command.runner, "local", local)
    return seeds


@pytest.fixture
def study(tmp_path, monkeypatch):
    """moire study with a file of this text: (exit code, what it printed, its errors)."""

    def run(text, *arguments):
        file, out, err = tmp_path / "two.toml", io.StringIO(), io.StringIO()
        file.write_text(text)
        results = ["--results", str(tmp_path / "results"), "--workers", "2"]
        code = command_line.main(["study", str(file), *results, *arguments], out=out, err=err)
        return code, out.getvalue(), err.getvalue()

    return run


def test_a_study_finds_the_distribution_the_yield_and_the_effect_that_matters(
    formula, study, tmp_path
):
    code, out, err = study(TWO, "--seed", str(SEED))
    assert code == 0, err
    assert len(formula) == 46
    table = [line.split() for line in out.splitlines() if line.startswith(("scale_", "motor_"))]
    assert [row[0] for row in table] == ["scale_linear", "motor_cogging"]
    assert float(table[0][1]) == pytest.approx(7e6 * 15e-6, abs=0.06)  # the noise is the same
    assert float(table[1][1]) == pytest.approx(1e3 * 1.7e-3, abs=0.06)
    assert float(table[0][3]) > 0.9 and "?" not in table[0] and "?" in table[1]
    (folder,) = {path.parent for path in tmp_path.rglob("runs.csv")}
    rows = list(csv.DictReader((folder / "runs.csv").open()))
    raw = parquet.read_table(folder / "runs.parquet").to_pylist()
    assert len(rows) == len(raw) == 46
    for row, one in zip(rows, raw, strict=True):
        errors = [one[f"error_{n}_nm"] for n in range(3)]
        assert one["largest_nm"] == max(map(abs, errors)) == float(row["largest_nm"])
        assert one["rms_nm"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    drawn = [one for one in raw if one["drawn"]]
    good = sum(one["largest_nm"] <= 100 for one in drawn)
    assert 20 < good < 40 and f"{good} of 40 machines keep the specification" in out
    html = (folder / "page.html").read_text()
    assert html.count("data:image/png;base64,") == 2 and f"{good} of 40 machines" in html
    assert "1 scale_linear" in html and "largest error up to 100nm" in html


def test_a_second_study_repeats_nothing_and_more_runs_are_added(formula, study):
    ten = TWO.replace("runs = 40", "runs = 10")
    assert study(ten)[0] == 0 and len(formula) == 16
    code, wider, _ = study(ten.replace("100 nm", "20 um"))
    assert code == 0 and len(formula) == 16 and "16 of 16 runs are from before" in wider
    assert "10 of 10 machines keep the specification" in wider
    assert study(ten, "--runs", "12")[0] == 0 and len(formula) == 18
    assert len(set(formula)) == 14
    study(ten.replace("moves = 3", "moves = 2"), "--seed", "2")
    assert len(formula) == 18 + 16


def test_a_study_that_is_interrupted_goes_on(formula, study, monkeypatch):
    real = runner.run

    def interrupted(client, jobs, store, watch):
        real(client, jobs, store, watch, lambda: len(formula) < 7)
        raise KeyboardInterrupt

    monkeypatch.setattr(command.runner, "run", interrupted)
    code, _, err = study(TWO, "--runs", "9")
    done = len(formula)
    assert code == 130 and "the same command goes on from here" in err and 7 <= done < 12
    monkeypatch.setattr(command.runner, "run", real)
    code, out, _ = study(TWO, "--runs", "9")
    assert code == 0 and len(formula) == 15 and f"{done} of 15 runs are from before" in out


def test_a_machine_that_cannot_home_is_a_bad_one(formula, study):
    text = TWO.replace(
        "scale_linear =", 'scale_walk = { uniform = ["0 nm", "20 nm"] }\nscale_linear ='
    )
    code, out, err = study(text.replace("100 nm", "20 um"))
    assert code == 0, err
    row = next(line for line in out.splitlines() if line.startswith("scale_walk"))
    assert row.split()[1] == "faults" and "the first: the axis cannot home" in out
    faulted = int(out.partition(" machines faulted")[0].rpartition("\n")[2])
    assert 3 < faulted < 20
    assert f"{40 - faulted} of 40 machines keep the specification" in out
    code, out, _ = study(text.replace("100 nm", "20 um"), "--json")
    answer = json.loads(out)
    assert answer["good"] == 40 - faulted and answer["ranking"][0]["increase_nm"] == "faults"
    assert answer["quantiles_nm"]["0.99"] == "faults"


def test_a_run_that_breaks_is_reported_and_the_others_are_evaluated(formula, study, monkeypatch):
    """An error that is not of the machine counts as no result, neither good nor bad."""

    def breaks(values, measure, seed, targets):
        if seed == 9:
            raise NoAnswer(1)
        return Measured([1.0], 1.0)

    monkeypatch.setitem(MACHINES, "formula", replace(MACHINES["formula"], run=breaks))
    code, out, err = study(TWO, "--runs", "5")
    assert code == 1 and "1 runs are not done; run 8: NoAnswer: nobody answers" in err


def test_the_yield_has_the_bound_of_clopper_and_pearson(formula):
    study = formula_study(**{"runs = 40": "runs = 59"})
    drawn = [
        Outcome(part, run_of(study, part, 1 + part), (float(part),))
        for part in range(study.singles, study.parts)
    ]
    found = findings(study, drawn)
    assert found.good == 59 and found.share == 1 and found.least_share == pytest.approx(0.95, 1e-3)
    assert found.quantile(0.5) == study.singles + 29 and found.quantile(1) == study.parts - 1
    assert found.baseline_nm is None and "yield: 59 of 59" in page(found, {})


def test_the_rank_correlation_is_spearmans():
    first, second = np.array([1.0, 2, 3, 4, 5]), np.array([1.0, 8, 27, inf, 64])
    assert rank_correlation(first, second) == pytest.approx(0.9)
    assert rank_correlation(first, -(first**3)) == pytest.approx(-1)
    assert rank_correlation(first, np.ones(5)) == 0
    ties = np.array([1.0, 1, 2, 2, 3])
    assert rank_correlation(first, ties) == pytest.approx(0.9487, abs=1e-4)


# ------------------------------------------------------------------ the command


def test_a_dry_run_shows_what_would_be_done_and_does_nothing(formula, study, tmp_path):
    code, out, _ = study(TWO, "--dry-run")
    assert code == 0 and not formula and not list(tmp_path.rglob("*.parquet"))
    assert "46 runs of the machine formula: 2 times each of 2 effects alone and none, 40" in out
    assert "46 are left: about 1 minutes on 2 workers, 2.0 s a run (estimated" in out
    study(TWO, "--runs", "2")
    code, out, _ = study(TWO, "--dry-run", "--json")
    answer = json.loads(out)
    assert (answer["done"], answer["left"], answer["runs"]) == (8, 38, 46)


def test_the_example_is_printed_and_bad_calls_are_refused(study, tmp_path):
    out, err = io.StringIO(), io.StringIO()
    assert command_line.main(["study", "--example"], out=out, err=err) == 0
    assert tomllib.loads(out.getvalue()) == tomllib.loads(command.example())
    for arguments, reason in (
        (["study"], "write the FILE of a study, or --example"),
        (["study", "a.toml", "--example"], "write the FILE of a study, or --example"),
        (["study", str(tmp_path / "none.toml")], "none.toml cannot be read"),
        (["study", "a.toml", "--", "home"], "'study' must be the only command of its call"),
    ):
        err = io.StringIO()
        assert command_line.main(arguments, out=out, err=err) == 2 and reason in err.getvalue()
    code, _, err = study(TWO.replace('machine = "formula"', 'machine = "s0"'), "--runs", "-1")
    assert code == 2 and "--runs takes 0 and up" in err


def test_a_study_of_the_stage_in_the_twin(formula, study, tmp_path):
    """`formula` for its cluster of threads: the twin is in this process."""
    text = """\
machine = "s0"
[spec]
largest_error = "100 nm"
[measure]
moves = 1
travel = "100 um"
shortest_move = "100 um"
longest_move = "100 um"
[one_at_a_time]
repeats = 1
[monte_carlo]
runs = 0
[fixed]
travel_start_lowest = "-0.95 mm"
travel_start_highest = "-0.94 mm"
[effects]
scale_linear = { uniform = ["0.49 %", "0.51 %"] }
"""
    code, out, err = study(text)
    assert code == 0, err
    (file,) = tmp_path.rglob("runs.parquet")
    base, alone = (row["error_0_nm"] for row in parquet.read_table(file).to_pylist())
    assert abs(base) < 50
    # The scale indicates 0.51 % too much, so the stage stops so much too early.
    assert alone - base == pytest.approx(510, abs=30)
    increase = next(line for line in out.splitlines() if line.startswith("scale_linear")).split()[1]
    assert float(increase) == pytest.approx(abs(alone) - abs(base), abs=0.1)

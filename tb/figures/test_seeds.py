# SPDX-License-Identifier: Apache-2.0
"""Every figure that draws random numbers is measured with ten seeds, and each that misses its bound
with one of them is counted once.
"""

import dataclasses

import pytest

from campaigns import record
from figures import seeds
from figures.common import collected

NAMES = ("sde_nm_max", "s1_k3_arcsec", "link_lut")


@pytest.fixture
def calls(monkeypatch, tmp_path):
    """The measurements so far, in a record of its own: the second figure misses its bound with the
    seeds 2 and 3, the last one never ends.
    """
    path, made = tmp_path / "seeds.toml", []
    monkeypatch.setattr(record, "SEEDS", path)
    monkeypatch.setitem(record.HEADS, path, "# a record\n")

    def measured(name, seed, quick):
        made.append((name, seed, quick))
        if name == NAMES[2]:
            return False, f"no such program, seed {seed}"
        return not (name == NAMES[1] and seed in (2, 3)), f"{name} {seed}.5 nm, seed {seed}"

    monkeypatch.setattr(seeds, "measured", measured)
    monkeypatch.setattr(seeds, "seeded", lambda: NAMES)
    return made


def test_figures_that_miss_their_bound_with_any_seed_are_counted_once(calls):
    assert seeds.seeds_failed(count=4) == 2
    assert sorted(calls) == sorted((name, n, False) for name in NAMES for n in (1, 2, 3, 4))
    entry = seeds.entries()[NAMES[1]]
    assert entry["seeds"] == 4 and entry["values"] == [1.5, 2.5, 3.5, 4.5]
    assert entry["missed"] == [f"{NAMES[1]} {n}.5 nm, seed {n}" for n in (2, 3)]
    assert seeds.entries()[NAMES[2]]["values"] == []
    table = seeds.summary().splitlines()
    assert [line.split()[-1] for line in table[1:4]] == ["0", "2", "4"]
    assert table[1].split()[-3:-1] == ["1.5", "4.5"] and table[-1] == "not measured: none"


def test_what_has_held_its_bound_is_not_measured_again(calls, monkeypatch):
    seeds.seeds_failed(count=4)
    calls.clear()
    assert seeds.seeds_failed(count=4) == 2
    assert {name for name, *_ in calls} == {*NAMES[1:]}
    assert seeds.due(5) == [*NAMES], "of another seed nothing is known"
    figures = collected("FIGURES")
    harder = {**figures, NAMES[0]: dataclasses.replace(figures[NAMES[0]], bound="<= 0.001")}
    monkeypatch.setattr(seeds, "collected", lambda kind: harder)
    assert seeds.due(4) == [*NAMES], "it has another bound now"
    assert seeds.summary().splitlines()[-1] == f"not measured: {NAMES[0]}"


def test_an_interrupted_run_goes_on_with_the_next_figure(calls):
    next(seeds.recorded(NAMES, 4))
    calls.clear()
    seeds.seeds_failed(count=4)
    assert {name for name, *_ in calls} == {*NAMES[1:]}


def test_the_short_form_takes_other_seeds_and_records_nothing(calls):
    assert seeds.seeds_failed(NAMES[:1], 2, seed=2) == 0
    others = {(NAMES[0], 10**6 + n, True) for n in (1, 2)}  # in any order: two run at once
    assert set(calls) == others and not seeds.entries()


def test_the_command_takes_names_and_refuses_those_of_no_seeded_figure(calls, capsys):
    assert seeds.main(["-j", "1", NAMES[0]]) == 0
    assert len(calls) == 10 and "0 missed" in capsys.readouterr().out
    assert seeds.main([NAMES[1]]) == 1 and "seed 3" in capsys.readouterr().out
    assert seeds.main(["--summary"]) == 0 and "not measured: link_lut" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        seeds.main(["nothing"])
    assert "nothing draws no random numbers" in capsys.readouterr().err


def test_every_seeded_figure_has_ten_parts_of_the_campaign():
    figures, chosen = collected("FIGURES"), seeds.seeded()
    assert all(figures[name].seeded for name in chosen)
    assert {name for name in figures if figures[name].seeded} - {*chosen} == {*seeds.STARTS_WORKERS}
    one = seeds.CAMPAIGNS["seeds"]
    assert one.parts == 10 * len(chosen)


def test_a_figure_that_does_not_end_well_misses_and_its_words_are_kept():
    good, words = seeds.measured("nothing", 3, True)
    assert not good and "there is no figure nothing" in words and words.endswith(", seed 3")

# SPDX-License-Identifier: Apache-2.0
"""Every figure that draws random numbers is measured with ten seeds, and each that misses its bound
with one of them is counted once.
"""

from figures import seeds
from figures.common import collected

NAMES = ("steady", "unlucky", "broken")


def test_figures_that_miss_their_bound_with_any_seed_are_counted_once(monkeypatch, tmp_path):
    calls = []

    def measured(name, seed, quick):
        calls.append((name, seed, quick))
        if name == "broken":
            raise OSError("no such program")
        return not (name == "unlucky" and seed in (2, 3)), f"{name} 7 nm, seed {seed}"

    monkeypatch.setattr(seeds, "measured", measured)
    monkeypatch.setattr(seeds, "seeded", lambda: NAMES)
    monkeypatch.setattr(seeds, "RESULTS", tmp_path)
    assert seeds.seeds_failed(count=4) == 2
    assert sorted(set(calls)) == sorted((name, n, False) for name in NAMES for n in (1, 2, 3, 4))
    calls.clear()
    assert seeds.seeds_failed(count=4) == 2
    assert {name for name, *_ in calls} == {"broken"}, "what is measured is not measured again"
    calls.clear()
    assert seeds.seeds_failed(("steady",), 2, seed=2) == 0
    others = {("steady", 10**6 + n, True) for n in (1, 2)}  # in any order: there are two workers
    assert set(calls) == others, "another seed, and short forms"


def test_every_seeded_figure_has_ten_parts_of_the_campaign():
    figures, chosen = collected("FIGURES"), seeds.seeded()
    assert all(figures[name].seeded for name in chosen)
    assert {name for name in figures if figures[name].seeded} - {*chosen} == {*seeds.STARTS_WORKERS}
    one = seeds.CAMPAIGNS["seeds"]
    assert one.parts == 10 * len(chosen)


def test_a_figure_that_does_not_end_well_misses_and_its_words_are_kept():
    good, words = seeds.measured("nothing", 3, True)
    assert not good and "there is no figure nothing" in words and words.endswith(", seed 3")

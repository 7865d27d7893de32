# SPDX-License-Identifier: Apache-2.0
"""The page of the figures: bars are as long as they should be, the best first, and every peer has a
figure beside it.
"""

import re
from xml.etree import ElementTree

import pytest

from figures.common import Figure, Quick, collected
from figures.comparison import BAR, OURS, Comparison, Peer, bars, comparisons, page, scale

SMALL = Figure(lambda: 2.0, "nm", "an <error>", "< 3", Quick(), 1)


def lengths(svg):
    return [float(width) for width in re.findall(r'<rect [^>]* width="([\d.]+)"', svg)]


def labels(svg):
    return re.findall(r'text-anchor="end"[^>]*>([^<]*)<', svg)


def test_bars_are_in_proportion_and_the_best_is_first():
    peers = [Peer("worse", 4.0, "paper"), Peer("better", 1.0, "maker")]
    svg, note = bars(SMALL, 2.0, Comparison("less", peers))
    ElementTree.fromstring(svg)
    assert labels(svg) == ["better", OURS, "worse"]
    assert lengths(svg) == pytest.approx([BAR / 4, BAR / 2, BAR], abs=0.1)
    assert labels(bars(SMALL, 2.0, Comparison("more", peers))[0]) == ["worse", OURS, "better"]
    assert note == "an <error>; less is better"


def test_our_bar_is_green_only_if_the_figure_is_within_its_bound():
    for value, colour in ((2.9, "#1d6b3a"), (3.0, "#a3161f")):
        svg, _ = bars(SMALL, value, Comparison("less", [Peer("other", 5.0, "")]))
        assert re.findall('fill="(#[0-9a-f]+)"', svg) == [colour, "#b6c2cf"]


def test_values_decades_apart_are_drawn_logarithmic_and_the_note_says_so():
    part, logarithmic = scale([1, 1000])
    assert logarithmic and part(1000) == 1 and 0 < part(1) < part(10) < part(100) < 1
    assert part(100) - part(10) == pytest.approx(part(1000) - part(100))
    assert bars(SMALL, 1.0, Comparison("less", [Peer("far", 1000.0, "")]))[1].endswith(
        "logarithmic"
    )


def test_nothing_is_drawn_of_nothing():
    for values in ([0], [0, 0], [0, 5], [0, 1, 1000]):
        part, _ = scale(values)
        assert part(0) == 0 and 0 <= part(max(values)) <= 1
    assert lengths(bars(SMALL, 0.0, Comparison("less", [Peer("other", 0.0, "")]))[0]) == [1, 1]


def test_the_page_has_every_figure_and_pictures_where_there_are_peers():
    other, failed = (Figure(lambda: 0, "", what, "0", Quick(), 0) for what in ("lonely", "broken"))
    text = page(
        [
            ("small", SMALL, 2.0, 1.0),
            ("other", other, 1.0, 2.0),
            ("failed", failed, None, "no <tool>"),
        ],
        {
            "small": Comparison("less", [Peer("<b>", 2.5, "s")], (1.0, "physics")),
            "failed": Comparison("less", [Peer("x", 1, "")]),
        },
    )
    assert "1 of 3 are" in text and text.count("<svg") == 1 and text.count("<tr>") == 4
    assert (
        '<td class="good">2.0 nm</td>' in text
        and '<td class="bad">1 </td>' in text
        and "failed: no &lt;tool&gt;" in text
    )
    assert "&lt;b&gt;" in text and "an &lt;error&gt;" in text and "limit: 1 nm, physics" in text
    assert not re.search(r"<b>|<error>|<tool>", text)


def test_every_comparison_belongs_to_a_figure():
    known, figures = comparisons(), collected("FIGURES")
    assert set(known) <= set(figures)
    for name, comparison in known.items():
        assert all(
            0 < len(peer.source) <= 60 and len(peer.name) <= 36 for peer in comparison.peers
        ), f"{name}: too long for a bar"

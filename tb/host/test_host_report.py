# SPDX-License-Identifier: Apache-2.0
"""moire.analysis.report: the page contains every move, every picture is a PNG inside it, texts are
escaped, and what cannot be done is reported.
"""

import base64
import html.parser
import io
import math
import re

import numpy
import pytest
from PIL import Image

from moire.analysis import report
from moire.errors import BadFile, MoireError

MOVES = [
    report.Move("X", 1e6, 1e6 + 3, 1e6 + 12, -12.0, 0.5),
    report.Move("Y", 2e6, 2e6, 2e6 - 16, 16.0, 0.75),
    report.Move("X", 0, 0, 0, 0.0, 0.25),
]


def full_result():
    time_s = numpy.linspace(0, 1, 500)
    target = 1e6 * (1 - numpy.cos(math.pi * time_s))
    traces = [
        report.Trace(
            name,
            time_s,
            target * scale,
            target * scale + 40 * numpy.sin(50 * time_s),
            target * scale + 45 * numpy.sin(50 * time_s),
        )
        for name, scale in (("X", 1), ("Y", -0.5))
    ]
    angle = numpy.linspace(0, 40, 400)
    circle = report.Lissajous(
        "X", numpy.round(100 * numpy.sin(angle)), numpy.round(100 * numpy.cos(angle))
    )
    compared = [
        report.Compared("coarse error", "0.8 \N{MICRO SIGN}m", "16 nm", True),
        report.Compared("<speed>", "5 mm/s", "4 mm/s", False),
        report.Compared("axes", "2", "2"),
    ]
    return report.Result(
        "S0 <stage> & co",
        MOVES,
        traces,
        [circle],
        compared,
        seed=42,
        facts={"clock": "4 MHz"},
        summary="What was done.",
        claim="16 nm",
        left_out="<heat> & noise",
    )


class Page(html.parser.HTMLParser):
    """Checks that tags close in order, and stores the texts."""

    def __init__(self, text):
        super().__init__()
        self.open, self.texts, self.images = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag == "img":
            self.images.append(dict(attributes)["src"])
        if tag not in ("img", "meta"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data.strip())


def test_the_page_contains_everything_and_needs_no_other_file(tmp_path):
    path = report.write(full_result(), tmp_path / "report" / "s0.html")
    assert path == tmp_path / "report" / "s0.html" and [path] == list(path.parent.iterdir())
    page = Page(path.read_text(encoding="utf-8"))
    for text in (
        "S0 <stage> & co",
        "<speed>",
        "1.000000",
        "1.000012",
        "-12.0",
        "+16.0",
        "not compared",
        "The model leaves out: <heat> & noise.",
        "0.750",
        "reached",
        "not reached",
        "42",
        "4 MHz",
        "What was done.",
        "16.0 nm",
    ):
        assert text in page.texts, text
    assert not re.search(r'(src|href)="(?!data:)', path.read_text(encoding="utf-8"))
    assert len(page.images) == 4
    for source in page.images:
        image = Image.open(
            io.BytesIO(base64.b64decode(source.removeprefix("data:image/png;base64,")))
        )
        assert (
            image.format == "PNG"
            and image.width > 400
            and len(set(image.convert("RGB").resize((60, 60)).get_flattened_data())) > 3
        )


def test_what_the_model_leaves_out_stands_beside_the_claims_and_is_in_the_head():
    text = report.page(full_result())
    table, note = text.index("Against the paper"), text.index('<p class="left-out">')
    assert table < note < text.index("<h2>Pictures")
    assert '<meta name="description" content="16 nm">' in text
    assert '<meta name="left-out" content="&lt;heat&gt; &amp; noise">' in text


def test_a_result_of_moves_alone_has_the_histogram_alone(tmp_path):
    page = Page(
        report.write(report.Result("moves", MOVES[:1]), tmp_path / "moves.html").read_text(
            encoding="utf-8"
        )
    )
    assert len(page.images) == 1 and "How it was measured" not in page.texts


def test_the_summary_of_errors_matches_a_calculation_by_hand():
    errors = report.Errors.of(MOVES)
    assert (errors.count, errors.largest, errors.mean) == (
        3,
        16.0,
        pytest.approx(4 / 3),
    ) and errors.rms == pytest.approx(math.sqrt(400 / 3))


def test_an_error_beyond_the_paper_is_marked():
    bad = report.Move("X", 0, 0, 900, -900.0, 1.0)
    assert 'class="bad">-900.0<' in report.page(
        report.Result("bad", [bad])
    ) and 'class="bad"' not in report.page(report.Result("good", MOVES))


@pytest.mark.parametrize("error", [0.0, 0.01, 799.0, 5e6])
def test_any_size_of_error_is_drawn(error):
    assert report.histogram([report.Move("X", 0, 0, -error, error, 1.0)], 800.0).startswith(
        b"\x89PNG"
    )


def test_what_cannot_be_done_is_reported(tmp_path):
    with pytest.raises(MoireError, match="at least one move"):
        report.write(report.Result("nothing", []), tmp_path / "nothing.html")
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="cannot be written"):
        report.write(report.Result("moves", MOVES), tmp_path / "file" / "moves.html")


def test_a_scale_is_labelled_in_the_unit_that_suits_it():
    assert (
        report.length_unit(5e6) == (1e6, "mm")
        and report.length_unit(5e3)[1] == "\N{MICRO SIGN}m"
        and report.length_unit(800) == (1.0, "nm")
    )

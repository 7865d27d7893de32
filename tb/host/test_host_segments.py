# SPDX-License-Identifier: Apache-2.0
"""moire.client.segments: tables in files, errors reported with their lines, tables written and read
back, and the commands.
"""

import json
from dataclasses import replace
from fractions import Fraction

import pytest

from moire.client.bus import Bus
from moire.client.segments import (
    PATIENCE_S,
    NotInForce,
    Segments,
    SegmentTable,
    read_table,
    text_of,
)
from moire.errors import BadFile, OutOfRange
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.call import Call, sentence
from twin.compiled.tables import PERIOD

GOOD = ["0, 0", "1, 100", "2, -50", "3, 20"]


def node_with_table():
    """A homed node; all of these have a segment table."""
    node = BusNode()
    node.home()
    node.set_feedback(SEGMENT_ERROR=-8192 & 0xFFFFFFFF)
    return node


def points(node):
    """The points in the hardware, 2^-16 period."""
    table = node.feedback_channels[0].segments
    return [table[border] for border in range(len(table))]


def axis_of(node):
    return Bus(Rs485Bus(node)).axis()


@pytest.fixture
def file(tmp_path):
    def write(*lines):
        (tmp_path / "scale.csv").write_text("\n".join(lines))
        return tmp_path / "scale.csv"

    return write


@pytest.mark.parametrize(
    "lines",
    [
        GOOD,
        ["position, error", "# measured at 20 degrees", *GOOD],
        ["position / mm, error / nm", *GOOD],
        ["x (um), deviation [um]", "0,0", "1000,0.1", "2000,-0.05", "3000,0.02"],
        ["0, 0", "1mm, 0.1um", "2000um, -50nm", "3 mm, 20 nm"],
        ["position (of 100 um each) / mm, error of um / nm", *GOOD],
        ["position / um, error / pm", "0mm, 0", "1mm, 100000", "2mm, -50000", "3000, 20nm"],
    ],
)
def test_a_table_is_read_with_its_units(file, lines):
    assert read_table(file(*lines)) == SegmentTable(Fraction(0), Fraction(10**6), (0, 100, -50, 20))


@pytest.mark.parametrize(
    "lines, message",
    [
        (["0, 0", "1, 100", "3, 20", "4, 30"], "line 3: from 1mm to 3mm a border is missing"),
        (["0, 0", "1, 100", "3, 20"], "line 3: from 1mm to 3mm a border is missing"),
        (
            ["0, 0", "1, 100", "1, 100", "2, 3"],
            "line 3: the position 1mm is there twice, also in line 2",
        ),
        (
            ["0, 0", "2, 100", "1, 100", "3, 3"],
            "line 3: the position 1mm comes after 2mm in line 2",
        ),
        (
            ["0, 0", "1, 0", "2, 0", "3, 0", "2.5, 0"],
            "line 5: the position 2.5mm comes after 3mm in line 4",
        ),
        (["0, 0", "1, 0", "2.0021, 0", "3, 0"], "line 3: 2.0021mm is no border of equal segments"),
        (["0, 0", "1, 9um", "2, 19.001um"], "line 3: an error of 19.001um after 9um is absurd"),
        (
            ["0, 0", "1, 100", "2.2, 100", "3.2, 3"],
            "line 3: 2.2mm is no border of equal segments of 1mm",
        ),
        (["0, 0", "1, 100", "2, 20um", "3, 3"], "line 3: an error of 20um after 100nm is absurd"),
        (["0, 0", "1, nan", "2, 2"], "line 2: the error is nan"),
        (["0, 0", "1, about 5", "2, 2"], "line 2: the error is no length: 'about 5'"),
        (["0, 0", "1, 5 kg"], "line 2: the error is no length: '5 kg'"),
        (["0, 0", "1, 2, 3"], "line 2: it needs two columns"),
        (["# nothing", "0, 0"], "1 borders are too few"),
        (["0, 0", "1,"], "line 2: the error is no number"),
    ],
)
def test_an_error_in_the_file_is_reported_with_its_line(file, lines, message):
    with pytest.raises(BadFile) as reported:
        read_table(file(*lines))
    assert message in str(reported.value)


def test_borders_and_errors_may_be_off_to_their_limits(file):
    read = read_table(file("0, 0", "1, 10um", "2.002, 20um", "3, 30um"))
    assert read.errors == (0, 10_000, 20_000, 30_000) and read.length == 10**6


def test_a_file_that_is_not_there_is_one_sentence(tmp_path):
    with pytest.raises(BadFile, match="cannot be read: No such file"):
        read_table(tmp_path / "none.csv")


def test_the_rectangle_has_the_mean_of_its_borders_and_the_line_goes_through_them():
    table = SegmentTable(Fraction(100), Fraction(10), (0, 4, -6))
    assert [table.at(position) for position in (99, 100, 105, 110, 115, 120, 121)] == [
        0,
        0,
        2,
        4,
        -1,
        -6,
        -6,
    ]
    assert [table.at(position, "rectangle") for position in (99, 100, 109, 110, 119, 120)] == [
        0,
        2,
        2,
        -1,
        -1,
        -6,
    ]


def test_a_table_is_written_completely_and_comes_into_force():
    node = node_with_table()
    table = SegmentTable(
        Fraction(-(10**6)), Fraction(10**6), tuple(Fraction(n * 50) for n in range(-15, 16))
    )
    reported = Segments(axis_of(node)).load(table, "rectangle")
    assert points(node) == [n * 50 * 65536 // 800 for n in range(-15, 16)]
    names = ("segment_count", "segment_length", "segment_first", "segments")
    assert list(map(node.parameter, names)) == [30, 1250 * PERIOD, -1250 * PERIOD, 1]
    assert node.feedback_channels[0].use == dict(
        linear=False, segments=30, length=1250 * PERIOD, origin=-1250 * PERIOD
    )
    assert (reported.in_force, reported.reason, reported.loaded, reported.error_nm) == (
        "rectangle",
        "ok",
        31,
        -100,
    )
    assert Segments(axis_of(node)).read() == table


def test_the_largest_table_and_the_largest_points_are_written():
    node = node_with_table()
    segments = Segments(axis_of(node))
    errors = tuple(Fraction(n % 7) for n in range(256))
    assert segments.load(SegmentTable(Fraction(0), Fraction(10**6), errors)).loaded == 256
    segments.check_points([0, (1 << 23) - 1, 1 - (1 << 23)])
    for point in (1 << 23, -(1 << 23)):
        with pytest.raises(OutOfRange, match="table is above 102.4um: 128 periods are the most"):
            segments.check_points([0, point])
    segments.use("off")
    segments.axis.set_parameter("period", "512.34nm")
    with pytest.raises(OutOfRange, match="table is above 65.58um: 128 periods"):
        segments.check_points([0, 1 << 23])


def test_of_more_points_than_there_are_segments_the_first_ones_are_read():
    segments = Segments(axis_of(node_with_table()))
    segments.load(SegmentTable(Fraction(0), Fraction(10**6), (0, 100, 200, 300)), "off")
    segments.axis.set_parameter("segment_count", 2)
    assert segments.read().errors == (0, 100, 200)


def test_a_use_is_waited_for_while_the_axis_is_busy_but_not_for_ever():
    segments = Segments(axis_of(node_with_table()))
    segments.load(SegmentTable(Fraction(0), Fraction(10**6), (0, 100)), "off")
    usual, clock = segments.status, segments.axis.transport.now
    for busy, least_s, most_s in ((0, 0, 0.05), (3, 0, 0.45), (10**6, PATIENCE_S, 0.6)):
        asked = []

        def status(busy=busy, asked=asked):
            asked.append(clock())
            return replace(usual(), reason="busy") if len(asked) <= busy else usual()

        segments.status, begun = status, clock()
        assert segments.use("linear").reason == ("busy" if busy > 3 else "ok")
        assert least_s <= clock() - begun <= most_s and len(asked) >= min(busy, 3) + 1


def test_positions_count_from_the_zero_whatever_the_home_offset():
    node = node_with_table()
    node.set(home_offset=250)  # 200 um
    node.home()
    table = SegmentTable(Fraction(10**6), Fraction(10**6), (Fraction(0), Fraction(100)))
    segments = Segments(axis_of(node))
    segments.load(table)
    assert node.parameter("segment_first") == 1000 * PERIOD and segments.read() == table
    assert node.feedback_channels[0].use["origin"] == 1250 * PERIOD


def test_without_a_zero_the_table_waits_and_reports_why():
    node = BusNode()
    reported = Segments(axis_of(node)).load(SegmentTable(Fraction(0), Fraction(10**6), (0, 1)))
    assert (reported.in_force, reported.reason) == (
        "off",
        "not_homed",
    ) and "off: the axis has no zero yet: home it first" in reported.words()


@pytest.mark.parametrize(
    "errors, message",
    [
        (
            (0,) * 257,
            "257 points are too few or too many: this node's segment table takes 2 to 256",
        ),
        ((0, 200_000), "128 periods are the most"),
    ],
)
def test_a_table_that_does_not_fit_leaves_the_old_one_in_force(errors, message):
    node = node_with_table()
    segments = Segments(axis_of(node))
    segments.load(SegmentTable(Fraction(0), Fraction(10**8), (0, 800)))
    with pytest.raises(OutOfRange, match=message):
        segments.load(SegmentTable(Fraction(0), Fraction(10**8), errors))
    assert points(node) == [0, 65536] and node.parameter("segments") == 2
    assert node.feedback_channels[0].use is not None


def test_a_table_that_does_not_read_back_is_not_put_in_force():
    class Damaging(dict):
        def __setitem__(self, border, point):
            super().__setitem__(border, point + 1)

    node = node_with_table()
    node.feedback_channels[0].segments = Damaging()
    with pytest.raises(NotInForce, match="does not hold"):
        Segments(axis_of(node)).load(SegmentTable(Fraction(0), Fraction(10**6), (0, 100)))
    assert node.parameter("segments") == 0 and node.feedback_channels[0].use is None


def test_the_file_of_a_table_reads_back_digit_by_digit(tmp_path):
    table = SegmentTable(
        Fraction(-(10**6)), Fraction(10**6), (Fraction(0), Fraction(125, 1024), Fraction(-3))
    )
    (tmp_path / "again.csv").write_text(text_of(table))
    assert read_table(tmp_path / "again.csv") == table


def test_the_commands_load_report_use_and_save(file, tmp_path):
    node, saved, png = node_with_table(), str(tmp_path / "saved.csv"), tmp_path / "scale.png"
    call = Call(
        [
            "segments",
            "load",
            str(file(*GOOD)),
            "--rectangle",
            "--picture",
            str(png),
            "--",
            "segments",
            "status",
        ],
        node,
    )
    assert call.code == 0 and call.err == "" and png.read_bytes().startswith(b"\x89PNG")
    assert (
        "3 segments of 1mm from 0nm on; rectangle; -100nm taken off the position; 4 points loaded"
        in call.out
    )
    assert (
        Call("segments use linear -- segments status --json", node).results[-1]["in_force"]
        == "linear"
    )
    assert Call(["segments", "save", saved], node).out == f"3 segments saved in {saved}\n"
    assert read_table(saved).segments == 3
    assert "off; 4 points loaded, at most 256" in Call("segments use off", node).out
    assert "reads" not in Call(["segments", "load", str(file(*GOOD)), "--dry"], BusNode()).err


def test_a_wrong_file_is_one_sentence_and_nothing_is_written(file):
    node = node_with_table()
    assert "line 2: the position 0nm is there twice" in sentence(
        Call(["segments", "load", str(file("0, 0", "0, 1", "1, 1"))], node), 2
    )
    assert not node.written("set_segments") and not node.written("set_parameter")


def test_a_node_without_a_table_reports_it_in_one_sentence(file):
    node = BusNode(absent=("segments",))
    assert "was built without this function" in sentence(Call("segments use linear", node), 1)
    assert "without a segment table" in sentence(
        Call(["segments", "load", str(file(*GOOD))], node), 2
    )


def test_parameters_are_saved_and_loaded_with_the_table(tmp_path):
    node, other, saved = node_with_table(), node_with_table(), str(tmp_path / "stage.json")
    Segments(axis_of(node)).load(SegmentTable(Fraction(0), Fraction(10**6), (0, 100, 30)))
    assert "parameters and a segment table saved" in Call(["params", "save", saved], node).out
    call = Call(["params", "load", saved], other)
    assert call.code == 0 and "and a segment table loaded" in call.out
    assert points(other) == points(node) and other.parameters() == node.parameters()
    reported = json.loads((tmp_path / "stage.json").read_text())
    (tmp_path / "stage.json").write_text(json.dumps({**reported, "segment_points": ["1"]}))
    assert "no list of whole numbers" in sentence(Call(["params", "load", saved], other), 2)

# SPDX-License-Identifier: Apache-2.0
"""S2 as shipped: three stepper axes with scales in one node; and its counters, driven by pulses
from C++.
"""

import pytest

from experiments.s2_stage import SCALES, WORD, Stage
from figures import s2s3 as figures_s2s3
from tb.bench import seed

SEED = seed()
NEAR = 4  # counts within which a move settles


@pytest.fixture(scope="module")
def stage():
    print(f"SEED={SEED}")
    made = Stage.power_up(SEED)
    made.home()
    return made


def middle_counts(scale):
    return 4 * scale.middle


def test_homing_takes_the_index_and_the_origin_lies_in_the_middle(stage):
    for name, scale in SCALES.items():
        of_scale, of_node, _ = stage.both(name)
        assert of_scale - of_node == middle_counts(
            scale
        )  # the index lies in count 0 of the machine
        assert stage.axes[name].status().homed


def test_as_many_counts_as_pulses_on_both_sides_of_the_origin(stage):
    made = [
        *stage.move("up", {name: 5.0 for name in SCALES}),
        *stage.move("down", {name: -2000.0 for name in SCALES}),
        *stage.move("slow", {name: -1950.0 for name in SCALES}, 0.5),
    ]
    assert [move.wrong for move in made] == [0] * 9
    assert [move.counts < 0 for move in made] == [False] * 3 + [True] * 6
    for move in made:
        count_um = float(SCALES[move.axis].count_um)
        assert abs(move.counts * count_um - move.target_um) <= NEAR * count_um
        assert abs(move.apart_um) < 2 * count_um  # the true position of the table
    assert all(
        stage.twin.truth(n).lost_steps == 0 and stage.twin.truth(n).step_timing_errors == 0
        for n in range(3)
    )


def test_two_positions_that_read_the_same_on_16_bits_are_distinguished(stage):
    reach = SCALES["Z"].word_mm * 500  # um: half a 16-bit counter
    below, above = (stage.move("", {"Z": target})[0] for target in (-reach, reach))
    turn = (above.counts - below.counts) - WORD
    assert abs(turn) <= 2 * NEAR and abs(above.counts % WORD - below.counts % WORD) <= 2 * NEAR
    assert below.counts < 0 < above.counts and below.wrong == above.wrong == 0


def test_a_position_beyond_31_bits_is_counted(stage):
    stage.call_here("X", 1 << 29)
    border_um = (1 << 31) * float(SCALES["X"].count_um)
    made = [stage.move("", {"X": border_um + side * 200})[0] for side in (-1, 1, -1)]
    assert [move.wrong for move in made] == [0] * 3
    assert [move.counts >= 1 << 31 for move in made] == [False, True, False]


def test_without_a_scale_its_own_steps_are_the_position(stage):
    axis, number = stage.axes["Y"], stage.number("Y")
    axis.disable()
    for name, value in {
        "position_source": 2,
        "period": "5um",
        "steps_per_period": 4,
        "ki": 0,
        "home_method": 35,
        "home_offset": 0,
        "travel_low": "-10mm",
        "travel_high": "10mm",
        "deglitch": "10us",
    }.items():  # longer than the high time of a step
        axis.set_parameter(name, value)
    axis.enable()
    axis.home()
    for target_mm in (1, -1):
        steps, counts = stage.twin.truth(number).steps, axis.status().counts
        assert axis.move(mm=target_mm).position_nm == pytest.approx(target_mm * 1e6, abs=1250)
        assert axis.status().counts - counts == stage.twin.truth(number).steps - steps != 0


# ------------------------------------------------------------------ pulses from C++


def test_pulses_of_random_distances_and_speeds_are_all_counted_through_every_overflow():
    axes = figures_s2s3.counted(SEED, 200_000)
    assert len(axes) == 3
    for result in axes:
        assert result["pulses"] >= 200_000 and result["wrong"] == 0 and result["reversals"] > 100
        assert result["zero"] and result["word"] and result["long_word"] and result["whole"]


def test_pulses_closer_than_the_edge_filter_passes_are_missed_and_reported():
    bypassed, *filtered = figures_s2s3.counted(SEED, 20_000, "too_fast")
    assert bypassed["wrong"] == 0  # an edge in each cycle is the highest rate
    assert all(result["wrong"] > 100 for result in filtered)

# SPDX-License-Identifier: Apache-2.0
"""moire.client: parameters of an axis in real units, what they refuse, and a tuning."""

import random
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import pytest

from moire.analysis.tune import Tuning
from moire.client.bus import Bus
from moire.client.values import CHOICES
from moire.errors import OutOfRange, Refused, UnitError, UnknownName
from moire.made.bus_tables import PARAMETERS
from tb.bench import seed
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.stage import stage
from twin.compiled.tables import PERIOD

SEED = seed()


def test_parameters_are_in_real_units():
    wire, node, axis = stage()
    velocity = axis.get_parameter("velocity")
    assert (velocity.value, velocity.unit, velocity.counts, velocity.range_words) == (
        Fraction(24, 5),
        "mm/s",
        6000,
        "800nm/s to 800mm/s",
    )
    assert (
        axis.get_parameter("acceleration").written() == "100mm/s2"
        and axis.get_parameter("jerk").written() == "10000mm/s3"
    )
    assert (
        axis.get_parameter("period").written() == "800nm"
        and axis.get_parameter("home_distance").written() == "1mm"
    )
    assert (
        axis.get_parameter("settle_time").written() == "20ms"
        and axis.get_parameter("deglitch").written() == "10us"
    )
    assert (
        axis.get_parameter("pwm_frequency").written() == "20kHz"
        and axis.get_parameter("counts_per_period").written() == "160"
    )
    assert axis.get_parameter("settle_window").written(4) == "20nm"
    assert axis.set_parameter("velocity", "5mm/s").value == 5 and node.parameter("velocity") == 6250
    assert axis.set_parameter("velocity", 4).counts == 5000
    assert axis.set_parameter("kp", 0.25).counts == 16384


@pytest.mark.parametrize("name", list(PARAMETERS))
def test_both_ends_of_each_range_are_accepted_and_values_beyond_are_not_sent(name):
    wire, node, axis = stage()
    known = PARAMETERS[name]
    value = axis.get_parameter(name)
    one = (value.maximum - value.minimum) / (known.max - known.min)
    for end, beyond, counts in ((value.minimum, -one, known.min), (value.maximum, one, known.max)):
        if name == "period":
            wire, node, axis = stage()
        if name == "travel_low":
            axis.set_parameter("travel_high", value.maximum)
        if name == "travel_high":
            axis.set_parameter("travel_low", value.minimum)
        assert axis.set_parameter(name, end).counts == counts == node.parameter(name)
        written = len(node.written("set_parameter"))
        if name != "period":
            with pytest.raises(OutOfRange, match=f"{name} allows .*(, | to ).*, not "):
                axis.set_parameter(name, end + beyond)
        assert len(node.written("set_parameter")) == written


def test_wrong_values_are_refused_with_what_is_allowed():
    wire, node, axis = stage()
    with pytest.raises(OutOfRange, match="velocity allows 800nm/s to 800mm/s, not 900mm/s"):
        axis.set_parameter("velocity", "900mm/s")
    with pytest.raises(OutOfRange, match="period allows 1pm to 4mm, not 5mm"):
        axis.set_parameter("period", "5mm")
    with pytest.raises(OutOfRange, match="counts_per_period takes whole numbers, not 160.5"):
        axis.set_parameter("counts_per_period", "160.5")
    with pytest.raises(UnitError, match="'5mm' is no speed"):
        axis.set_parameter("velocity", "5mm")
    with pytest.raises(
        UnknownName, match="there is no parameter 'speed': Axis.parameters\\(\\) lists all"
    ):
        axis.get_parameter("speed")
    assert "set_parameter" not in node.executed
    # inside the range, but CiA 402 has no such method
    with pytest.raises(Refused, match=r"outside the range of this parameter \(home_method 5\)"):
        axis.set_parameter("home_method", "5")
    assert node.parameter("home_method") == -1


def test_saved_parameters_are_restored_to_the_last_bit():
    print("SEED", SEED)
    source = random.Random(SEED)
    for _ in range(10):
        wire, node, axis = stage()
        counts = {
            name: source.choice([known.min, known.max, source.randint(known.min, known.max)])
            for name, known in PARAMETERS.items()
        }
        low, high = "travel_low", "travel_high"
        counts[low], counts[high] = sorted((counts[low], counts[high]))
        # what the firmware refuses together
        counts["home_method"] = source.choice([-2, -1, 1, 2, 17, 18, 33, 34, 35, 37])
        counts["fine_reach"] *= counts["drive"] < 2
        for name, value in counts.items():
            node.force(name, value)
        axis.period_nm = axis.read_period()
        saved = axis.save_parameters()
        _, other, fresh = stage()
        assert len(fresh.load_parameters(saved)) == len(PARAMETERS)
        assert other.parameters() == counts
        assert other.written("set_parameter")[0]["parameter"] == PARAMETERS["period"].id
        assert fresh.period_nm == Fraction(counts["period"], 1000)


@pytest.mark.parametrize(
    "before, loaded",
    [
        ({"fine_reach": 5}, {"drive": "dac", "fine_reach": "0nm"}),
        ({"drive": 2}, {"fine_reach": "100nm", "drive": "bridge"}),
        ({"segments": 2}, {"segment_count": "7", "segments": "off"}),
    ],
)
def test_parameters_that_exclude_each_other_are_loaded_in_any_order(before, loaded):
    for texts in (loaded, dict(reversed(loaded.items()))):
        wire, node, axis = stage()
        for name, value in before.items():
            node.force(name, value)
        axis.load_parameters({"kp": "0.5", **texts})
        assert {name: axis.get_parameter(name).written() for name in loaded} == loaded


@pytest.mark.parametrize(
    "before, name, value, words",
    [
        ({"drive": 2}, "fine_reach", "100nm", "drive dac and fine_reach 100nm"),
        ({"fine_reach": 65536}, "drive", "dac", "drive dac and fine_reach 800nm"),
    ],
)
def test_parameters_that_exclude_each_other_are_refused_before_any_is_written(
    before, name, value, words
):
    wire, node, axis = stage()
    for partner, count in before.items():
        node.force(partner, count)
    for change in (axis.set_parameter, lambda *one: axis.load_parameters(dict([("kp", 1), one]))):
        with pytest.raises(OutOfRange, match=f"{words} do not go together"):
            change(name, value)
    assert "set_parameter" not in node.executed


def test_a_file_with_one_wrong_value_writes_nothing():
    wire, node, axis = stage()
    for wrong in (
        {"kp": "0.5", "velocity": "900mm/s"},
        {"kp": "0.5", "speed": "1mm/s"},
        {"kp": "0.5", "jerk": "x"},
    ):
        with pytest.raises((OutOfRange, UnknownName, UnitError)):
            axis.load_parameters(wrong)
    assert "set_parameter" not in node.executed


def test_a_parameter_that_is_a_choice_is_written_and_read_by_name():
    for name in set(PARAMETERS) & set(CHOICES):
        _, node, axis = stage()
        known, words = PARAMETERS[name], CHOICES[name]
        assert len(words) == known.max - known.min + 1 and known.min == 0
        for counts, word in enumerate(words):
            assert (
                axis.set_parameter(name, word).counts
                == counts
                == axis.set_parameter(name, str(counts)).counts
                == node.parameter(name)
            )
            assert axis.get_parameter(name).written() == word
        with pytest.raises(OutOfRange, match=f"{name} is no 'sideways': allowed are {words[0]}, "):
            axis.set_parameter(name, "sideways")
    assert axis.set_parameter("feed_override", "25%").value == Fraction(1, 4)


def test_a_tuning_is_written_gain_by_gain_and_filter_by_filter():
    _, node, axis = stage()
    tuning = Tuning(
        kp=100,
        ki=200,
        kd=300,
        kv=400,
        ka=500,
        filters=((1, 2, 3, 4, 5),),
        bandwidth_hz=40,
        phase_margin_degree=50,
        gain_margin=3,
    )
    axis.set_tuning(tuning)
    written = node.parameters()
    assert [written[name] for name in ("kp", "ki", "kd", "kv", "ka", "filters")] == [
        100,
        200,
        300,
        400,
        500,
        1,
    ]
    assert [written[f"filter_1_{name}"] for name in ("b0", "b1", "b2", "a1", "a2")] == [
        1,
        2,
        3,
        4,
        5,
    ]
    with pytest.raises(OutOfRange, match="the servo has 2 filters, the tuning 3"):
        axis.set_tuning(replace(tuning, filters=tuning.filters * 3))


OLD = dict(kp=2000, ki=50, kd=900, kv=1, ka=2)
NEW = dict(kp=9000, ki=20, kd=4000, kv=3, ka=4)
NOTCH, OTHER_NOTCH = (1, 2, 3, 4, 5), (6, 7, 8, 9, 10)


@pytest.mark.parametrize(
    "old, new",
    [
        ((), (NOTCH,)),
        ((NOTCH,), ()),
        ((NOTCH,), (OTHER_NOTCH,)),
        ((NOTCH, OTHER_NOTCH), (OTHER_NOTCH, NOTCH)),
    ],
)
@pytest.mark.parametrize("gains", [(OLD, NEW), (NEW, OLD)])
def test_the_filters_of_a_tuning_change_while_the_gains_are_small(old, new, gains):
    _, node, axis = stage()
    before, after = gains
    axis.set_tuning(SimpleNamespace(**before, filters=old))
    seen = []
    node.port.on_request = lambda *request: seen.append(axis_tuning(node))
    axis.set_tuning(SimpleNamespace(**after, filters=new))
    seen.append(axis_tuning(node))
    assert seen[0] == (before, old) and seen[-1] == (after, new)
    smaller = {name: min(before[name], after[name]) for name in before}
    for found, filters in seen:
        assert filters in (old, new) or len(old) == 2 and filters == ()  # there is no room
        largest = before if filters == old else after if filters == new else smaller
        assert all(found[name] <= largest[name] for name in ("kp", "ki", "kd"))
    assert axis.tuning() == (after, new)


def axis_tuning(node):
    """Gains and filters as the firmware has them."""
    found = node.parameters()
    filters = tuple(
        tuple(found[f"filter_{number}_{name}"] for name in ("b0", "b1", "b2", "a1", "a2"))
        for number in (1, 2)
        if found["filters"] & number
    )
    return {name: found[name] for name in OLD}, filters


def test_a_travel_whose_ends_are_swapped_is_refused_by_the_host():
    wire, node, axis = stage()
    with pytest.raises(
        OutOfRange, match=r"travel_high \(-1mm\) would lie below travel_low \(-800um\)"
    ):
        axis.set_parameter("travel_high", "-1mm")
    with pytest.raises(OutOfRange, match="would lie below travel_low"):
        axis.set_parameter("travel_low", "120mm")
    with pytest.raises(OutOfRange, match="would lie below travel_low"):
        axis.load_parameters({"kp": "0.5", "travel_low": "2mm", "travel_high": "1mm"})
    assert "set_parameter" not in node.executed
    axis.set_parameter("travel_high", "-800um")
    axis.load_parameters({"travel_low": "-3mm", "travel_high": "-2mm"})
    assert axis.get_parameter("travel_high").value == -2_000_000


def test_a_travel_that_excludes_a_homed_axis_is_refused_by_the_host():
    node = BusNode()
    axis = Bus(Rs485Bus(node)).axis()
    axis.set_parameter("travel_low", "1mm")  # without a zero positions mean nothing
    axis.set_parameter("travel_low", "-1mm")
    node.home()
    with pytest.raises(OutOfRange, match="outside a travel of 1mm to .*: move it inside first"):
        axis.set_parameter("travel_low", "1mm")
    with pytest.raises(OutOfRange, match="outside a travel of"):
        axis.load_parameters({"travel_low": "-1mm", "travel_high": "-0.5mm", "kp": 3})
    assert node.parameter("travel_low") == -1250 * PERIOD and node.parameter("kp") != 3 << 16
    axis.set_parameter("travel_low", "0mm")  # within a period of where it is

# SPDX-License-Identifier: Apache-2.0
"""The settings and the images: what a node of each image answers, and what it refuses because its
image does not have it.
"""

import pytest

from twin.compiled.node import CompiledNode
from twin.compiled.tables import TABLE

SETTING = TABLE["setting"]


@pytest.fixture
def station():
    return CompiledNode(image="station")


def test_each_setting_begins_at_its_default_and_takes_both_ends_of_its_range(station):
    for setting in SETTING.values():
        assert station.ask("get_setting", setting=setting["id"])["value"] == setting["default"]
        for value in (setting["min"], setting["max"]):
            station.ask("set_setting", setting=setting["id"], value=value)
            assert station.ask("get_setting", setting=setting["id"])["value"] == value


def test_a_value_beyond_either_end_is_refused_and_changes_nothing(station):
    for setting in SETTING.values():
        for value in (setting["min"] - 1, setting["max"] + 1):
            assert (
                station.request("set_setting", setting=setting["id"], value=value)[0]
                == "out_of_range"
            )
        assert station.ask("get_setting", setting=setting["id"])["value"] == setting["default"]


@pytest.mark.parametrize("number", [0, max(setting["id"] for setting in SETTING.values()) + 1, 255])
def test_a_setting_that_does_not_exist_is_refused(station, number):
    assert station.request("get_setting", setting=number)[0] == "unknown_parameter"
    assert station.request("set_setting", setting=number, value=1)[0] == "unknown_parameter"


def test_an_operation_that_an_image_lacks_is_not_built(station):
    assert station.request("calibration", axis=0, action=0)[0] == "not_built"
    assert station.request("get_correction", axis=0)[0] == "not_built"
    assert CompiledNode().request("get_setting", setting=1)[0] == "not_built"
    assert CompiledNode().request("turn_to", angle=0)[0] == "not_built"


def test_both_images_refuse_an_axis_that_does_not_exist(station):
    assert station.request("calibration", axis=1, action=0)[0] == "no_such_axis"
    assert CompiledNode().request("calibration", axis=1, action=0)[0] == "no_such_axis"


def test_axes_move_in_a_station_as_elsewhere(station):
    station.ask("enable", axis=0, on=1)
    assert station.request("move", axis=0, target=0)[0] == "not_homed"
    station.set(home_method=35)
    station.ask("home", axis=0)
    assert station.run(2000, until=lambda: station.status()["ended"] == "ok")
    station.ask("move", axis=0, target=65536)
    assert (
        station.run(2000, until=lambda: station.status()["ended"] == "ok")
        and station.status()["target"] == 65536
    )

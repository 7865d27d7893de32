# SPDX-License-Identifier: Apache-2.0
"""The image `steps`: axes with A/B/Z scales home and move; what needs sine and cosine is not
built.
"""

import pytest

from twin.compiled.axis import Axis
from twin.compiled.node import CompiledNode
from twin.compiled.tables import PERIOD

OF_SINE = {
    "calibration": dict(axis=0, action=1),
    "get_correction": dict(axis=0),
    "get_harmonic": dict(axis=0, order=1),
    "set_harmonic": dict(axis=0, order=1, cosine=0, sine=0),
    "set_correction": dict(
        axis=0, apply=1, sin_offset=0, cos_offset=0, gain=65536, quadrature_error=0
    ),
}


@pytest.fixture
def machine():
    return CompiledNode(*[Axis() for _ in range(8)], address=1, image="steps")


@pytest.mark.parametrize("operation", OF_SINE)
def test_what_needs_a_sine_is_not_built(machine, operation):
    assert machine.request(operation, **OF_SINE[operation])[0] == "not_built"


def test_its_eight_axes_are_enabled_and_take_targets(machine):
    for n in range(8):
        assert machine.request("enable", axis=n, on=1)[0] == "ok"
        machine.set(n, home_method=35)
        assert machine.request("home", axis=n)[0] == "ok"
    machine.run(400)
    for n in range(8):
        assert machine.request("move", axis=n, target=(n + 1) * PERIOD)[0] == "ok"
    assert machine.request("enable", axis=8, on=1)[0] == "no_such_axis"


def test_a_record_is_made(machine):
    setting = dict(axis=7, trigger=0, before=0, every=4, level=0, amplitude=0)
    assert machine.request("arm_scope", **setting)[0] == "ok"

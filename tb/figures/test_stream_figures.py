# SPDX-License-Identifier: Apache-2.0
"""figures.stream counts what it promises to count."""

import random

import pytest

from figures.stream import CYCLE_TICKS, ONE, Node, Outcome, disturbed, stream
from tb.bench import seed


@pytest.fixture
def node():
    return Node()


def test_a_disturbed_stream_has_no_jump_and_reports_everything(node):
    outcome = Outcome()
    stream(random.Random(seed()), node, 300, outcome)
    assert (node.jumps, outcome.unreported) == (0, 0)
    assert outcome.replies["ok"] and outcome.ended["set_point_late"] == 1


def test_a_target_that_jumps_is_counted(node):
    node.axes[0].player.target += ONE
    node.millisecond()
    assert node.jumps == 2  # there and no further


def test_a_set_point_that_nobody_counts_is_counted_here(node, monkeypatch):
    request = node.request

    def forgetful(name, **fields):
        cause, reply = request(name, **fields)
        if name == "stream":
            reply["accepted"] -= 1
        return cause, reply

    monkeypatch.setattr(node, "request", forgetful)
    outcome = Outcome()
    stream(random.Random(seed()), node, 100, outcome)
    assert outcome.unreported


def test_the_disturbances_are_those_of_the_figure():
    arrived = [n for _, n in disturbed(random.Random(seed()), 20_000)]
    assert 19_000 < len(set(arrived)) < 19_850
    assert any(a > b for a, b in zip(arrived, arrived[1:]))
    assert len(arrived) - len(set(arrived)) > 100
    lost = sorted(set(range(20_000)) - set(arrived))
    assert any(lost[k + 4] == lost[k] + 4 for k in range(len(lost) - 4)) and CYCLE_TICKS == 16

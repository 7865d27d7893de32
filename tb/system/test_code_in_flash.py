# SPDX-License-Identifier: Apache-2.0
"""S0 with a third of its memory: the soft core executes the parts of its firmware that it needs
seldom from the flash, at the clock of the Tang Nano 20K. It does what a node with the whole
firmware in its memory does; with anything else in the flash it stops, and its drive stays off.
"""

import random

import pytest

from experiments import s0_stage
from firmware.build import CODE_BYTES
from moire.client.bus import Bus
from moire.errors import NoAnswer
from tb.bench import seed
from twin import Twin, TwinTransport, build
from twin.nodes.twin import NODE

CLK_HZ = 27_000_000  # of the board
MEMORY = 32768  # as constraints/machines/s0_flash.toml has it
WHOLE = NODE | {"MEMORY_BYTES": MEMORY, "CODE_BYTES": CODE_BYTES}
MOVE_UM = 30
ERROR_NM = 20  # of a move, without calibration
STARTS_S = 0.07  # until a node answers, with a margin of 30 ms


@pytest.fixture(scope="module")
def words():
    return build.firmware("axis", 1, "flash", memory=MEMORY)


def twin_with(words):
    return Twin(
        nodes=(1,), seed=seed() % 1000, clk_hz=CLK_HZ, node_parameters=WHOLE, firmware=words
    )


def bus_of(twin, **options):
    transport = TwinTransport(twin)
    return Bus(transport, random_source=random.Random(seed()), poll_s=s0_stage.POLL_S, **options)


def test_a_node_homes_and_moves_with_most_of_its_firmware_in_the_flash(words):
    in_flash = len(words) - MEMORY // 4
    assert in_flash > MEMORY // 4, "more than half of the firmware is there"
    with twin_with(words) as twin:
        twin.run_until_ready()
        axis = bus_of(twin).axis(1)
        axis.set_parameter("velocity", "2mm/s")
        axis.enable()
        axis.home(method=35)
        before = twin.true_position_nm()
        axis.move(um=MOVE_UM)
        moved = twin.true_position_nm() - before
        status, truth = axis.status(), twin.truth()
    assert abs(moved - 1000 * MOVE_UM) < ERROR_NM
    assert status.faults == () and status.enabled and status.settled and truth.enabled


def with_a_wrong_bit(words):
    source = random.Random(seed())
    at = source.randrange(MEMORY // 4, len(words))
    return [*words[:at], words[at] ^ 1 << source.randrange(32), *words[at + 1 :]]


def of_another_build(words):
    other = build.firmware("steps", 1, "flash", memory=MEMORY)
    return [*words[: MEMORY // 4], *other[MEMORY // 4 :]]


@pytest.mark.parametrize("wrong", [with_a_wrong_bit, of_another_build])
def test_a_node_stops_with_its_drive_off_if_the_flash_has_something_else(words, wrong):
    with twin_with(wrong(words)) as twin:
        twin.run(STARTS_S)
        with pytest.raises(NoAnswer):
            bus_of(twin, tries=1, answer_s=0.01).axis(1).status()
        assert not twin.truth().enabled

# SPDX-License-Identifier: Apache-2.0
"""The step generator and the counter of a card, at the pins of a stepper axis."""

import pytest

from twin import Machine
from twin.machines.machine import StepCard

CLOCK_HZ, PULSE = 10_000_000, 20  # 2 us
STEP_M = 5e-3 / 2000
STILL = dict(scale_count=1e-6, screw_backlash=0.0, scale_index_scatter=0.0)
STEPS_S = 2**32 / CLOCK_HZ  # unit of the rate for a step in a second


def axis(**values):
    machine = Machine("stepper_stage", clk_hz=CLOCK_HZ, **{**STILL, **values})
    machine.set_position(20e-3)
    return machine, StepCard(high=PULSE, enabled=1)


def at_rate(machine, card, steps_s, seconds, parts=10):
    card.rate = round(steps_s * STEPS_S)
    for _ in range(parts):
        machine.with_card(seconds / parts, card)


@pytest.mark.parametrize("steps_s", [1000, -1000, 7777, 0.3])
def test_the_generator_makes_its_rate_of_steps(steps_s):
    machine, card = axis()
    at_rate(machine, card, steps_s, 0.5)
    whole = round(steps_s * STEPS_S) * 5_000_000 // 2**32
    assert machine.state.steps == card.emitted == whole
    assert card.accumulator == round(steps_s * STEPS_S) * 5_000_000
    assert machine.state.step_timing_errors == 0


def test_a_reversal_right_after_a_step_waits_for_the_driver():
    """One step up, and the next cycle one down: pulse, pause and direction take their time."""
    machine, card = axis()
    cycle_s = 1 / CLOCK_HZ
    card.accumulator, card.rate = 2**32 - 1, 1
    machine.with_card(cycle_s, card)
    assert card.emitted == 0, "the direction comes first"
    machine.with_card(PULSE * cycle_s, card)
    assert card.emitted == machine.state.steps == 1
    card.accumulator, card.rate = 2**32, -1
    machine.with_card((3 * PULSE - 1) * cycle_s, card)
    assert machine.state.steps == 1, "its pause, and the new direction"
    machine.with_card(PULSE * cycle_s, card)
    assert card.emitted == machine.state.steps == 0
    assert machine.state.step_timing_errors == 0


def test_the_counter_counts_as_the_scale_and_keeps_the_time_of_its_last_change():
    machine, card = axis()
    start = machine.state.scale_counts
    at_rate(machine, card, 2000, 0.2)
    assert card.count == machine.state.scale_counts - start > 900
    at_rate(machine, card, 0, 0.2)
    still, at = card.count, card.changed_at
    machine.with_card(0.1, card)
    assert card.count == still and card.changed_at == at < machine.now() - 0.1 * CLOCK_HZ
    at_rate(machine, card, -3000, 0.3)
    assert card.count == machine.state.scale_counts - start < 0 and card.errors == 0


def test_the_index_is_latched_once_while_armed():
    machine, card = axis(scale_index_position=20.0505e-3, scale_index_width=1e-6)
    card.armed = 1
    at_rate(machine, card, 500, 0.2)
    assert not card.armed and card.latched + machine.state.scale_counts - card.count == 20050
    latched = card.latched
    at_rate(machine, card, -500, 0.2)
    assert card.latched == latched, "it is not armed any more"


def test_without_enable_the_driver_takes_no_step():
    machine, card = axis()
    card.enabled = 0
    at_rate(machine, card, 1000, 0.1)
    assert card.emitted == 100 and machine.state.steps == 0

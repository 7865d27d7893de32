# SPDX-License-Identifier: Apache-2.0
"""The PS/2 keyboard and the wire-EDM machine of S4 with its PC: connected to each other, and each
connected to the model that tests the RTL.
"""

import math
import random

import numpy
import pytest

from tb.peripheral.ps2_lines import Host, Keyboard
from tools import sigrok
from twin import Devices, DevicesBench

CLK_HZ = 400_000
START = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]
CUT_S = 0.1


def devices_bench(seed=1, clk_hz=CLK_HZ, **values):
    return DevicesBench(
        Devices(keyboard=True, edm=True, parameters={"edm_cut_time": CUT_S, **values}), seed, clk_hz
    )


def received(bench):
    return [byte for _, byte in bench.take_received()]


def test_what_is_typed_arrives():
    bench = devices_bench()
    keys = [0x1C, 0xF0, 0x1C, 0xE0, 0x75, 0xFF, 0x00]
    bench.type(keys[:3])
    bench.type(keys[3:], after_s=0.05)
    bench.cable(0.04)
    assert received(bench) == keys[:3] and bench.state.keyboard_waiting == 4
    bench.cable(0.04)
    assert (
        received(bench) == keys[3:]
        and bench.state.keyboard_sent == 7
        and bench.state.computer_damaged == 0
    )


def test_the_clock_keeps_the_rule():
    bench = devices_bench(clk_hz=2_000_000, computer_processing=0.0)
    bench.type([0x1C, 0xA5])
    levels = bench.cable(0.01)
    clock, data = levels["edm_clock"].astype(int), levels["edm_data"].astype(int)
    falls, rises = (numpy.flatnonzero(numpy.diff(clock) == step) for step in (-1, 1))
    assert len(falls) == len(rises) == 22
    low, high = (rises - falls) / 2, (falls[1:] - rises[:-1]) / 2  # us
    assert 30 <= low.min() and low.max() <= 50
    within = numpy.arange(21) != 10
    assert 30 <= high[within].min() and high[within].max() <= 50 and high[10] >= 50
    changes = numpy.flatnonzero(numpy.diff(data))
    for change in changes:  # data is still for 5 us before and after each falling edge
        assert abs(falls - change).min() >= 10


def test_commands_are_answered_and_obeyed():
    bench = devices_bench()
    bench.order([0xED, 0x05, 0xEE, 0xF3, 0x20])
    bench.cable(0.06)
    assert bench.take_commands() == bytes([0xED, 0x05, 0xEE, 0xF3, 0x20]) and received(bench) == [
        0xFA,
        0xFA,
        0xEE,
        0xFA,
        0xFA,
    ]
    assert (
        bench.state.keyboard_lights == 5
        and bench.state.computer_waiting == 0
        and bench.state.computer_unanswered == 0
    )
    bench.order([0xF5])
    bench.cable(0.02)
    bench.type([0x1C])
    bench.cable(0.02)
    assert received(bench) == [0xFA]  # it types nothing until it is enabled
    bench.order([0xF4])
    bench.cable(0.02)
    bench.type([0x1C])
    bench.cable(0.02)
    assert received(bench) == [0xFA, 0x1C]
    bench.order([0xFF])
    bench.cable(0.4)
    assert received(bench) == [0xFA]
    bench.cable(0.2)
    assert received(bench) == [0xAA] and bench.state.keyboard_lights == 0


def test_a_keyboard_that_is_not_there_answers_nothing():
    bench = devices_bench()
    with bench.fault("keyboard_dead"):
        bench.order([0xED, 0x01])
        bench.type(START)
        bench.cable(0.5)
        assert (
            received(bench) == []
            and bench.state.computer_unanswered == 2
            and bench.state.computer_waiting == 0
        )
    bench.type(START)
    bench.cable(0.1)
    assert received(bench) == START


def test_nothing_is_lost_when_the_pc_holds_the_keyboard():
    bench = devices_bench(computer_inhibits=200.0)
    keys = [random.randrange(1, 0x84) for _ in range(300)]
    bench.type(keys)
    bench.cable(1.5)
    state = bench.state
    assert (
        received(bench) == keys
        and state.computer_inhibits > 150
        and state.keyboard_aborts > 20
        and state.computer_damaged == 0
    )
    bench.order([0xED, 0x02])
    bench.cable(0.2)
    assert state.computer_unanswered == 0 and bench.state.keyboard_lights == 2


# each with the other side from tb/peripheral


def pulls(bench, party, side):
    """One cycle with the model at one of the ports."""
    bench.pins(**{f"{side}_clock_low": party.clock_low, f"{side}_data_low": party.data_low})
    bench.run_clk(1)
    party.step(int(bench.level(f"{side}_clock")), int(bench.level(f"{side}_data")))


def test_the_keyboard_serves_a_host_that_cuts_and_orders_at_will():
    bench, host = devices_bench(), Host(CLK_HZ, cut=0.02)
    keys = [random.randrange(1, 0x84) for _ in range(60)]
    orders = {30_000: 0xEE, 50_000: 0xED, 70_000: 0x07}  # by cycle
    bench.type(keys)
    for n in range(250 * CLK_HZ // 1000):
        if n in orders:
            host.orders = [orders[n]]
        pulls(bench, host, "keyboard")
    answers = [byte for byte in host.received if byte in (0xEE, 0xFA)]
    assert (
        [byte for byte in host.received if byte not in (0xEE, 0xFA)] == keys
        and host.damaged == 0
        and host.unanswered == 0
    )
    assert (
        answers == [0xEE, 0xFA, 0xFA]
        and bench.state.keyboard_lights == 7
        and bench.state.keyboard_aborts > 5
    )


def test_the_pc_requests_damaged_bytes_again_and_gets_its_answers():
    bench, keyboard = devices_bench(computer_inhibits=50.0), Keyboard(CLK_HZ, damage=0.2)
    keys = [random.randrange(1, 0x84) for _ in range(60)]
    keyboard.outbox = list(keys)
    bench.order([0xED, 0x02, 0xEE])
    for _ in range(600 * CLK_HZ // 1000):
        pulls(bench, keyboard, "edm")
    state = bench.state
    assert [byte for byte in received(bench) if byte not in (0xEE, 0xFA)] == keys
    assert (
        state.computer_damaged > 3
        and state.computer_unanswered == 0
        and state.computer_waiting == 0
    )
    assert list(dict.fromkeys(keyboard.commands)) == [0xED, 0x02, 0xEE]


# the machine


def cut_once(bench, seconds=0.06 + 1.5e-3 * len(START)):
    bench.type(START)
    bench.cable(seconds)


def test_left_control_and_w_make_a_cut():
    bench = devices_bench()
    cut_once(bench)
    assert bench.state.edm_cutting and bench.cuts[0].end_s is None and bench.level("edm_cutting")
    bench.cable(CUT_S)
    (cut,) = bench.cuts
    assert (
        cut.complete
        and cut.end_s - cut.start_s == pytest.approx(CUT_S, abs=1e-5)
        and math.isnan(cut.angle_start_rad)
    )
    assert (
        not bench.state.edm_cutting
        and not bench.level("edm_cutting")
        and bench.state.edm_starts == 1
    )
    assert 0.05 < cut.start_s - bench.take_received()[-1][0] < 0.0501


def test_other_keys_make_none():
    bench = devices_bench()
    for keys in (
        [0x14, 0x1C, 0xF0, 0x1C, 0xF0, 0x14],
        START[:5],
        [0x1D, 0xF0, 0x1D],
        [0x14, 0x1D, 0xF0, 0x1C, 0x1D, 0xF0, 0x14],
    ):
        bench.type(keys)
        bench.cable(0.1)
    assert bench.cuts == [] and bench.state.edm_starts == 0
    bench.type([0x14, *START])  # control came twice
    bench.cable(0.1)
    assert len(bench.cuts) == 1


def test_an_answer_between_the_keys_is_no_key():
    bench = devices_bench()
    bench.type(START[:3])
    bench.cable(0.01)
    bench.order([0xED, 0x02])
    bench.cable(0.02)
    bench.type(START[3:])
    bench.cable(0.1)
    assert len(bench.cuts) == 1


def test_a_start_while_it_cuts_is_ignored_and_counted():
    bench = devices_bench()
    cut_once(bench)
    bench.type(START)
    bench.cable(2 * CUT_S)
    assert len(bench.cuts) == 1 and bench.state.edm_starts == 2 and bench.state.edm_ignored == 1


def test_an_alarm_ends_a_cut_and_holds_the_next_back():
    bench = devices_bench()
    cut_once(bench)
    with bench.fault("edm_alarm"):
        bench.cable(0.01)
        assert (
            bench.level("edm_alarm")
            and not bench.level("edm_cutting")
            and not bench.cuts[0].complete
        )
        cut_once(bench)
        assert len(bench.cuts) == 1 and bench.state.edm_ignored == 1
    bench.cable(0.01)
    assert not bench.level("edm_alarm")
    cut_once(bench, 0.3)
    assert [cut.complete for cut in bench.cuts] == [False, True]


def test_a_cut_may_never_end_and_the_machine_may_ignore_its_keys():
    bench = devices_bench()
    with bench.fault("edm_endless"):
        cut_once(bench, 5 * CUT_S)
        assert bench.level("edm_cutting")
    bench.cable(0.01)
    assert not bench.level("edm_cutting") and bench.cuts[0].complete
    with bench.fault("edm_deaf"):
        cut_once(bench)
    assert len(bench.cuts) == 1 and bench.state.edm_ignored == 1


def test_the_state_bounces_and_settles():
    bench = devices_bench(clk_hz=1_000_000)
    bench.type(START)
    levels = numpy.concatenate(
        [bench.cable(0.02)["edm_cutting"], bench.cable(0.2)["edm_cutting"]]
    ).astype(int)
    edges = numpy.flatnonzero(numpy.diff(levels))
    split = numpy.flatnonzero(numpy.diff(edges) > 50_000)
    assert len(split) == 1 and len(edges) > 4
    for bounces in (edges[: split[0] + 1], edges[split[0] + 1 :]):
        assert len(bounces) % 2 == 1 and bounces[-1] - bounces[0] <= 2000


def test_it_makes_no_cut_where_there_is_no_machine():
    bench = DevicesBench(Devices(keyboard=True), clk_hz=CLK_HZ)
    cut_once(bench)
    assert bench.cuts == [] and received(bench) == START


@pytest.mark.skipif(not sigrok.installed(), reason="no sigrok-cli: make sigrok")
def test_sigrok_reads_the_same_from_the_cable():
    bench = devices_bench()
    keys = [random.randrange(1, 0x84) for _ in range(50)] + START
    bench.type(keys)
    levels = bench.cable(0.1)
    samples = (levels["edm_clock"] | levels["edm_data"] << 1).tobytes()
    assert sigrok.ps2(samples, CLK_HZ) == (bytes(keys), 0)

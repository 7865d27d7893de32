# SPDX-License-Identifier: Apache-2.0
"""moire.client: the answers of a node in real units and in words, every refusal with its values,
and motions that succeed, fail, or are interrupted.
"""

import random
from dataclasses import replace
from fractions import Fraction

import pytest

from moire.analysis.tune import Tuning
from moire.client.bus import Bus
from moire.client.values import CHOICES
from moire.errors import (
    BusError,
    BusGarbled,
    MotionFailed,
    NoAnswer,
    OutOfRange,
    PortError,
    Refused,
    UnitError,
    UnknownName,
    WrongBuild,
)
from moire.made.bus_tables import CAUSES, PARAMETERS, PROTOCOL_CRC
from moire.made.registers import FIELDS, MAP_CRC
from tb.bench import seed
from tb.fakes.fake_node import ESTOP, LIMIT_LOW, FakeBus, FakeNode

SEED = seed()


def stage(**node):
    fake = FakeBus(FakeNode(**node))
    return fake, fake.nodes[0], Bus(fake).axis(fake.nodes[0].address)


def homed_stage():
    fake, node, axis = stage()
    axis.enable()
    axis.home()
    return fake, node, axis


# ------------------------------------------------------------------ finding nodes


def test_find_lists_every_node_of_any_build():
    fake = FakeBus(FakeNode(3, axes=2), FakeNode(15, map_crc=5))
    found = Bus(fake).find()
    assert [(node.address, node.axes, node.matches) for node in found] == [
        (3, 2, True),
        (15, 1, False),
    ]
    assert Bus(fake).find([1, 2]) == []
    assert fake.now() < 10


def test_no_answer_is_a_clear_exception():
    with pytest.raises(NoAnswer, match="nobody answers at address 4, asked 5 times: check power"):
        Bus(FakeBus(FakeNode(1))).axis(4)


@pytest.mark.parametrize(
    "crc, value, words",
    [("map_crc", MAP_CRC, "register map"), ("protocol_crc", PROTOCOL_CRC, "protocol table")],
)
def test_a_node_of_another_build_is_refused_with_both_numbers(crc, value, words):
    with pytest.raises(
        WrongBuild, match=f"{words}.*CRC-32 0000BEEF in the node, {value:08X} in this host"
    ) as caught:
        Bus(FakeBus(FakeNode(**{crc: 0xBEEF}))).axis()
    assert (caught.value.node, caught.value.host) == (0xBEEF, value)


def test_an_axis_that_does_not_exist_is_refused():
    with pytest.raises(Refused, match="node 1 has no axis 1: it has only axis 0"):
        Bus(FakeBus(FakeNode())).axis(1, 1)
    with pytest.raises(Refused, match="axes 0 to 1"):
        Bus(FakeBus(FakeNode(axes=2))).axis(1, 2)


def test_a_garbled_bus_and_a_silent_bus_are_different_errors():
    fake = FakeBus(FakeNode())
    fake.from_node = lambda word: [word ^ 4]
    with pytest.raises(BusGarbled, match="garbled, tried 5 times: 65 came instead of 61"):
        Bus(fake).axis()


# ------------------------------------------------------------------ real units


def test_status_is_in_real_units():
    fake, node, axis = stage()
    inside = node.axes[0]
    inside.enabled, inside.homed, inside.position, inside.target = (
        True,
        True,
        65536 * 1250 + 4096,
        65536 * 1250,
    )
    inside.events = 0b10010
    status = axis.status()
    assert status.position_nm == pytest.approx(1_000_050) and status.target_nm == 1_000_000
    assert status.counts == 1250 * 160 + 10
    assert (
        status.enabled
        and status.homed
        and status.settled
        and not status.estop
        and not status.limit_low
    )
    assert (status.state, status.words, status.faults, status.encoder_events) == (
        "holding",
        "holding position",
        (),
        ("overspeed", "disagreement"),
    )
    inside.go("moving", fake.now(), 1.0, 0)
    status = axis.status()
    # 1.5 periods of 800 nm in a tick of 0.25 ms
    assert (
        status.velocity_mm_s == pytest.approx(4.8)
        and status.drive_command == -0.5
        and status.in_motion
    )


def test_the_period_is_read_from_the_node():
    fake = FakeBus(FakeNode())
    fake.nodes[0].axes[0].parameters[1] = 4_000_000
    axis = Bus(fake).axis()
    assert axis.period_nm == 4000 and axis.to_nm(65536) == 4000 and axis.to_counts(-6000) == -98304


def test_encoder_counters_and_registers():
    fake, node, axis = stage()
    encoder = axis.encoder()
    assert (encoder.sin, encoder.cos, encoder.amplitude, encoder.quadrature_count) == (
        -100,
        27,
        103,
        -4,
    )
    assert (
        encoder.home_phase_nm == -200
        and encoder.home_margin == 0.5
        and encoder.fault_position_nm == 800
    )
    assert (
        axis.node.counters()["frames_good"] == 4
    )  # identify, period, encoder and the request itself
    assert axis.node.read_register(0x400) == 7
    with pytest.raises(Refused, match=r"no register at this address \(address 0x0404\)"):
        axis.node.read_register(0x404)
    for wrong in (2, -4, 65536):
        with pytest.raises(OutOfRange, match="multiples of 4"):
            axis.node.read_register(wrong)


def test_registers_are_read_by_name_and_wide_ones_low_word_first():
    _, node, axis = stage()
    known = {(field.block, field.register): field for field in FIELDS}
    position = known["axis", "position"].address()
    node.registers = {
        position: 0xFFFF0000,
        position + 4: 0x0000FFFF,
        known["axis", "control"].address(): 0b101,
    }
    assert axis.node.read_named("axis.position") == {"value": -65536}
    assert axis.node.read_named("axis.control") == {
        "enable": 1,
        "closed_loop": 0,
        "homing": 1,
        "fine": 0,
    }
    with pytest.raises(
        UnknownName, match="there is no register 'axis.speed': known are node.map_crc"
    ):
        axis.node.read_named("axis.speed")
    with pytest.raises(OutOfRange, match="bus.transmit can only be written"):
        axis.node.read_named("bus.transmit")


# ------------------------------------------------------------------ motion


def test_home_and_move_reach_their_targets():
    fake, node, axis = stage()
    axis.enable()
    seen = []
    status = axis.home(progress=seen.append)
    assert (
        status.homed
        and status.position_nm == 0
        and {"homing", "holding"} == {each.state for each in seen}
    )
    assert axis.move(mm=1.5).position_nm == 1_500_000
    assert axis.move("-200um", by=True).position_nm == 1_300_000
    assert axis.move(nm=50).position_nm == pytest.approx(50, abs=0.01)
    with pytest.raises(OutOfRange, match="a move needs one target"):
        axis.move("1nm", mm=1)
    with pytest.raises(UnitError):
        axis.move("fast")


@pytest.mark.parametrize("operation", ["move", "begin_move", "prepare"])
def test_a_target_without_its_unit_is_refused_and_the_axis_does_not_move(operation):
    fake, node, axis = homed_stage()
    for number in (1.5, 0, Fraction(3, 2)):
        with pytest.raises(UnitError, match="has no unit: write mm="):
            getattr(axis, operation)(number)
    assert operation not in node.executed and "move" not in node.executed


@pytest.mark.parametrize("number", [float("nan"), float("inf"), -float("inf"), "far", None])
@pytest.mark.parametrize("unit", ["nm", "um", "mm"])
def test_a_target_that_is_no_finite_number_is_out_of_range(unit, number):
    fake, node, axis = homed_stage()
    with pytest.raises(OutOfRange, match="is no length: give a finite number|needs one target"):
        axis.move(**{unit: number})
    assert "move" not in node.executed


@pytest.mark.parametrize(
    "target", [{"um": 1500}, {"mm": 1.5}, {"nm": 1.5e6}, {"mm": Fraction(3, 2)}]
)
def test_a_target_may_have_any_of_three_units(target):
    fake, node, axis = homed_stage()
    assert axis.move(**target).position_nm == 1_500_000


def test_the_end_of_a_with_block_switches_the_drive_off():
    fake, node, axis = stage()
    with axis as same:
        assert same is axis
        axis.enable()
        axis.home()
        assert node.axes[0].enabled
    assert not node.axes[0].enabled


def test_a_with_block_leaves_a_drive_on_that_was_on_before_also_when_nested():
    fake, node, axis = homed_stage()
    with axis:
        axis.move(mm=1)
        with axis:
            axis.move(mm=2)
    assert node.axes[0].enabled and axis.status().position_nm == 2_000_000


@pytest.mark.parametrize("was_on", [False, True])
def test_an_exception_in_a_with_block_stops_the_axis_before_the_drive_is_off(was_on):
    fake, node, axis = homed_stage()
    if not was_on:
        axis.disable()
    with pytest.raises(ZeroDivisionError):
        with axis:
            axis.enable()
            axis.begin_move(mm=10)
            raise ZeroDivisionError
    assert node.axes[0].kind is None and node.axes[0].enabled == was_on
    assert node.executed.count("stop") == 1
    last = [name for name in node.executed if name in ("stop", "enable")][-1]
    assert last == ("stop" if was_on else "enable")


def test_the_error_in_a_with_block_is_raised_and_not_that_of_its_end():
    fake, node, axis = stage()
    with pytest.raises(ZeroDivisionError):
        with axis:
            fake.to_node = lambda word: []
            raise ZeroDivisionError
    fake, node, axis = stage()
    with pytest.raises(NoAnswer):
        with axis:
            fake.to_node = lambda word: []


def test_a_travel_whose_ends_are_swapped_is_refused_by_the_host():
    fake, node, axis = stage()
    with pytest.raises(
        OutOfRange, match=r"travel_high \(-1mm\) would lie below travel_low \(-800um\)"
    ):
        axis.set_parameter("travel_high", "-1mm")
    with pytest.raises(OutOfRange, match="would lie below travel_low"):
        axis.set_parameter("travel_low", "120mm")
    with pytest.raises(OutOfRange, match="would lie below travel_low"):
        axis.load_parameters({"kp": "0.5", "travel_low": "2mm", "travel_high": "1mm"})
    assert node.axes[0].writes == []
    axis.set_parameter("travel_high", "-800um")
    axis.load_parameters({"travel_low": "-3mm", "travel_high": "-2mm"})
    assert axis.get_parameter("travel_high").value == -2_000_000


def test_refusals_carry_the_words_of_the_table_and_the_values():
    fake, node, axis = stage()
    with pytest.raises(
        Refused, match="node 1 refused 'home': the drive is off: enable it first"
    ) as caught:
        axis.home()
    assert (caught.value.cause, caught.value.code) == ("not_enabled", 8)
    axis.enable()
    with pytest.raises(Refused, match="home it first"):
        axis.move(mm=1)
    axis.home()
    with pytest.raises(
        Refused, match=r"outside the travel \(target 130mm, allowed -800um to 119.6mm\)"
    ):
        axis.move(mm=130)
    node.axes[0].go("moving", fake.now(), 10.0, 65536)
    with pytest.raises(Refused, match="stop it or wait"):
        axis.move(mm=1)
    with pytest.raises(Refused, match=r"stop it or wait \(kp 0.5\)"):
        axis.set_parameter("kp", 0.5)


def test_every_cause_of_the_table_becomes_a_refusal_with_its_words():
    for code, (name, words) in CAUSES.items():
        fake, node, axis = stage()
        node.execute = lambda body, code=code: bytes([body[0], body[1], code])
        if code == 0:
            continue
        with pytest.raises(Refused) as caught:
            axis.node.request("stop", axis=0)
        assert caught.value.cause == name and words in str(caught.value)
    node.execute = lambda body: bytes([body[0], body[1], 200])
    with pytest.raises(Refused, match="cause 200"):
        axis.node.request("stop", axis=0)


def test_hardware_and_firmware_that_do_not_fit_are_refused_in_words():
    fake = FakeBus(FakeNode())
    fake.nodes[0].wrong_map = True
    with pytest.raises(Refused, match="register maps differ"):
        Bus(fake).axis()


def test_a_fault_is_reported_in_words_until_it_is_reset():
    fake, node, axis = homed_stage()
    node.axes[0].active_faults = ESTOP
    status = axis.status()
    assert (status.state, status.faults, status.first_fault, status.fault_words, status.estop) == (
        "faulted",
        ("estop",),
        ("estop",),
        "emergency stop",
        True,
    )
    with pytest.raises(Refused, match=r"remove its cause and reset it first \(emergency stop\)"):
        axis.enable()
    with pytest.raises(
        Refused, match=r"the cause of the fault is still present \(emergency stop\)"
    ):
        axis.reset()
    node.axes[0].active_faults = 0
    axis.reset()
    assert axis.status().faults == ()


def test_a_motion_that_a_fault_ends_names_the_first_fault():
    fake, node, axis = homed_stage()
    fake.at.append((fake.now() + 0.2, lambda: setattr(node.axes[0], "active_faults", LIMIT_LOW)))
    with pytest.raises(
        MotionFailed,
        match=r"axis 0 of node 1: a fault ended the motion: limit switch at the low end "
        r"\(at .*, target 10mm\)",
    ) as caught:
        axis.move(mm=10)
    assert caught.value.cause == "ended_by_fault"


@pytest.mark.parametrize("cause", ["no_switch", "switch_stuck", "not_settled"])
def test_a_motion_that_fails_reports_the_cause(cause):
    fake, node, axis = homed_stage()
    node.axes[0].end_cause = cause
    with pytest.raises(MotionFailed, match=dict(CAUSES.values())[cause]):
        axis.home()


def test_stop_from_the_progress_call_ends_the_motion_as_stopped():
    fake, node, axis = homed_stage()
    with pytest.raises(MotionFailed, match="stopped by the host"):
        axis.move(mm=10, progress=lambda status: axis.stop() if status.position_nm > 1e6 else None)
    assert not axis.status().in_motion


@pytest.mark.parametrize("what", [KeyboardInterrupt, ZeroDivisionError])
@pytest.mark.parametrize("motion", ["home", "move"])
def test_whatever_interrupts_the_wait_brings_the_axis_to_rest_first(what, motion):
    fake, node, axis = homed_stage()

    def interrupt(status):
        if status.state in ("homing", "moving"):
            raise what

    with pytest.raises(what):
        axis.home(progress=interrupt) if motion == "home" else axis.move(mm=10, progress=interrupt)
    assert node.executed.count("stop") == 1
    assert node.axes[0].kind is None and node.axes[0].ended == "stopped" and node.axes[0].enabled


def test_ctrl_c_in_the_middle_of_an_exchange_stops_the_axis_too():
    for position in range(40):
        fake, node, axis = homed_stage()
        seen = []

        def interrupt(word, position=position, seen=seen):
            seen.append(word)
            if len(seen) == position + 1:
                raise KeyboardInterrupt
            return [word]

        fake.to_node = interrupt
        with pytest.raises(KeyboardInterrupt):
            axis.move(mm=10)
        assert node.axes[0].kind is None, position
        assert axis.move(mm=1).position_nm == 1_000_000  # and the bus is in order again


def test_an_axis_that_cannot_be_stopped_is_reported():
    fake, node, axis = homed_stage()

    def cut_and_interrupt(status):
        fake.to_node = lambda word: []
        raise KeyboardInterrupt

    with pytest.raises(
        BusError,
        match="axis 0 of node 1 could not be stopped by the host, its watchdog has to: nobody",
    ):
        axis.move(mm=10, progress=cut_and_interrupt)


def test_waiting_sends_requests_often_enough_for_the_watchdog():
    fake, node, axis = homed_stage()
    times = []
    node.do_status = lambda inside, reported=node.do_status: (
        times.append(fake.now()) or reported(inside)
    )
    began = fake.now()
    axis.dwell(1.0)
    assert 1.0 <= fake.now() - began < 1.2
    assert max(b - a for a, b in zip(times, times[1:])) < 0.1


# ------------------------------------------------------------------ several axes, override, drive


def two_axes():
    """A node with both axes homed."""
    fake = FakeBus(FakeNode(axes=2))
    node = Bus(fake).node(1)
    for number in (0, 1):
        node.axis(number).enable()
        node.axis(number).home()
    return fake, node


def test_prepared_axes_begin_together_and_end_one_after_the_other():
    fake, node = two_axes()
    assert node.axis(0).prepare("2mm") == pytest.approx(2500 / 6000 + 0.05, abs=1e-3)
    node.axis(1).prepare(mm=1)
    assert node.axis(0).status().state == "prepared" and node.axis(0).status().position_nm == 0
    seen = []
    ended = node.start(
        0, 1, progress=lambda status: seen.append([axis.kind for axis in fake.nodes[0].axes])
    )
    assert [round(status.position_nm) for status in ended] == [2_000_000, 1_000_000]
    assert seen[0] == ["moving", "moving"] and all(status.ended == "ok" for status in ended)


def two_nodes():
    fake = FakeBus(FakeNode(1), FakeNode(2, axes=2))
    bus = Bus(fake)
    for axis in (bus.axis(1), bus.axis(2), bus.axis(2, 1)):
        axis.enable()
        axis.home()
    return fake, bus


def test_axes_of_two_nodes_begin_at_one_sync():
    fake, bus = two_nodes()
    chosen = [bus.axis(1), bus.axis(2, 1)]
    for axis in chosen:
        axis.prepare(mm=1)
    seen = []
    ended = bus.start(
        *chosen,
        progress=lambda status: seen.append(
            [axis.kind for node in fake.nodes for axis in node.axes]
        ),
    )
    assert (
        seen[0][0] == seen[0][2] == "moving" != seen[0][1]
        and [round(status.position_nm) for status in ended] == [1_000_000] * 2
    )
    assert [node.counters["syncs"] for node in fake.nodes] == [1, 1]


def test_none_of_two_nodes_starts_if_one_was_not_prepared():
    fake, bus = two_nodes()
    bus.axis(1).prepare(mm=1)
    with pytest.raises(Refused, match="the axis has no motion prepared"):
        bus.start(bus.axis(1), bus.axis(2))
    bus.sync()
    assert fake.nodes[0].axes[0].kind == "prepared"


def test_a_node_that_misses_the_sync_is_named_and_the_others_are_stopped():
    fake, bus = two_nodes()
    for axis in (bus.axis(1), bus.axis(2)):
        axis.prepare(mm=1)
    unreachable, receive_word = fake.nodes[1], fake.nodes[1].receive_word
    unreachable.receive_word = lambda word: (
        [] if unreachable.waiting_for_sync and word == 0x120 else receive_word(word)
    )
    with pytest.raises(BusError, match="node 2 did not receive the sync"):
        bus.start(bus.axis(1), bus.axis(2))
    fake.wait(1)
    assert bus.axis(1).status().ended == "stopped" and not unreachable.waiting_for_sync


def test_a_new_baud_rate_is_set_in_all_nodes_or_in_none():
    fake, bus = two_nodes()
    bus.set_baud(1_000_000, [1, 2])
    assert bus.baud_changed and fake.character_s == pytest.approx(11e-6)
    bus.first_baud()
    assert not bus.baud_changed and fake.character_s == pytest.approx(11 / 115_200)
    with pytest.raises(Refused, match="set_baud"):
        bus.set_baud(5_000_000, [1, 2])
    with pytest.raises(NoAnswer):
        bus.set_baud(1_000_000, [1, 3])
    assert fake.character_s == pytest.approx(11 / 115_200)


@pytest.mark.parametrize("rate", [115_200, 1_000_000, 9_600])
def test_nodes_at_any_usual_baud_rate_are_found_and_the_bus_keeps_that_rate(rate):
    fake, bus = two_nodes()
    for node in fake.nodes:
        node.baud = rate
    found, baud = bus.find_baud()
    assert [identity.address for identity in found] == [1, 2] and baud == rate
    assert bus.axis(2).status().state == "holding"


def test_a_rate_that_the_port_cannot_do_is_skipped_but_a_missing_port_is_an_error():
    fake, bus = two_nodes()
    fake.nodes[0].baud, able, set_baud = 9_600, {115_200, 9_600}, fake.set_baud

    def choosy(baud):
        if baud not in able:
            raise PortError("the port COM7 failed")
        set_baud(baud)

    fake.nodes[1].baud, fake.set_baud = 9_600, choosy
    assert bus.find_baud()[1] == 9_600
    able.clear()
    with pytest.raises(PortError, match="COM7"):
        bus.find_baud()


def test_without_a_node_the_first_rate_is_kept_and_garbled_answers_are_reported():
    fake, bus = two_nodes()
    assert bus.find_baud([5], rates=(9_600,)) == ([], 115_200) and fake.baud == 115_200
    fake.from_node = lambda word: [word ^ 1]
    with pytest.raises(BusGarbled):
        bus.find_baud(rates=(9_600,))


def test_find_reports_two_nodes_with_one_address_that_identify_themselves_alike():
    fake = FakeBus(FakeNode(), FakeNode())
    fake.wired_and = True
    assert [identity.address for identity in Bus(fake).find()] == [
        1
    ]  # equal in every cycle: the two could not be distinguished
    fake.nodes[1].powered_up = 0.3
    with pytest.raises(BusGarbled, match="two nodes with the address 1"):
        Bus(fake).find()


def test_what_needs_the_bus_itself_is_refused_through_a_gateway():
    fake, bus = two_nodes()
    fake.handshake = False
    for action in (
        bus.sync,
        lambda: bus.set_baud(9600, [1]),
        bus.find_baud,
        lambda: bus.start(bus.axis(1)),
    ):
        with pytest.raises(BusError, match="the bus of the nodes itself"):
            action()


def test_none_starts_if_one_was_not_prepared():
    fake, node = two_axes()
    node.axis(0).prepare("1mm")
    with pytest.raises(Refused, match="the axis has no motion prepared"):
        node.start(0, 1)
    assert fake.nodes[0].axes[0].kind == "prepared"
    with pytest.raises(OutOfRange, match="no axis is given"):
        node.start()
    with pytest.raises(Refused, match="node 1 has no axis 2"):
        node.start(2)
    node.axis(0).stop()
    fake.wait(1)
    assert node.axis(0).status().ended == "stopped"


def test_an_interrupted_common_start_stops_all_of_them():
    fake, node = two_axes()
    for number in (0, 1):
        node.axis(number).prepare("50mm")

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        node.start(0, 1, progress=interrupt)
    assert [axis.ended for axis in fake.nodes[0].axes] == ["stopped", "stopped"]


def test_a_prepared_move_beyond_the_travel_reports_its_end():
    _, _, axis = homed_stage()
    with pytest.raises(Refused, match="target 200mm, allowed -800um to 119.6mm"):
        axis.prepare("200mm")
    with pytest.raises(OutOfRange, match="a prepare needs one target"):
        axis.prepare()


def test_pause_halts_and_resume_continues_at_the_earlier_override():
    fake, node, axis = homed_stage()
    assert axis.override() == 1 and axis.override("50%") == Fraction(1, 2)
    seconds = axis.begin_move("4.8mm")
    assert seconds == pytest.approx(1.05, abs=0.01)
    fake.wait(0.5)
    axis.pause()
    axis.pause()  # a second pause changes nothing
    halted = axis.status().position_nm
    fake.wait(10)
    assert axis.status().position_nm == halted and axis.status().in_motion and 0 < halted < 4.8e6
    assert axis.resume() == Fraction(1, 2)
    assert axis.motion_end().position_nm == pytest.approx(4.8e6, abs=1)


def test_resume_of_what_another_program_paused_is_full_speed():
    fake, _, axis = homed_stage()
    axis.pause()
    assert Bus(fake).axis(1).resume() == 1


@pytest.mark.parametrize("share", ["120%", "-1%", 1.5, "fast", "50 mm"])
def test_an_override_outside_0_to_1_is_refused(share):
    fake, node, axis = homed_stage()
    with pytest.raises(UnitError):
        axis.override(share)
    assert axis.override() == 1


def test_ctrl_c_while_waiting_for_a_motion_stops_it():
    fake, node, axis = homed_stage()
    axis.begin_move("50mm")

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        axis.motion_end(interrupt)
    assert node.axes[0].ended == "stopped"


def test_home_stores_the_requested_method():
    _, node, axis = homed_stage()
    for method, counts in ((35, 35), ("17", 17), ("s3", -2), ("s0", -1)):
        assert axis.home(method=method).homed
        assert node.axes[0].parameters[PARAMETERS["home_method"].id] == counts
    with pytest.raises(OutOfRange, match="home_method allows -2 to 37, not 99"):
        axis.home(method=99)


def test_the_drive_is_reported_in_words():
    _, node, axis = homed_stage()
    node.registers.update(
        {0x1400: 1 | 0b1111 << 2, 0x1420: -7 & 0xFFFFFFFF, 0x143C: -16384 & 0xFFFF}
    )
    drive = axis.drive()
    assert (drive.kind, drive.built, drive.steps, drive.fine_command) == (
        "steps",
        ("bridge", "steps", "dac", "fine"),
        -7,
        -0.5,
    )
    assert drive.override == 1


def test_a_parameter_that_is_a_choice_is_written_and_read_by_name():
    _, node, axis = stage()
    for name, known in PARAMETERS.items():
        if name not in CHOICES:
            continue
        words = CHOICES[name]
        assert len(words) == known.max - known.min + 1 and known.min == 0
        for counts, word in enumerate(words):
            assert (
                axis.set_parameter(name, word).counts
                == counts
                == axis.set_parameter(name, str(counts)).counts
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
    written = {name: node.axes[0].parameters[known.id] for name, known in PARAMETERS.items()}
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


# ------------------------------------------------------------------ parameters


def test_parameters_are_in_real_units():
    fake, node, axis = stage()
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
    assert axis.set_parameter("velocity", "5mm/s").value == 5 and node.axes[0].parameters[5] == 6250
    assert axis.set_parameter("velocity", 4).counts == 5000
    assert axis.set_parameter("kp", 0.25).counts == 16384


@pytest.mark.parametrize("name", list(PARAMETERS))
def test_both_ends_of_each_range_are_accepted_and_values_beyond_are_not_sent(name):
    fake, node, axis = stage()
    known = PARAMETERS[name]
    value = axis.get_parameter(name)
    one = (value.maximum - value.minimum) / (known.max - known.min)
    for end, beyond, counts in ((value.minimum, -one, known.min), (value.maximum, one, known.max)):
        if name == "period":
            fake, node, axis = stage()
        if name == "travel_low":
            axis.set_parameter("travel_high", value.maximum)
        if name == "travel_high":
            axis.set_parameter("travel_low", value.minimum)
        assert axis.set_parameter(name, end).counts == counts == node.axes[0].parameters[known.id]
        written = len(node.axes[0].writes)
        if name != "period":
            with pytest.raises(OutOfRange, match=f"{name} allows .*(, | to ).*, not "):
                axis.set_parameter(name, end + beyond)
        assert len(node.axes[0].writes) == written


def test_wrong_values_are_refused_with_what_is_allowed():
    fake, node, axis = stage()
    with pytest.raises(OutOfRange, match="velocity allows 800nm/s to 800mm/s, not 900mm/s"):
        axis.set_parameter("velocity", "900mm/s")
    with pytest.raises(OutOfRange, match="period allows 1pm to 4mm, not 5mm"):
        axis.set_parameter("period", "5mm")
    with pytest.raises(OutOfRange, match="counts_per_period takes whole numbers, not 160.5"):
        axis.set_parameter("counts_per_period", "160.5")
    with pytest.raises(UnitError, match="'5mm' is no speed"):
        axis.set_parameter("velocity", "5mm")
    with pytest.raises(
        UnknownName, match="there is no parameter 'speed': known are period, counts_per_period"
    ):
        axis.get_parameter("speed")
    node.do_set_parameter = lambda *_, **__: ("out_of_range", {})
    with pytest.raises(Refused, match=r"outside the range of this parameter \(velocity 5mm/s\)"):
        axis.set_parameter("velocity", "5mm/s")
    assert node.axes[0].writes == []


def test_saved_parameters_are_restored_to_the_last_bit():
    print("SEED", SEED)
    source = random.Random(SEED)
    for _ in range(10):
        fake, node, axis = stage()
        counts = {
            known.id: source.choice([known.min, known.max, source.randint(known.min, known.max)])
            for known in PARAMETERS.values()
        }
        low, high = (PARAMETERS[name].id for name in ("travel_low", "travel_high"))
        counts[low], counts[high] = sorted((counts[low], counts[high]))
        node.axes[0].parameters.update(counts)
        axis.period_nm = axis.read_period()
        saved = axis.save_parameters()
        _, other, fresh = stage()
        assert len(fresh.load_parameters(saved)) == len(PARAMETERS)
        assert other.axes[0].parameters == counts and other.axes[0].writes[0] == "period"
        assert fresh.period_nm == Fraction(counts[1], 1000)


def test_a_file_with_one_wrong_value_writes_nothing():
    fake, node, axis = stage()
    for wrong in (
        {"kp": "0.5", "velocity": "900mm/s"},
        {"kp": "0.5", "speed": "1mm/s"},
        {"kp": "0.5", "jerk": "x"},
    ):
        with pytest.raises((OutOfRange, UnknownName, UnitError)):
            axis.load_parameters(wrong)
    assert node.axes[0].writes == []

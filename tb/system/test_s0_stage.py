# SPDX-License-Identifier: Apache-2.0
"""The S0 stage as shipped: RTL and firmware of both nodes, the machine, and the host package on the
bus.
"""

import random

import pytest

from experiments.s0_stage import ADDRESSES, PERIOD_NM, Stage
from moire.bus.protocol import request_body
from moire.client import records
from moire.client.bus import Bus
from moire.errors import BusGarbled, MotionFailed, NoAnswer, OutOfRange, Refused, WrongBuild
from moire.made.bus_tables import CAUSES, PARAMETERS
from tb.bench import seed

SEED = seed()
AXIS = {name: number for number, name in enumerate(ADDRESSES)}
BOUND_NM = 50.0  # of the true position after a move


@pytest.fixture(scope="module")
def homed():
    """One stage for the tests of this file, both axes homed."""
    print(f"SEED={SEED}")
    stage = Stage.power_up(SEED)
    stage.find()
    for name in stage.axes:
        stage.home(name)
    return stage


@pytest.fixture
def stage(homed):
    """The homed stage holds with both drives on. A test may leave any fault that a reset clears."""
    for axis in homed.axes.values():
        if axis.status().faults:
            axis.reset()
        axis.enable()
    return homed


def steady_state(stage, name):
    """True position, reported position and target, which a refused command must not change. It
    waits long enough for a motion to show.
    """
    stage.dwell(0.05)
    status = stage.axes[name].status()
    return stage.true_nm(name), status.target_nm


def refused(cause, call, *arguments, **named):
    with pytest.raises(Refused) as caught:
        call(*arguments, **named)
    assert caught.value.cause == cause, str(caught.value)
    return str(caught.value)


# ------------------------------------------------------------------ the usual operation


def test_power_up_finds_both_nodes_with_drives_off_and_no_zero():
    stage = Stage.power_up(SEED + 1)
    identities = stage.find()
    assert [identity.address for identity in identities] == list(ADDRESSES.values())
    assert all(identity.matches for identity in identities)
    for name, axis in stage.axes.items():
        status = axis.status()
        assert (status.state, status.ended, status.enabled, status.homed, status.faults) == (
            "off",
            "no_motion_yet",
            False,
            False,
            (),
        )
        assert stage.true_nm(name, from_zero=False) != pytest.approx(
            status.position_nm, abs=1000
        ), "the position at power-up is unknown"
        refused("not_enabled", axis.move, nm=0)
        axis.enable()
        refused("not_homed", axis.move, nm=0)
        assert not axis.status().in_motion


def test_homing_takes_the_zero_at_a_phase_zero(homed):
    for name, axis in homed.axes.items():
        status, encoder = axis.status(), axis.encoder()
        assert status.homed and status.state == "holding"
        before, position_nm, after = (
            homed.true_nm(name, False),
            float(axis.status().position_nm),
            homed.true_nm(name, False),
        )
        from_phase_zero = (
            (before + after) / 2 - position_nm + PERIOD_NM / 2
        ) % PERIOD_NM - PERIOD_NM / 2
        print(
            f"{name}: the zero is {from_phase_zero:.2f} nm from a phase zero of the interferometer"
        )
        assert abs(from_phase_zero) < 20, (
            "the zero is a phase zero, except for the error of one reading and of a signal without "
            "calibration"
        )
        assert abs(homed.true_nm(name)) < BOUND_NM
        apart = (
            encoder.phase * PERIOD_NM - status.position_nm + PERIOD_NM / 2
        ) % PERIOD_NM - PERIOD_NM / 2
        assert abs(apart) < 10, "the position's fraction is the phase"
        assert encoder.home_margin > 0.2, (
            f"the switch is too near the middle between two phase zeros: {encoder.home_phase_nm} nm"
        )


def test_five_moves_reach_their_targets(stage):
    for name, target_nm in (
        ("X", 0.3e6),
        ("Y", 0.2e6),
        ("X", 0.3e6 + 100),
        ("Y", -0.05e6),
        ("X", 1234.5),
    ):
        move = stage.move(name, target_nm)
        assert abs(move.error_nm) <= BOUND_NM, move
        assert move.error_nm == move.target_nm - move.true_nm, "the sign of every error"
        assert abs(move.reached_nm - target_nm) <= BOUND_NM, move


def test_targets_that_change_in_flight_leave_the_queue_filled(stage):
    """The soft core goes on feeding while it plans: the profile never runs out, and the axis ends
    at the last target.
    """
    axis, transport = stage.axes["X"], stage.bus.transport
    targets, longest = (3e6, 3.000_01e6, 1e6, 2.5e6, -0.02e6), 0.0
    for target_nm in targets:
        began = transport.now()
        axis.request("move", target=axis.to_counts(target_nm))
        longest = max(longest, transport.now() - began)
        stage.dwell(0.02)
    axis.wait(stage.record_while_moving("X"))
    status = axis.status()
    assert (
        not status.faults
        and abs(status.target_nm - targets[-1]) < 1
        and abs(stage.true_nm("X") - targets[-1]) <= BOUND_NM
    )
    print(f"answered within {longest * axis.node.identity.clk_hz / 1e3:.0f} 000 clk")
    assert longest * axis.node.identity.clk_hz < 900_000


def test_homing_again_finds_the_same_zero(stage):
    zero = stage.zero_nm["X"]
    stage.move("X", 0.1e6)
    stage.home("X")
    assert stage.zero_nm["X"] == zero


def test_stop_in_mid_move_keeps_the_axis_under_control(stage):
    axis = stage.axes["X"]
    axis.request("move", target=axis.to_counts(1.5e6))
    stage.dwell(0.15)
    before = axis.status()
    assert before.velocity_mm_s > 1
    axis.stop()
    with pytest.raises(MotionFailed) as caught:
        axis.wait(stage.record_while_moving("X"))
    assert caught.value.cause == "stopped"
    status = axis.status()
    assert status.enabled and status.state == "holding" and not status.faults
    assert before.position_nm < status.position_nm < 1.4e6
    assert abs(stage.move("X", 0).error_nm) <= BOUND_NM


# ------------------------------------------------------------------ sensing


def sub_division_errors(stage, name, count=8, looks=8):
    """True position less that of the encoder, in nm, at positions spread over a period; the mean of
    some readings, since a stage that holds its position moves by a nanometre or two between them.
    """
    errors = []
    for n in range(count):
        stage.move(name, 1000 * n + PERIOD_NM * n / count)
        errors.append(
            sum(stage.true_nm(name) - stage.axes[name].status().position_nm for _ in range(looks))
            / looks
        )
    return errors


def test_the_calibration_removes_the_ellipse_in_motion(stage):
    stage.axes["X"].disable()  # its node rests, so the twin is faster
    axis = stage.axes["Y"]
    before = sub_division_errors(stage, "Y")
    axis.calibration("calibrate")
    for n in range(30):
        stage.move("Y", 0.3e6 if n % 2 else 0.7e6)
        if axis.calibration("read").accepted:
            break
    calibration = axis.calibration("freeze")
    assert calibration.accepted == 1 and calibration.refused == 0, calibration
    after = sub_division_errors(stage, "Y")
    spread = [max(errors) - min(errors) for errors in (before, after)]
    assert spread[1] < spread[0] / 3 and spread[1] < 2.5, (
        f"from {spread[0]:.1f} to {spread[1]:.1f} nm"
    )
    assert not axis.signal().faults


def test_positions_are_captured_on_demand(stage):
    axis = stage.axes["X"]
    axis.capture_from("software")
    for _ in range(3):
        axis.capture_now()
    captures, overrun = axis.captures()
    axis.capture_from()
    assert len(captures) == 3 and not overrun
    assert all(
        abs(capture.position_nm - axis.status().position_nm) < BOUND_NM for capture in captures
    )


# ------------------------------------------------------------------ faults


def fault_during_move(stage, name, provoke, distance_nm=0.5e6):
    """Begin a move and provoke a fault in its middle; returns the status soon after and the true
    position of the axis at that time.
    """
    axis = stage.axes[name]
    here = axis.status().position_nm
    axis.request("move", target=axis.to_counts(here + distance_nm))
    stage.dwell(0.06)
    provoke()
    return axis


def assert_stopped_by(stage, name, cause):
    axis = stage.axes[name]
    assert not stage.twin.truth(AXIS[name]).enabled, "the drive is off at the pins"
    status = axis.status()
    assert not status.enabled and status.state == "faulted" and cause in status.first_fault, status
    refused("faulted", axis.move, nm=0)
    refused("faulted", axis.enable)
    stage.dwell(0.1)
    position = stage.true_nm(name)
    stage.dwell(0.1)
    assert abs(stage.true_nm(name) - position) < 100, "the axis is at rest"
    return status


def assert_position_survived(stage, name):
    status = stage.axes[name].status()
    assert status.homed and abs(status.position_nm - stage.true_nm(name)) < BOUND_NM


def test_limit_switch_stops_the_drive_and_lets_the_axis_leave(stage):
    axis = stage.axes["X"]
    stage.move("X", 0)
    low = axis.get_parameter("travel_low")
    axis.set_parameter("travel_low", "-1.3mm")
    with pytest.raises(MotionFailed) as caught:
        stage.move("X", -1.2e6)
    assert caught.value.cause == "ended_by_fault" and "limit switch at the low end" in str(
        caught.value
    )
    status = assert_stopped_by(stage, "X", "limit_low")
    assert status.limit_low
    assert_position_survived(stage, "X")
    axis.reset()
    axis.enable()
    position = stage.true_nm("X")
    axis.request(
        "move", target=axis.to_counts(-1.29e6)
    )  # further in: the interlock passes no command
    stage.dwell(0.3)
    assert position - 100 < stage.true_nm("X") < position + 5000
    axis.disable()
    axis.reset()
    axis.enable()
    assert abs(stage.move("X", 0).error_nm) <= BOUND_NM
    axis.write_parameter("travel_low", low.counts)
    assert not axis.status().faults


def test_the_emergency_stop_disables_the_drive_at_once_until_it_is_reset(stage):
    axis = fault_during_move(stage, "X", lambda: stage.twin.inject("estop", AXIS["X"]))
    stage.twin.run(1e-5)
    assert not stage.twin.truth(AXIS["X"]).enabled, "off within 10 us, whatever the soft core does"
    assert_stopped_by(stage, "X", "estop")
    assert "emergency stop" in refused("fault_persists", axis.reset)
    stage.twin.clear("estop", AXIS["X"])
    stage.dwell(0.01)
    refused("faulted", axis.enable)
    axis.reset()
    axis.enable()
    assert_position_survived(stage, "X")
    assert abs(stage.move("X", 0).error_nm) <= BOUND_NM


def test_cut_cable_stops_both_drives(stage):
    fault_during_move(stage, "X", lambda: stage.twin.inject("line_cut", "host"), distance_nm=1.5e6)
    stage.twin.run(0.6)
    assert not any(stage.twin.truth(AXIS[name]).enabled for name in AXIS)
    with pytest.raises(NoAnswer):
        stage.axes["X"].status()
    stage.twin.clear("line_cut", "host")
    for name, axis in stage.axes.items():
        assert_stopped_by(stage, name, "bus_watchdog")
        assert_position_survived(stage, name)
        axis.reset()
        axis.enable()


def test_a_cut_encoder_is_a_fault_and_clears_the_zero(stage):
    axis = fault_during_move(stage, "Y", lambda: stage.twin.inject("encoder_cut", AXIS["Y"]))
    stage.dwell(0.01)
    assert_stopped_by(stage, "Y", "encoder")
    stage.twin.clear("encoder_cut", AXIS["Y"])
    stage.dwell(0.02)
    axis.reset()
    axis.enable()
    refused("not_homed", axis.move, nm=0)
    stage.home("Y")
    assert abs(stage.true_nm("Y")) < BOUND_NM


def test_jammed_motor_is_a_following_error(stage):
    axis = fault_during_move(stage, "X", lambda: stage.twin.inject("motor_jam", AXIS["X"]))
    stage.dwell(0.3)
    assert_stopped_by(stage, "X", "following_error")
    stage.twin.clear("motor_jam", AXIS["X"])
    axis.reset()
    axis.enable()
    assert_position_survived(stage, "X")


def test_the_drive_fault_pin_disables_the_drive(stage):
    axis = fault_during_move(
        stage, "X", lambda: stage.twin.inject("drive_fault", AXIS["X"]), distance_nm=-0.2e6
    )
    stage.dwell(0.01)
    assert_stopped_by(stage, "X", "drive")
    refused("fault_persists", axis.reset)
    stage.twin.clear("drive_fault", AXIS["X"])
    stage.dwell(0.01)
    axis.reset()


# ------------------------------------------------------------------ the bus


def test_nonsense_on_the_bus_moves_nothing_and_the_next_command_works(stage):
    axis = stage.axes["X"]
    before = steady_state(stage, "X")
    bad = axis.node.counters()
    for n in range(3):
        stage.twin.send_nonsense(400, seed=SEED + n)
        stage.dwell(0.02)
        assert stage.axes["X"].status().state == "holding"
    after = steady_state(stage, "X")
    assert after[1] == before[1] and abs(after[0] - before[0]) < BOUND_NM
    now, kinds = axis.node.counters(), ("framing_errors", "frames_bad", "start_glitches")
    assert sum(now[kind] for kind in kinds) > sum(bad[kind] for kind in kinds)
    assert abs(stage.move("X", 2000).error_nm) <= BOUND_NM


def send_frame(stage, address, body, crc_flip=0, length=None):
    """Send a write frame by hand; returns the words of the answers to the command byte and the
    payload.
    """
    import zlib

    command = 0x20 | address
    payload = bytes([len(body) if length is None else length]) + body
    crc = (zlib.crc32(bytes([command]) + payload) ^ crc_flip).to_bytes(4, "little")
    transport = stage.bus.transport
    transport.send([0x100 | command])
    ready = transport.receive(1, 0.005)
    transport.send(list(payload + crc))
    return ready, transport.receive(64, 0.005)


def test_bad_crc_is_not_obeyed_and_counted(stage):
    axis = stage.axes["X"]
    before, bad = steady_state(stage, "X"), axis.node.counters()["frames_bad"]
    body = request_body("move", 77, axis=0, target=axis.to_counts(0.5e6))
    for crc_flip in (1, 0x80000000, 0xFFFFFFFF):
        ready, more = send_frame(stage, ADDRESSES["X"], body, crc_flip=crc_flip)
        assert ready == [0x60 | ADDRESSES["X"]] and more == [], "silent to nonsense"
    assert axis.node.counters()["frames_bad"] == bad + 3
    assert steady_state(stage, "X")[1] == before[1]


def test_a_frame_under_another_nodes_address_is_not_obeyed(stage):
    """Two flips turn address 1 into 2: the CRC-32 covers the command byte, so the wrong node
    refuses the frame.
    """
    import zlib

    body = request_body("move", 78, axis=0, target=stage.axes["X"].to_counts(0.5e6))
    payload = bytes([len(body)]) + body
    crc = zlib.crc32(bytes([0x20 | ADDRESSES["X"]]) + payload).to_bytes(4, "little")
    before = steady_state(stage, "Y")
    bad = stage.axes["Y"].node.counters()["frames_bad"]
    transport = stage.bus.transport
    transport.send([0x120 | ADDRESSES["Y"]])
    transport.receive(1, 0.005)
    transport.send(list(payload + crc))
    transport.wait(0.005)
    assert stage.axes["Y"].node.counters()["frames_bad"] == bad + 1
    assert steady_state(stage, "Y")[1] == before[1]


def test_a_repeated_request_is_answered_again_and_not_acted_on_again(stage):
    axis = stage.axes["X"]
    stage.move("X", 0)
    counted = axis.node.counters()["repeated"]
    body = request_body(
        "set_parameter", 99, axis=0, parameter=PARAMETERS["settle_time"].id, value=21
    )
    for _ in range(3):
        ready, _ = send_frame(stage, ADDRESSES["X"], body)
        transport = stage.bus.transport
        transport.send([0x110 | ADDRESSES["X"]])
        assert transport.receive(9, 0.01)[2:5] == [99, body[1], 0]
    assert axis.node.counters()["repeated"] == counted + 2
    axis.write_parameter("settle_time", 20)


# ------------------------------------------------------------------ bad input


def test_unknown_command_and_wrong_length_are_refused_in_words(stage, monkeypatch):
    before = steady_state(stage, "X")
    bodies = {
        bytes([41, 200]): "does not know this command",
        bytes([42, 5, 0, 1]): "wrong length",
        bytes([43]): "wrong length",
    }
    for body, words in bodies.items():
        send_frame(stage, ADDRESSES["X"], body)
        transport = stage.bus.transport
        transport.send([0x110 | ADDRESSES["X"]])
        reply = transport.receive(9, 0.01)
        assert reply[0] == 0x50 | ADDRESSES["X"] and reply[2] == body[0]
        assert words in CAUSES[reply[4]][1]
    assert steady_state(stage, "X")[1] == before[1]
    stage.axes["X"].status()


def test_an_address_without_a_node_is_reported(stage):
    with pytest.raises(NoAnswer, match="nobody answers at address 7"):
        stage.bus.node(7)


def test_target_outside_the_travel_is_refused_with_the_travel(stage):
    before = steady_state(stage, "X")
    for target in (-0.9e6, 119.7e6, 1e12):
        message = refused("out_of_travel", stage.axes["X"].move, nm=target)
        assert "-800um to 119.6mm" in message, message
    assert steady_state(stage, "X")[1] == before[1]


def test_parameter_out_of_range_is_refused_by_host_and_node(stage):
    axis = stage.axes["X"]
    before = axis.get_parameter("kp").counts
    with pytest.raises(OutOfRange, match="kp allows"):
        axis.set_parameter("kp", 1000)
    refused(
        "out_of_range",
        axis.request,
        "set_parameter",
        parameter=PARAMETERS["kp"].id,
        value=-1,
    )
    refused("unknown_parameter", axis.request, "get_parameter", parameter=250)
    assert axis.get_parameter("kp").counts == before


def test_commands_for_another_axis_and_in_mid_move_are_refused(stage):
    axis = stage.axes["X"]
    refused("no_such_axis", axis.node.request, "status", axis=3)
    refused("no_such_axis", axis.node.axis, 1)
    here = axis.status().position_nm
    axis.request("move", target=axis.to_counts(here + 0.3e6))
    refused("busy", axis.request, "move", target=0)
    refused("busy", axis.request, "home")
    refused("busy", axis.request, "set_parameter", parameter=PARAMETERS["kp"].id, value=1)
    axis.wait(stage.record_while_moving("X"))
    assert abs(stage.true_nm("X") - here - 0.3e6) <= 2 * BOUND_NM


def test_a_node_of_another_build_is_refused(stage, monkeypatch):
    monkeypatch.setattr(records, "MAP_CRC", records.MAP_CRC ^ 1)
    with pytest.raises(WrongBuild, match="register map"):
        Bus(stage.bus.transport, random_source=random.Random(SEED)).node(ADDRESSES["X"])


def test_on_a_bus_with_much_noise_every_command_is_executed_or_reported_as_failed(stage):
    """With spikes on the bus, replies are repeated and no wrong command is executed. A request that
    fails is an exception.
    """
    axis = stage.axes["X"]
    target = axis.status().target_nm
    stage.twin.bus_spikes(200)
    answered = 0
    for _ in range(15):
        try:
            assert axis.status().target_nm == target
            answered += 1
        except (BusGarbled, NoAnswer):
            pass
    stage.twin.bus_spikes(0)
    stage.dwell(0.02)
    assert answered >= 12

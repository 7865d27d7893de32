# SPDX-License-Identifier: Apache-2.0
"""moire.client: the answers of a node in real units and in words, and every refusal with its
values.
"""

import pytest

from moire.client.bus import Bus
from moire.errors import OutOfRange, Refused, UnknownName
from moire.made.bus_tables import CAUSES
from moire.made.registers import MAP_CRC
from tb.fakes.bus_node import BusNode, CannedNode
from tb.fakes.rs485_bus import Rs485Bus
from tb.host.stage import homed_stage, stage
from twin.compiled.axis import Axis
from twin.compiled.tables import FAULT, PERIOD


def test_status_is_in_real_units():
    wire, node, axis = homed_stage()
    axis.move(mm=1)
    node.axes[0].seized = True
    node.axes[0].machine += 4096
    node.set_axis(ENCODER_EVENTS=0b10010)
    status = axis.status()
    assert status.position_nm == pytest.approx(1_000_050) and status.target_nm == 1_000_000
    assert status.counts == 1250 * 160 + 10
    assert status.enabled and status.homed and not status.estop and not status.limit_low
    assert not status.settled  # outside the window of 20 nm
    node.axes[0].seized = False
    assert (status.state, status.words, status.faults, status.encoder_events) == (
        "holding",
        "holding position",
        (),
        ("overspeed", "disagreement"),
    )
    axis.begin_move(mm=10)
    wire.wait(0.3)
    node.set_axis(COMMAND=-16384)
    status = axis.status()
    # at full speed: 1.5 periods of 800 nm in a tick of 0.25 ms
    assert status.velocity_mm_s == pytest.approx(4.8, rel=0.01)
    assert status.drive_command == -0.5 and status.in_motion


def test_the_period_is_read_from_the_node():
    wire = Rs485Bus(BusNode())
    wire.nodes[0].set(period=4_000_000)
    axis = Bus(wire).axis()
    assert axis.period_nm == 4000 and axis.to_nm(65536) == 4000 and axis.to_counts(-6000) == -98304


def test_encoder_counters_and_registers():
    wire, node, axis = stage(axes=[Axis(position=5 * PERIOD - 16384)])
    node.home()
    node.set_axis(QUADRATURE_COUNT=-4, REJECTED_PULSES=1, REJECTED_SAMPLES=2)
    node.axes[0].fault_position = PERIOD
    encoder = axis.encoder()
    assert (encoder.sin, encoder.cos, encoder.amplitude, encoder.quadrature_count) == (
        -100,
        27,
        103,
        -4,
    )
    assert (encoder.rejected_pulses, encoder.rejected_samples) == (1, 2)
    assert (
        encoder.home_phase_nm == -200
        and encoder.home_margin == 0.5
        and encoder.fault_position_nm == 800
    )
    assert (
        axis.node.counters()["frames_good"] == 4
    )  # identify, period, encoder and the request itself
    assert axis.node.read_register(0) == MAP_CRC
    with pytest.raises(Refused, match=r"no register at this address \(address 0x0500\)"):
        axis.node.read_register(0x500)  # axis 1
    for wrong in (2, -4, 65536):
        with pytest.raises(OutOfRange, match="multiples of 4"):
            axis.node.read_register(wrong)


def test_registers_are_read_by_name_and_wide_ones_low_word_first():
    _, node, axis = stage(axes=[Axis(position=-PERIOD, low=-2 * PERIOD)])
    assert axis.node.read_named("axis.position") == {"value": -PERIOD}
    node.ask("enable", axis=0, on=1)
    node.ask("home", axis=0)
    assert axis.node.read_named("axis.control") == {
        "enable": 3,
        "closed_loop": 1,
        "homing": 3,
        "fine": 0,
    }
    with pytest.raises(UnknownName, match="there is no register 'axis.speed', did you mean axis."):
        axis.node.read_named("axis.speed")
    with pytest.raises(OutOfRange, match="bus.transmit can only be written"):
        axis.node.read_named("bus.transmit")


def test_the_drive_is_reported_in_words():
    _, node, axis = homed_stage()
    node.set_actuator(DRIVE=1, STEPS=-7, FINE_COMMAND=-16384 & 0xFFFF)
    drive = axis.drive()
    assert (drive.kind, drive.built, drive.steps, drive.fine_command) == (
        "steps",
        ("bridge", "steps", "dac", "fine"),
        -7,
        -0.5,
    )
    assert drive.override == 1


def test_refusals_carry_the_words_of_the_table_and_the_values():
    wire, node, axis = stage()
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
    axis.begin_move(mm=100)
    with pytest.raises(Refused, match="stop it or wait"):
        axis.prepare(mm=1)
    with pytest.raises(Refused, match=r"stop it or wait \(kp 0.5\)"):
        axis.set_parameter("kp", 0.5)


def test_every_cause_of_the_table_becomes_a_refusal_with_its_words():
    def refused_with(code):
        with pytest.raises(Refused) as caught:
            Bus(Rs485Bus(CannedNode(lambda body: body[:2] + bytes([code])))).request(
                1, "stop", axis=0
            )
        return caught.value

    for code, (name, words) in list(CAUSES.items())[1:]:
        refusal = refused_with(code)
        assert refusal.cause == name and words in str(refusal)
    assert "cause 200" in str(refused_with(200))


def test_hardware_and_firmware_that_do_not_fit_are_refused_in_words():
    wire = Rs485Bus(BusNode(map_crc=MAP_CRC ^ 1))
    wire.nodes[0].map_crc = MAP_CRC  # as in this host, and other than in the firmware
    with pytest.raises(Refused, match="register maps differ"):
        Bus(wire).axis()


def test_a_fault_is_reported_in_words_until_it_is_reset():
    wire, node, axis = homed_stage()
    node.axes[0].causes = FAULT["estop"]
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
    node.axes[0].causes = 0
    axis.reset()
    assert axis.status().faults == ()

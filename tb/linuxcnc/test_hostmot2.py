# SPDX-License-Identifier: Apache-2.0
"""The simulated card with HostMot2: its packets, its registers, its cable; and a short circle that
LinuxCNC runs with its own drivers and its own pid on the machine of the mill.
"""

import struct
from dataclasses import replace
from types import SimpleNamespace

import pytest

from linuxcnc_config import ball_bar, headless, hostmot2
from linuxcnc_config.ball_bar import GAINS, NOT_ANSWERED, PID, STARTS, circle
from linuxcnc_config.hostmot2 import (
    CARD_MAC,
    CLOCK_HZ,
    COUNTER,
    COUNTER_CONTROL,
    ETHERNET,
    IDROM,
    IDROM_AT,
    INCREMENT,
    IO_DATA,
    IO_DIRECTION,
    IP,
    LATCH_ON_INDEX,
    MODULES,
    STAMP_COUNT,
    STAMP_DIVISOR,
    STEP_ACCUMULATOR,
    STEP_RATE,
    TYPE_IP,
    UDP,
    WITH_ADDRESS,
    WRITE,
    Card,
    Hostmot2Machine,
    checksum,
    reply_frame,
)
from linuxcnc_config.twin_machine import MILL
from moire.errors import MoireError
from twin import Machine

WORDS = WITH_ADDRESS | INCREMENT | 2 << 8  # of 32 bits, of the register map
STEPS_S = 2**32 / CLOCK_HZ


def reads(address, count=1):
    return struct.pack("<HH", WORDS | count, address)


def writes(address, *words):
    return struct.pack(f"<HH{len(words)}I", WORDS | WRITE | len(words), address, *words)


def words_of(answer):
    return list(struct.unpack(f"<{len(answer) // 4}I", answer))


@pytest.fixture
def card():
    machine = Machine("stepper_stage", clk_hz=CLOCK_HZ, scale_count=1e-6)
    machine.set_position(20e-3)
    return Card([machine])


def enabled(card):
    """The card, with the driver of its axis enabled."""
    bit = 1 << hostmot2.ENABLE_PIN
    assert card.answer(writes(IO_DATA, bit) + writes(IO_DIRECTION, bit)) == b""
    return card


def test_it_says_what_it_is_as_hostmot2_does(card):
    cookie, *name, at = words_of(card.answer(reads(0x100, 4)))
    assert cookie == 0x55AACAFE and struct.pack("<2I", *name) == b"HOSTMOT2" and at == IDROM
    (modules,) = words_of(card.answer(reads(IDROM + 4)))
    tags = [words_of(card.answer(reads(IDROM + modules + 12 * n)))[0] & 0xFF for n in range(4)]
    assert tags == [3, 4, 5, 0] and modules == MODULES
    assert card.answer(reads(IDROM_AT)) == struct.pack("<I", IDROM)


def test_time_begins_with_the_first_rate_and_passes_at_each_read_of_the_counters(card):
    machine = card.machines[0]
    card.answer(reads(STAMP_COUNT))
    assert machine.now() == 0
    enabled(card).answer(writes(STEP_RATE, round(1000 * STEPS_S)))
    for n in range(1, 4):
        answer = card.answer(reads(STAMP_COUNT) + reads(STEP_ACCUMULATOR))
        stamp, accumulator = words_of(answer)
        assert machine.now() == n * CLOCK_HZ // 1000
        assert stamp == 2000 * n and accumulator == pytest.approx(n << 16, abs=2)
    assert machine.state.steps == 3


def test_the_counter_has_the_time_stamp_of_its_last_change(card):
    enabled(card).answer(writes(STEP_RATE, round(4000 * STEPS_S)) + writes(STAMP_DIVISOR, 8))
    for _ in range(100):
        stamp, counter = words_of(card.answer(reads(STAMP_COUNT) + reads(COUNTER)))
    axis = card.axes[0]
    assert counter & 0xFFFF == axis.count > 100
    assert counter >> 16 == axis.changed_at // 10 & 0xFFFF
    assert (stamp - (counter >> 16)) % (1 << 16) < 1000, "a count each 0.1 ms"


def test_an_index_is_latched_and_disarms(card):
    machine = card.machines[0]
    machine.set(scale_index_position=20.0505e-3, scale_index_width=1e-6)
    enabled(card).answer(writes(STEP_RATE, round(1000 * STEPS_S)))
    card.answer(writes(COUNTER_CONTROL, LATCH_ON_INDEX))
    (control,) = words_of(card.answer(reads(COUNTER_CONTROL)))
    assert control & LATCH_ON_INDEX
    while control & LATCH_ON_INDEX and machine.now() < CLOCK_HZ:
        _, control = words_of(card.answer(reads(STAMP_COUNT) + reads(COUNTER_CONTROL)))
    assert control >> 16 == card.axes[0].latched
    assert card.axes[0].latched + machine.state.scale_counts - card.axes[0].count == 20050


def test_a_command_that_it_does_not_know_is_refused(card):
    with pytest.raises(MoireError, match="does not know the command 0x0201"):
        card.answer(struct.pack("<HH", 0x0201, 0))


def test_a_card_has_pins_for_three_axes():
    with pytest.raises(ValueError, match="4 axes: the card has pins for 3"):
        Card([None] * 4)


def frame_of(data, protocol=17):
    words = [0x45, 0, IP.size + UDP.size + len(data), 7, 0, 64, protocol, 0, b"\1" * 4, b"\2" * 4]
    udp = UDP.pack(1234, 27181, UDP.size + len(data), 0)
    return ETHERNET.pack(CARD_MAC, b"\3" * 6, TYPE_IP) + IP.pack(*words) + udp + data


def test_a_frame_is_answered_to_its_sender():
    frame = reply_frame(frame_of(b"abc"), lambda data: data[::-1])
    target, sender, kind = ETHERNET.unpack_from(frame)
    assert (target, sender, kind) == (b"\3" * 6, CARD_MAC, TYPE_IP)
    header = IP.unpack_from(frame, ETHERNET.size)
    assert header[8:] == (b"\2" * 4, b"\1" * 4)
    assert checksum(frame[ETHERNET.size : ETHERNET.size + IP.size]) == 0
    source, port, length, _ = UDP.unpack_from(frame, ETHERNET.size + IP.size)
    assert (source, port, length) == (27181, 1234, UDP.size + 3) and frame.endswith(b"cba")


@pytest.mark.parametrize(
    "frame", [b"", b"\0" * 60, frame_of(b"abc", protocol=6)], ids=["empty", "zeros", "tcp"]
)
def test_other_frames_are_not_answered(frame):
    assert reply_frame(frame, lambda data: data) == b""


def test_a_packet_without_reads_has_no_answer():
    assert reply_frame(frame_of(b"abc"), lambda data: b"") == b""


@pytest.fixture
def needs_linuxcnc():
    if why := headless.missing():
        pytest.skip(why)


def test_linuxcnc_runs_a_circle_with_its_own_drivers(needs_linuxcnc):
    found = circle(PID, short=True)
    print(ball_bar.line_of(PID, found))
    assert found.deviation < 8e-3 and found.radial_deviation < 8e-3, "mm"


class PaperMachine:
    """In place of a Hostmot2Machine: nothing moves."""

    cable = SimpleNamespace(within=())

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def configuration(self):
        return None

    def hal(self):
        return ""

    def true_path(self):
        return "the path"


@pytest.mark.parametrize("misses, starts", [(0, 1), (1, 2), (STARTS - 1, STARTS), (9, STARTS)])
def test_linuxcnc_starts_again_where_its_driver_had_no_answer_in_time(monkeypatch, misses, starts):
    runs = []

    def run(*_):
        runs.append(None)
        late = len(runs) <= misses
        return headless.Run(late, NOT_ANSWERED if late else "", [] if late else [{"done": True}])

    monkeypatch.setattr(ball_bar, "Hostmot2Machine", PaperMachine)
    monkeypatch.setattr(ball_bar, "run", run)
    if misses < STARTS:
        assert ball_bar.by_pid(GAINS, "", 1) == "the path"
    else:
        with pytest.raises(MoireError, match=f"no answer of the card in {STARTS} starts"):
            ball_bar.by_pid(GAINS, "", 1)
    assert len(runs) == starts


def test_gains_that_do_not_fit_the_machine_are_reported(needs_linuxcnc):
    program = ball_bar.both_ways(ball_bar.SHORT_CENTRE, ball_bar.SHORT_MM, 1.0, ball_bar.FEED)
    with pytest.raises(MoireError, match="lost counts or steps|did not run"):
        ball_bar.by_pid(replace(GAINS, p=400), program.text(), 1)


def test_the_hal_file_has_a_pid_for_each_axis():
    text = Hostmot2Machine(MILL, GAINS).hal()
    for axis in MILL.configuration.axes:
        assert f"setp pid.{axis.name}.Pgain {GAINS.p:g}\n" in text
    assert text.count("control-type 1") == 3

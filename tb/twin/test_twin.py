# SPDX-License-Identifier: Apache-2.0
"""The twin itself: its bus, its faults, its clock, and that the same seed gives the same run."""

import zlib

import numpy
import pytest

from moire.bus.transport import Transport
from twin import Axis, BuildError, FrameBench, Node, Twin, TwinTransport, build, cells_of
from twin.nodes.twin import CLK_HZ

ASK = {1: 0x111, 2: 0x112}  # "slave, send data": 00 01 address, 9th bit 1


def empty_reply(address):
    """The answer of a node before any request: 01 01 address, then sequence 0, operation 0, ok."""
    text = bytes([0x50 | address, 3, 0, 0, 0])
    return [*text, *zlib.crc32(text).to_bytes(4, "little")]


@pytest.fixture
def twin():
    with Twin(seed=1) as made:
        made.run_until_ready()
        yield made


def test_its_transport_does_what_every_transport_of_the_host_package_does(twin):
    """The twin runs without the host package, so its transport inherits nothing."""
    promised = {name for name in dir(Transport) if not name.startswith("_")}
    assert promised <= set(dir(TwinTransport(twin)))


def poll(twin, address=1, **damage):
    twin.send_words([ASK[address]], **damage)
    twin.run_until_words(20, 0.005)
    return twin.receive_words()


def test_both_nodes_answer_and_nobody_collides(twin):
    assert poll(twin, 1) == empty_reply(1) and poll(twin, 2) == empty_reply(2)
    assert twin.bus().collisions == 0 and twin.bus().framing_errors == 0
    assert twin.bus_stays_idle(0.01)


def test_the_transport_returns_as_soon_as_the_words_are_there(twin):
    transport = TwinTransport(twin)
    transport.send([ASK[1]])
    before = transport.now()
    assert transport.receive(9, 1.0) == empty_reply(1)
    assert transport.now() - before > 9 * transport.character_s
    assert (
        transport.now() - twin.bus().last_driven_s < transport.character_s
    )  # not long after the last word
    before = transport.now()
    assert transport.receive(1, 0.003) == []
    assert transport.now() - before == pytest.approx(0.003)
    transport.wait(0.002)
    assert transport.now() - before == pytest.approx(0.005)


def test_words_wait_until_they_are_taken(twin):
    twin.send_words([ASK[1]])
    twin.run(0.005)
    assert twin.bus().words_waiting == 9
    assert twin.receive_words(4) + twin.receive_words() == empty_reply(1)


@pytest.mark.parametrize("error", (-0.03, 0.03))
def test_a_host_with_a_baud_rate_error_is_received(error):
    with Twin(seed=1, nodes=(1,), host_baud_error=error) as twin:
        twin.run_until_ready()
        assert poll(twin) == empty_reply(1)


def test_a_flipped_bit_of_the_command_gives_silence(twin):
    for cell in range(1, 10):
        assert poll(twin, flip_cells=[cell]) == []
        assert poll(twin) == empty_reply(1)


def test_a_flipped_bit_of_the_reply_reaches_the_host_as_such(twin):
    twin.flip_reply_cells([11 * 4 + 1 + 6])  # bit 6 of the fifth word
    expected = empty_reply(1)
    expected[4] ^= 1 << 6
    assert poll(twin) == expected
    before = twin.bus().framing_errors
    twin.flip_reply_cells(
        [10]
    )  # the first stop bit: the port of a PC delivers the word nevertheless
    assert poll(twin) == empty_reply(1) and twin.bus().framing_errors == before + 1
    assert poll(twin) == empty_reply(1)


@pytest.mark.parametrize("level", (True, False))
def test_a_cut_node_is_silent_and_comes_back(twin, level):
    with twin.fault("line_cut", 0, level):
        assert poll(twin, 1) == [] and poll(twin, 2) == empty_reply(2)
    twin.run(0.001)
    assert poll(twin, 1) == empty_reply(1)
    with twin.fault("line_cut", "host", level):
        assert poll(twin, 2) == []
    twin.run(0.001)
    assert poll(twin, 2) == empty_reply(2)


def test_nodes_of_one_address_collide():
    with Twin(seed=1, nodes=(1, 1)) as twin:
        twin.run_until_ready()
        poll(twin)
        assert twin.bus().collisions > 0


def test_levels_and_words_are_the_same_on_the_line(twin):
    twin.send_levels(cells_of([ASK[2]]))
    twin.run_until_words(9, 0.005)
    assert twin.receive_words() == empty_reply(2)
    assert cells_of([ASK[1]]) == [0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1]


def test_after_nonsense_and_spikes_the_nodes_answer_again(twin):
    twin.send_nonsense(300, seed=3)
    twin.run(0.02)
    twin.bus_spikes(5000)
    edges = twin.bus().edges
    twin.run(0.02)
    assert (
        100 < twin.bus().edges - edges < 320
    )  # 100 spikes of two edges, and answers to chance commands
    twin.bus_spikes(0)
    twin.run(0.01)
    twin.receive_words()
    assert poll(twin, 1) == empty_reply(1) and poll(twin, 2) == empty_reply(2)


def record(seed, **arguments):
    with Twin(seed=seed, **arguments) as twin:
        twin.trace(0, 100_000)
        twin.run_until_ready()
        twin.push(0, 30.0)
        words = poll(twin)
        return (
            words,
            twin.take_trace(0)["position_m"].tolist(),
            [twin.truth(n) for n in (0, 1)],
            twin.bus().edges,
        )


def test_the_same_seed_gives_the_same_run():
    first = record(5)
    assert first == record(5)
    assert first != record(6)


def test_the_axes_have_positions_of_their_own(twin):
    positions = [twin.true_position_nm(n) for n in (0, 1)]
    assert positions[0] != positions[1] and all(-0.8e6 <= position <= 2e6 for position in positions)
    with Twin(
        nodes=(1, 2), plant_of={1: {"travel_start_lowest": 0.05, "travel_start_highest": 0.05}}
    ) as other:
        assert (
            other.true_position_nm(1) == pytest.approx(50e6) and other.true_position_nm(0) < 2.1e6
        )


def test_a_trace_holds_what_was_true(twin):
    twin.trace(0, 10_000)
    twin.push(0, 25.0)
    twin.run(0.01)
    trace = twin.take_trace(0)
    assert len(trace["time_s"]) == 100 and numpy.allclose(numpy.diff(trace["time_s"]), 1e-4)
    assert trace["position_m"][-1] == pytest.approx(twin.truth(0).position_m, abs=1e-9)
    assert trace["position_m"][-1] > trace["position_m"][0]
    twin.trace(0, 0)
    twin.run(0.001)
    assert len(twin.take_trace(0)["time_s"]) == 0


def test_each_fault_is_seen_by_the_node(twin):
    from moire.client.bus import Bus

    axis = Bus(TwinTransport(twin)).axis(1)
    assert not axis.status().faults and not axis.status().encoder_events
    for fault in ("estop", "limit_low", "limit_high"):
        with twin.fault(fault):
            twin.run(0.001)
            assert getattr(axis.status(), fault)
        twin.run(0.001)
        assert not getattr(axis.status(), fault)
    with twin.fault("encoder_cut"):
        twin.run(0.001)
        assert twin.truth(0).code_sin in range(125, 132) and axis.status().encoder_events


def test_parameters_are_set_and_read_by_name(twin):
    assert twin.machine(1).get("screw_backlash") == 1e-6
    twin.set_plant(1, screw_backlash=2e-6)
    assert (
        twin.machine(1).get("screw_backlash") == 2e-6
        and twin.machine(0).get("screw_backlash") == 1e-6
    )
    with pytest.raises(KeyError, match="no parameter time_step to change"):
        twin.set_plant(1, time_step=1e-6)


def test_a_node_drives_any_machine():
    from moire.client.bus import Bus

    with Twin(
        [
            Node(1, [Axis("linear_motor", {"travel_start_lowest": 0.5e-3})]),
            Node(2, [Axis("stepper_stage")]),
        ],
        seed=1,
    ) as twin:
        twin.run_until_ready()
        assert (
            0.5e-3 <= twin.truth(0).position_m <= 1e-3 and 5e-3 <= twin.truth(1).position_m <= 20e-3
        )
        bus = Bus(TwinTransport(twin))
        motor, stepper = bus.axis(1), bus.axis(2)
        for position, low, high in (
            (-7.5e-3, True, False),
            (0.0, False, False),
            (7.5e-3, False, True),
        ):
            twin.set_position(0, position)
            twin.run(0.001)
            status = motor.status()
            assert (status.limit_low, status.limit_high) == (low, high)
        assert not stepper.status().limit_low
        with twin.fault("limit_low", 1):
            twin.run(0.001)
            assert stepper.status().limit_low
        twin.trace(1, 1000)
        twin.run(0.01)
        trace = twin.take_trace(1)
        assert set(trace["steps"]) == {0} and len(trace["scale_counts"]) == 10


def test_axes_of_one_node_have_machines_of_their_own():
    nodes = [Node(1, [Axis("stage"), Axis("worm_table")]), Node(2)]
    with Twin(nodes, seed=1, clk_hz=2 * CLK_HZ) as twin:  # a servo tick serves two axes
        twin.run(0.25)  # a second axis takes the firmware longer to start
        assert [machine.kind for machine in twin.machines] == [
            "stage",
            "worm_table",
            "stage",
            "unconnected",
        ]
        assert twin.truth(1).sensor_frames == 25 and twin.truth(3).time_s == twin.time()
        assert poll(twin, 1) == empty_reply(1) and poll(twin, 2) == empty_reply(2)
        twin.push(0, 30.0)
        before = [twin.truth(n).position_m for n in (0, 2)]
        twin.run(0.01)
        after = [twin.truth(n).position_m for n in (0, 2)]
        assert after[0] - before[0] > 1e-7 > abs(after[1] - before[1])


def test_what_does_not_exist_is_refused(twin):
    with pytest.raises(KeyError, match="no fault fire"):
        twin.inject("fire")
    with pytest.raises(IndexError, match="no axis 2"):
        twin.truth(2)
    with pytest.raises(IndexError, match="no node 2"):
        twin.inject("estop", 2)
    with pytest.raises(KeyError, match="no parameter weight"):
        twin.set_plant(0, weight=1)
    with pytest.raises(KeyError, match="there is no machine lathe; there are .*, stage, "):
        Twin([Node(1, [Axis("lathe")])])
    with pytest.raises(KeyError, match="rotary_ring does not fit an axis"):
        Twin([Node(1, [Axis("rotary_ring")])])
    with pytest.raises(KeyError, match="linear_motor has no parameter screw_lead"):
        Twin([Node(1, [Axis("linear_motor", {"screw_lead": 1e-3})])])
    with pytest.raises(BuildError, match="node's memory"):
        Twin(firmware=[0] * 30_000)


def test_a_missing_compiler_is_one_line(monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(
        BuildError, match=r"^g\+\+ is missing, the twin needs it: apt install g\+\+"
    ):
        build.machine_library()


def test_a_firmware_file_is_read_with_its_addresses(tmp_path):
    (tmp_path / "x.hex").write_text("00000001 00000002\n@4 deadbeef\n00000000\n")
    assert build.words_of(tmp_path / "x.hex") == [1, 2, 0, 0, 0xDEADBEEF]


def test_the_frame_bench_gives_the_answers_of_the_twin():
    bench = FrameBench(address=1)
    question = cells_of([ASK[1]])
    assert bench.exchange(question) == empty_reply(1)
    for cell in range(1, 10):
        damaged = question.copy()
        damaged[cell] ^= 1
        assert bench.exchange(damaged) == []
    assert bench.exchange(question) == empty_reply(1)
    before = bench.time()
    bench.idle(100)
    assert bench.time() - before == pytest.approx(100 / 115200, abs=1e-6)

# SPDX-License-Identifier: Apache-2.0
"""The real-time link of a simulated node: set up over the bus by names of registers, process data
beside the running firmware, the watchdog as a fault, and packets over UDP in lockstep.
"""

import random
import socket
import threading

import pytest

from moire.bus.cobs import PacketReader, sealed
from moire.bus.link import Link, Spare
from moire.bus.link_gateway import LONGEST_STUFFED, LinkGateway
from moire.client.bus import Bus
from moire.client.link import ProcessData, places
from moire.errors import OutOfRange, UnknownName
from moire.made.registers import MAP_CRC
from tb.bench import seed
from twin import Axis, Node, Twin, TwinTransport
from twin.nodes.twin import drives

CLK_HZ = 12_000_000
CYCLE_S = 0.001
SESSION = 0x1234
WATCHDOG_S = 0.02
STEPS = {  # of a stage with steppers and a scale
    "position_source": 2,
    "period": "1um",
    "steps_per_period": 4,
    "step_trim": 0,
    "ki": 0,
}
DATA = ProcessData(
    writes=["axis.open_command"], reads=["node.time_stamp", "axis.position", "axis.faults"]
)


class Host:
    """A host at the link of a node."""

    def __init__(self, twin, node, **settings):
        self.line, self.reader = twin.link(), PacketReader(LONGEST_STUFFED)
        settings = {"bit_time": self.line.bit_time, "session": SESSION} | settings
        self.link = DATA.set_up(node, **settings)

    def cycle(self, spare=None):
        """One cycle: the reply, and {(register, axis): raw count} of its values."""
        request = self.link.request(0, [0] * self.link.writes, spare)
        (packet,) = self.reader.feed(self.line.exchange(sealed(request), CYCLE_S))
        reply = self.link.reply(packet)
        return reply, DATA.counts(reply)


@pytest.fixture(scope="module")
def machine():
    with Twin(
        [Node(1, [Axis("stepper_stage")] * 2)],
        seed=seed() % 1000,
        clk_hz=CLK_HZ,
        node_parameters={**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0, "HAS_LINK": 1},
    ) as twin:
        bus = Bus(TwinTransport(twin), random_source=random.Random(seed()))
        twin.run_until_ready()
        yield twin, bus


@pytest.fixture
def node(machine):
    twin, bus = machine
    node = bus.node(1)
    yield node
    DATA.switch_off(node)


def test_process_data_come_in_each_cycle_while_the_firmware_works(machine, node):
    twin, _ = machine
    host = Host(twin, node, watchdog_s=0)
    assert node.read_named("link.state")["session"] == SESSION
    before, _ = host.cycle()
    for _ in range(30):
        reply, counts = host.cycle(Spare(0))
        assert reply.spare == MAP_CRC and not any(reply.refused.values())
        assert 0 < counts["node.time_stamp", 0] - reply.time < 500
        assert (reply.time - before.time) % 2**32 == pytest.approx(CYCLE_S * CLK_HZ, abs=2000)
        before = reply
    for axis in range(2):
        position = node.read_named("axis.position", axis)["value"] % 2**64
        assert counts["axis.position", axis] == position


def test_a_host_that_falls_silent_switches_the_drives_off_with_the_cause(machine, node):
    twin, bus = machine
    axis = bus.axis(1)
    for name, value in STEPS.items():
        axis.set_parameter(name, value)
    host = Host(twin, node, watchdog_s=WATCHDOG_S)
    host.cycle()
    axis.enable()
    assert axis.status().enabled
    twin.run(2 * WATCHDOG_S)
    status = axis.status()
    assert not status.enabled and status.first_fault == ("link_watchdog",)
    DATA.switch_off(node)
    axis.reset()
    assert not axis.status().faults


def test_a_driver_over_udp_runs_in_lockstep(machine, node):
    twin, _ = machine
    link = DATA.set_up(node, bit_time=twin.link().bit_time, watchdog_s=0)
    with LinkGateway(twin.link(), CYCLE_S) as gateway:
        server = threading.Thread(target=gateway.serve)
        server.start()
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as driver:
                driver.settimeout(60)
                driver.connect(gateway.address)
                begin = twin.time()
                for _ in range(5):
                    driver.send(link.request(0, [0] * link.writes))
                    assert link.reply(driver.recv(2048))
        finally:
            gateway.stop()
            server.join()
        assert twin.time() - begin == pytest.approx(5 * CYCLE_S, abs=1e-6)
        assert not gateway.serve_one(0), "nobody asks"


def test_wrong_set_ups_are_refused_before_anything_is_sent(node):
    with pytest.raises(UnknownName, match="axis.nothing"):
        ProcessData(["axis.nothing"], []).set_up(node)
    with pytest.raises(OutOfRange, match="122 words"):
        ProcessData([], ["axis.faults"] * 61).set_up(node)
    with pytest.raises(OutOfRange, match="time window"):
        DATA.set_up(node, time_window=1 << 24)
    assert node.read_named("link.state")["on"] == 0


def test_the_words_of_a_list_have_the_order_of_their_names():
    found = places(["node.time_stamp", "axis.position", "axis.faults"], axes=2)
    assert [(p.address, p.axis, p.high) for p in found] == [
        *((0x010, 0, False), (0x014, 0, True)),
        *((0x428, 0, False), (0x42C, 0, True), (0x528, 1, False), (0x52C, 1, True)),
        *((0x40C, 0, False), (0x50C, 1, False)),
    ]
    assert Link(SESSION, 0, len(found)).reads == 8

# SPDX-License-Identifier: Apache-2.0
"""The real-time link of a simulated node: set up over the bus by names of registers, process data
beside the running firmware, the watchdog as a fault, captures on an even grid while the requests
jitter, and packets over UDP in lockstep.
"""

import itertools
import random
import re
import socket
import threading
from unittest.mock import Mock

import pytest

from moire.bus.cobs import PacketReader, sealed
from moire.bus.link import Link, Spare
from moire.bus.link_gateway import LONGEST_STUFFED, LinkGateway
from moire.client.bus import Bus
from moire.client.link import Captures, ProcessData, places
from moire.errors import OutOfRange, Refused, UnknownName
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
LINK = {"HAS_LINK": 1, "LINK_PLL": 1}
DATA = ProcessData(
    writes=["axis.open_command"], reads=["node.time_stamp", "axis.position", "axis.faults"]
)


class Host:
    """A host at the link of a node."""

    def __init__(self, twin, node, data=DATA, **settings):
        self.line, self.reader = twin.link(), PacketReader(LONGEST_STUFFED)
        self.data = data
        settings = {"bit_time": self.line.bit_time, "session": SESSION} | settings
        self.link = data.set_up(node, **settings)

    def cycle(self, spare=None):
        """One cycle: the reply, and {(register, axis): raw count} of its values."""
        request = self.link.request(0, [0] * self.link.writes, spare)
        (packet,) = self.reader.feed(self.line.exchange(sealed(request), CYCLE_S))
        reply = self.link.reply(packet)
        return reply, self.data.counts(reply)


@pytest.fixture(scope="module")
def machine():
    with Twin(
        [Node(1, [Axis("stepper_stage")] * 2)],
        seed=seed() % 1000,
        clk_hz=CLK_HZ,
        node_parameters={**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0, **LINK},
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


def jittering(host, dice, cycles):
    """Cycles of which each request comes up to 20 % of a cycle early or late: for each the time of
    the reply, that of the reading of its values, whether it was a capture, and its phase error.
    """
    found, shift = [], 0.0
    for _ in range(cycles):
        before, shift = shift, dice.uniform(-0.2, 0.2) * CYCLE_S
        request = host.link.request(0, [0] * host.link.writes)
        data = host.line.exchange(sealed(request), CYCLE_S + shift - before)
        (packet,) = host.reader.feed(data)
        reply = host.link.reply(packet)
        counts = host.data.counts(reply)
        state = counts["link.pll_state", 0]
        found.append((reply.time, counts["link.read_time", 0], state >> 2 & 1, state >> 8))
    return found


def test_captures_are_on_an_even_grid_while_the_requests_jitter(machine, node):
    twin, _ = machine
    lead, period = 0.35e-3, round(CYCLE_S * CLK_HZ)
    data = ProcessData(DATA.writes, ["axis.position", "link.read_time", "link.pll_state"])
    host = Host(twin, node, data, watchdog_s=0, captures=Captures(CYCLE_S, lead))
    found = jittering(host, random.Random(seed()), 500)
    assert not any(captured for *_, captured, _ in found[:60])
    last = found[-250:]
    assert all(captured for *_, captured, _ in last)
    spread = lambda times: max(t % period for t in times) - min(t % period for t in times)
    begun = last[0][1] - period // 2  # no time wraps around
    requests, captures = ([row[n] - begun for row in last] for n in (0, 1))
    assert spread(requests) > 0.3 * period and spread(captures) < 0.05 * period
    assert all(b - a in range(period - 99, period + 99) for a, b in itertools.pairwise(captures))
    ages = [request - capture for request, capture in zip(requests, captures, strict=True)]
    assert sum(ages) / len(ages) == pytest.approx(lead * CLK_HZ, rel=0.1)
    assert node.read_named("link.pll_state")["locked"]
    twin.run(20 * CYCLE_S)
    assert not node.read_named("link.pll_state")["locked"], "the requests are missing"
    time, read, captured, _ = jittering(host, random.Random(1), 1)[0]
    assert not captured and 0 < read - time < 100


def test_captures_that_are_not_possible_are_refused_before_anything_is_sent(node):
    for captures, words in (
        (Captures(0.2e-3, 0), "the period of requests is 0.2 ms: a PLL follows 0.25 to 10 ms"),
        (Captures(1e-3, 0.4e-3), "the captures lead by 400 us: choose from 0 to 375 us"),
        (Captures(1e-3, -1e-6), "the captures lead by -1 us"),
    ):
        with pytest.raises(OutOfRange, match=re.escape(words)):
            DATA.set_up(node, captures=captures)
    with pytest.raises(OutOfRange, match="600 cycles of the node: a PLL follows 2048"):
        Captures(0.25e-3, 0).cycles(2_400_000)
    without = Mock(wraps=node, address=1)
    without.read_named = lambda name: {"value": CLK_HZ, "built": 0, "axes": 2}
    with pytest.raises(Refused, match=r"it needs LINK_PLL of rtl/node\.sv") as found:
        DATA.set_up(without, captures=Captures(1e-3, 0))
    assert found.value.cause == "not_built"
    assert not without.write_named.called and node.read_named("link.state")["on"] == 0


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

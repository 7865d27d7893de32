# SPDX-License-Identifier: Apache-2.0
"""The wires of the real-time link in a node: its settings, its line, its accesses to the register
bus beside those of the soft core, its state, and its watchdog.
"""

from moire.bus.cobs import sealed, unstuff
from moire.bus.link import Link, Spare
from moire.made.registers import FIELDS, MAP_CRC
from tb.wiring.node import BIT
from tb.wiring.test_interlock_wiring import both_on, judge

SESSION = 0xC0FFEE
MS = 6200  # cycles


def address(register, axis=0):
    block, name = register.split(".")
    return next(f for f in FIELDS if (f.block, f.register) == (block, name)).address(axis)


WRITES = [address("axis.open_command", axis) for axis in (0, 1)]
READS = [
    address("node.time_stamp"),
    address("node.time_stamp") + 4,
    address("axis.open_command", 1),
    address("axis.open_command", 0),
]


def set_up(node, **settings):
    node.write("link.bit_time", 16 * BIT)
    for n in range(len(READS)):
        node.write("link.entry_number", n)
        node.write("link.entry", write=WRITES[n % 2], read=READS[n])
    node.write("link.entry_number", 0)  # an entry is stored by its own write alone
    node.write("link.session", SESSION)
    node.write("link.lists", writes=len(WRITES), reads=len(READS))
    for name, value in settings.items():
        node.write(f"link.{name}", value)
    node.write("link.enable", 1)
    return Link(SESSION, len(WRITES), len(READS))


def exchange(node, packet, bit=BIT):
    """Sends a packet; returns the bytes of the reply, and the changes of the driver enable."""
    node.watch("link_tx", "link_driver_enable")
    for byte in sealed(packet):
        node.character("link_rx", byte, bit=bit)
    node.run(600 * bit)
    changes = node.changes()
    enable = [c for c in changes if c.pin == "link_driver_enable"]
    heard = bytes(node.characters("link_tx", changes, bit=bit))
    if enable:
        tx = [c.cycle for c in changes if c.pin == "link_tx"]
        assert enable[0].cycle < tx[0] and enable[-1].cycle > tx[-1]
    return unstuff(heard[1:-1]) if heard else None, [c.value for c in enable]


def test_a_request_on_the_line_writes_and_reads_the_registers(node):
    host = set_up(node)
    assert node.levels("link_tx", "link_driver_enable") == (1, 0)
    for values in ([0x0123, 0x4567], [0x7FFF, 0x0001]):
        content, enable = exchange(node, host.request(0, values, Spare(0)))
        assert enable == [1, 0]
        reply = host.reply(content)
        assert reply.spare == MAP_CRC and not any(reply.refused.values())
        low, high, second, first = reply.values
        assert [first, second] == values and high == 0 and 0 < low - reply.time < 100
        assert [node.read("axis.open_command", axis=axis) for axis in (0, 1)] == values
    state = dict(built=1, on=1, busy=0, expired=0, session=SESSION)
    assert node.fields("link.state") == state


def test_a_bit_of_the_line_may_have_four_cycles(node):
    bit = 4
    host = set_up(node, bit_time=16 * bit)
    content, enable = exchange(node, host.request(0, [7, 0x5555]), bit)
    assert enable == [1, 0]
    assert host.reply(content).values[2:] == (0x5555, 7)


def test_the_state_shows_a_request_that_is_being_answered(node):
    set_up(node)
    reads = 120
    node.write("link.enable", 0)
    node.write("link.lists", writes=0, reads=reads)
    node.write("link.enable", 1)
    assert node.read("link.state", "busy") == 0
    for byte in sealed(Link(SESSION, 0, reads).request(0, [])):
        node.character("link_rx", byte)
    assert node.read("link.state", "busy") == 1
    node.run(600 * BIT)
    assert node.read("link.state", "busy") == 0


def test_a_reset_in_the_middle_of_a_character_on_the_line_drops_it(node):
    """What begins with the reset has a stop bit, what began before it would have none."""
    bit = 20  # cycles, the setting after a reset
    node.set(link_rx=0)
    node.run(5 * bit)
    node.set(rst=1)
    node.run(8)
    node.set(rst=0)
    node.run(6 * bit)
    node.set(link_rx=1)
    node.run(20 * bit)
    assert node.read("link.framing_errors") == 0


def test_what_is_refused_is_counted_by_its_cause(node):
    host = set_up(node, time_window=1000)
    zero = dict(damaged=0, foreign=0, wrong_length=0, replayed=0)
    assert node.fields("link.refused") == zero
    now = node.read("node.time_stamp") & 0xFFFF_FFFF
    late = host.request(now - 100_000, [1, 2])
    foreign = Link(SESSION ^ 0x800000, 2, 4).request(0, [1, 2])
    longer = Link(SESSION, 3, 4).request(0, [1, 2, 3])
    old = Link(SESSION, 2, 4)
    old.sequence = 2**31
    for packet, cause in (
        (late[:-1] + bytes([late[-1] ^ 1]), "damaged"),
        (foreign, "foreign"),
        (longer, "wrong_length"),
        (old.request(0, [1, 2]), "replayed"),
    ):
        assert exchange(node, packet) == (None, [])
        assert node.fields("link.refused") == zero | {cause: 1}
        zero[cause] = 1
    assert exchange(node, late) == (None, [])
    assert node.fields("link.refused_now") == dict(out_of_time=1, busy=0)
    assert node.read("link.framing_errors") == 0
    node.character("link_rx", 0, stop=0)
    assert node.read("link.framing_errors") == 1
    assert not any(node.read("axis.open_command", axis=axis) for axis in (0, 1))


def test_a_request_with_a_byte_without_its_stop_bit_is_damaged(node):
    """The byte is one too many, so that the request is whole without it."""
    host = set_up(node)
    whole = sealed(host.request(0, [1, 2]))
    for n, byte in enumerate(whole):
        if n == len(whole) // 2:
            node.character("link_rx", 0x55, stop=0)
            node.run(2 * BIT)
        node.character("link_rx", byte)
    node.run(600 * BIT)
    assert node.read("link.refused", "damaged") == 1
    assert not any(node.read("axis.open_command", axis=axis) for axis in (0, 1))


def test_the_line_counts_as_idle_during_a_reset(node):
    """A level that is low then and afterwards is a start bit, and here its stop bit is missing."""
    node.reset_with_low("link_rx")
    assert node.read("link.framing_errors") == 1


def test_a_silent_host_stops_all_axes(node):
    both_on(node)
    host = set_up(node, watchdog_time=30)
    for _ in range(2):
        assert host.reply(exchange(node, host.request(0, [0, 0]))[0])
        assert node.get("drive_enable") == 3
    node.run(31 * MS)
    assert node.read("link.state", "expired") == 1
    judge(node, 0, "link_watchdog", both=True)
    node.write("link.enable", 0)
    assert node.read("link.state", "on") == 0 and node.read("link.state", "expired") == 0


def test_the_pll_follows_the_requests_and_captures_before_them(node):
    assert node.fields("link.pll_state") == dict(built=1, locked=0, captured=0, phase_error=0)
    period, lead, late = 20_000, 2_000, 100
    host = set_up(node, pll_period=period, capture_lead=lead)
    begun = node.now
    for n in range(67):
        node.run(begun + n * period - node.now + (late if n == 66 else 0))
        reply = host.reply(exchange(node, host.request(0, [0, 0]))[0])
        locked = int(n > 63)
        assert node.read("link.pll_state", "locked") == locked
        low, high, *_ = reply.values  # node.time_stamp
        assert (low - reply.time > 0) == (not locked) and high == 0
    assert abs(node.read("link.pll_state", "phase_error") - late) <= 2
    assert abs(reply.time - low - lead - late) < 60
    assert abs(node.read("link.read_time") - low) < 10

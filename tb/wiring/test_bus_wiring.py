# SPDX-License-Identifier: Apache-2.0
"""The wires of the bus port in a node: characters and frames both ways, CRC, counters,
time-outs.
"""

import zlib

from moire.bus.protocol import FROM_NODE, NINTH, TO_NODE, command_byte, frame
from tb.wiring.node import BIT, CLK_HZ

FREE = 128


def bus(node):
    node.write("bus.bit_time", BIT * 16)
    node.write("bus.watchdog_time", 0)
    node.run(200)
    return node


def received(node):
    """All words in the queue, as (data, command, good)."""
    words = []
    for _ in range(2 * FREE):
        if not (word := node.fields("bus.receive"))["present"]:
            return words
        words.append((word["data"], word["command"], word["good"]))
    raise AssertionError("the queue does not become empty")


def test_a_frame_for_this_node_is_received_and_checked(node):
    bus(node)
    body = bytes([0x12, 0xA5])
    node.send_frame(body)
    first = command_byte(5, TO_NODE)
    data = frame(first, body)
    expected = [(first, 1, 0), *((byte, 0, 0) for byte in data[:-1]), (data[-1], 0, 1)]
    assert received(node) == expected
    assert node.read("bus.frames_good") == 1 and node.read("bus.frames_bad") == 0
    node.send_frame(body, spoil=4)
    assert received(node)[-1] == (data[-1] ^ 4, 0, 0)
    assert node.read("bus.frames_good") == 1 and node.read("bus.frames_bad") == 1
    node.write("bus.frames_good", 0)
    assert node.read("bus.frames_good") == 0


def test_a_frame_with_a_character_without_its_stop_bit_is_bad(node):
    """The character is one too many, so that the frame is whole without it."""
    bus(node)
    first = command_byte(5, TO_NODE)
    words = [first | NINTH, *frame(first, bytes([0x12, 0xA5]))]
    node.send_words(words[:3])
    node.character("rs485_rx", 0x55, 0, stop=0)
    node.send_words(words[3:])
    assert node.read("bus.frames_good") == 0 and node.read("bus.frames_bad") == 1


def test_a_frame_for_another_node_does_not_pass(node):
    bus(node)
    node.send_frame(address=4)
    node.send_words([command_byte(4, FROM_NODE) | NINTH])
    assert received(node) == []
    node.set(address=4)
    node.send_words([command_byte(4, FROM_NODE) | NINTH])
    assert received(node) == [(command_byte(4, FROM_NODE), 1, 0)]


def cycles_of_a_read(node):
    """How long the soft core takes to read a register."""
    begun = node.now
    node.read("node.tick_period")
    return node.now - begun


def test_the_soft_core_waits_for_a_time_or_until_a_word_is_received(node):
    first = cycles_of_a_read(node)  # the registers take their values before
    bus(node)
    usual = cycles_of_a_read(node)
    for cycles in (1000, 2000):
        node.write("node.wait_time", cycles)
        assert abs(cycles_of_a_read(node) - cycles) < 4 * usual
        assert cycles_of_a_read(node) < 2 * usual
    node.write("node.wait_time", 3900)
    node.send_frame()
    assert cycles_of_a_read(node) < 2 * usual, "it is awake"
    node.write("node.wait_time", 3900)
    assert cycles_of_a_read(node) < 2 * usual, "there is a word still"
    received(node)
    node.write("node.wait_time", 3900)
    node.reset()
    assert abs(cycles_of_a_read(node) - first) < usual, "a reset ends the wait"


def test_words_are_sent_with_their_ninth_bit_and_the_driver_on(node):
    bus(node)
    assert node.levels("rs485_tx", "rs485_driver_enable") == (1, 0)
    assert node.fields("bus.state") == {"transmit_free": FREE, "sending": 0}
    node.watch("rs485_tx", "rs485_driver_enable")
    node.write("bus.transmit", data=0xA5, command=1)
    node.write("bus.transmit", data=0x3C, command=0)
    assert node.read("bus.state", "sending") == 1
    node.write("bus.transmit", data=0x71, command=0)
    node.write("bus.transmit", data=0x72, command=0)
    assert node.read("bus.state", "transmit_free") < FREE
    assert node.reaches("rs485_driver_enable", 0, 100 * BIT)
    node.run(2 * BIT)
    changes = node.changes()
    words = node.characters("rs485_tx", changes, bits=11)
    assert words == [0x1A5, 0x3C, 0x71, 0x72]
    enable = [c for c in changes if c.pin == "rs485_driver_enable"]
    assert [c.value for c in enable] == [1, 0]
    tx = [c.cycle for c in changes if c.pin == "rs485_tx"]
    assert enable[0].cycle < tx[0] and enable[1].cycle > tx[-1]
    assert node.fields("bus.state") == {"transmit_free": FREE, "sending": 0}


def test_the_node_does_not_hear_what_it_sends(node):
    bus(node)
    first = command_byte(5, FROM_NODE)
    node.write("bus.transmit", data=first, command=1)
    for _ in range(40):
        node.set(rs485_rx=node.get("rs485_tx"))
        node.run(BIT // 2)
    node.set(rs485_rx=1)
    node.run(4 * BIT)
    assert received(node) == []


def test_the_crc_is_that_of_the_bytes(node):
    bus(node)
    for content in (b"123456789", b"\x00\xff"):
        node.write("bus.crc_start", start=1)
        for byte in content:
            node.write("bus.crc_byte", byte)
        assert node.read("bus.crc") == zlib.crc32(content)


def test_what_goes_wrong_on_the_bus_is_counted(node):
    bus(node)
    counters = ("framing_errors", "start_glitches", "breaks", "overruns", "transmit_timeouts")

    def counts():
        return {name: node.read(f"bus.{name}") for name in counters}

    node.run(CLK_HZ // 1000 * 21 // 10)
    assert counts() == dict.fromkeys(counters, 0)
    node.character("rs485_rx", 0x55, 0, stop=0)
    node.run(20 * BIT)
    assert counts() == dict.fromkeys(counters, 0) | {"framing_errors": 1}
    node.set(rs485_rx=0)
    node.run(3)
    node.set(rs485_rx=1)
    node.run(20 * BIT)
    assert counts() == dict.fromkeys(counters, 0) | {"framing_errors": 1, "start_glitches": 1}
    node.set(rs485_rx=0)
    node.run(CLK_HZ // 1000 * 21 // 10)
    node.set(rs485_rx=1)
    node.run(20 * BIT)
    assert node.read("bus.breaks") == 1
    assert node.read("bus.overruns") == 0


def test_a_full_queue_drops_words_and_counts_them(node):
    bus(node)

    def word(data, ninth):
        node.character("rs485_rx", data, ninth)

    for _ in range(64):
        word(command_byte(5, FROM_NODE), 1)
        word(command_byte(5, FROM_NODE), 1)
    node.run(40)
    assert node.read("bus.overruns") == 0
    word(command_byte(5, FROM_NODE), 1)
    node.run(40)
    assert node.read("bus.overruns") == 1
    assert len(received(node)) == FREE


def test_the_bit_time_is_a_setting_for_both_directions(node):
    bus(node)
    node.write("bus.bit_time", 40 * 16)
    node.watch("rs485_tx")
    node.write("bus.transmit", data=0x55, command=0)
    node.run(40 * 14)
    edges = [c.cycle for c in node.changes()]
    assert {b - a for a, b in zip(edges, edges[1:-1])} == {40}
    node.run(80)
    for level in (0, 1, 0, 1, 0, 0, 0, 0, 0, 1, 1):  # 0x05 with its ninth bit: no command
        node.set(rs485_rx=level)
        node.run(40)
    for level in (0, *(command_byte(5, FROM_NODE) >> n & 1 for n in range(8)), 1, 1):
        node.set(rs485_rx=level)
        node.run(40)
    node.run(80)
    assert received(node) == [(command_byte(5, FROM_NODE), 1, 0)]


def test_a_driver_that_stays_on_is_cut_off(node):
    bus(node)
    bit = 24  # cycles: its eighth is no power of two
    node.write("bus.bit_time", bit * 16)
    node.watch("rs485_driver_enable")
    for _ in range(120):
        node.write("bus.transmit", data=0, command=0)
    node.run(1100 * bit)
    assert node.read("bus.transmit_timeouts") == 1
    on, off = [c.cycle for c in node.changes()][:2]
    assert abs(off - on - 1024 * bit) < 20


def test_the_watchdog_of_the_bus_has_its_time_and_needs_a_drive(node):
    node.start()
    node.write("bus.bit_time", BIT * 16)
    node.write("bus.watchdog_time", 2)
    node.run(5 * CLK_HZ // 1000)
    node.enable(1)
    node.run(CLK_HZ // 1000)
    assert node.get("drive_enable") == 2
    node.run(CLK_HZ // 1000 * 3 // 2)
    assert node.get("drive_enable") == 0


def test_a_sync_pulse_is_counted_and_needs_a_good_frame(node):
    bus(node)
    node.send_sync()
    node.send_frame()
    assert node.read("bus.syncs") == 1
    assert node.read("bus.frames_good") == 2


def test_a_reset_empties_the_port_and_ends_what_is_under_way(node):
    bus(node)
    node.write("bus.crc_start", start=1)
    node.write("bus.crc_byte", 0x31)
    node.send_words([command_byte(5, FROM_NODE) | NINTH])
    node.send_words([command_byte(5, TO_NODE) | NINTH, 3, 1])  # the beginning of a frame
    for _ in range(3):
        node.write("bus.transmit", data=0, command=0)
    assert node.get("rs485_driver_enable") == 1
    node.set(rst=1)
    node.run(8)
    assert node.levels("rs485_tx", "rs485_driver_enable") == (1, 0)
    node.set(rst=0)
    node.watch("rs485_tx", "rs485_driver_enable")
    node.run(100 * BIT)
    assert not node.changes()
    assert received(bus(node)) == []
    assert node.fields("bus.state") == {"transmit_free": FREE, "sending": 0}
    assert node.read("bus.crc") == 0
    node.send_frame()
    assert node.read("bus.frames_good") == 1 and node.read("bus.frames_bad") == 0


def test_a_reset_in_the_middle_of_a_character_drops_it(node):
    bit = 35  # cycles, the setting after a reset
    command = command_byte(5, FROM_NODE)
    levels = [0, *(command >> n & 1 for n in range(8)), 1, 1]
    for n, level in enumerate(levels):
        node.set(rs485_rx=level)
        if n == 5:
            node.set(rst=1)
            node.run(8)
            node.set(rst=0)
        node.run(bit - 8 * (n == 5))
    node.run(20 * bit)
    assert received(node) == []
    node.character("rs485_rx", command, 1, bit=bit)
    node.run(20 * bit)
    assert received(node) == [(command, 1, 0)]


def test_the_line_of_the_bus_counts_as_idle_during_a_reset(node):
    """A level that is low then and afterwards is a start bit, and here its stop bit is missing."""
    node.reset_with_low("rs485_rx")
    assert node.read("bus.framing_errors") == 1

# SPDX-License-Identifier: Apache-2.0
"""The panel of S4: EEPROM, key-pad and character display on one I2C bus, numeric display; driven by
an I2C master that sets the pins.
"""

import random
import re

import pytest

from tools import sigrok
from twin import Devices, DevicesBench

CLK_HZ, BUS_HZ = 2_000_000, 100_000
EEPROM, KEYPAD, DISPLAY = 0x50, 0x34, 0x27
PANEL = Devices(eeprom=True, keypad=True, display=True)


class Master:
    """An I2C master on pins, in units of a quarter bit. `recorded` has the levels of scl and sda in
    each quarter.
    """

    def __init__(self, bench):
        self.bench, self.quarter, self.recorded = bench, bench.clk_hz // BUS_HZ // 4, None

    def set(self, **low):
        self.bench.pins(**{f"i2c_{name}_low": level for name, level in low.items()})
        self.bench.run_clk(self.quarter)
        if self.recorded is not None:
            self.recorded.append(self.bench.level("i2c_scl") | self.bench.level("i2c_sda") << 1)

    def start(self):
        self.set(sda=0)
        self.set(scl=0)
        self.set(sda=1)
        self.set(scl=1)

    def stop(self):
        self.set(sda=1)
        self.set(scl=0)
        self.set(sda=0)

    def bit(self, level):
        self.set(sda=not level)
        self.set(scl=0)
        seen = self.bench.level("i2c_sda")
        self.set()
        self.set(scl=1)
        return seen

    def write(self, byte):
        """True if it was acknowledged."""
        for n in range(8):
            self.bit(byte >> 7 - n & 1)
        return not self.bit(1)

    def read(self, more):
        byte = 0
        for _ in range(8):
            byte = byte << 1 | self.bit(1)
        self.bit(not more)
        return byte

    def send(self, address, data=()):
        """A complete write; returns False at the first byte that is not acknowledged."""
        self.start()
        good = all(self.write(byte) for byte in (address << 1, *data))
        self.stop()
        return good

    def fetch(self, address, count, at=()):
        """Read bytes from the device after a write of `at`; None if no device answers."""
        self.start()
        if at:
            if not all(self.write(byte) for byte in (address << 1, *at)):
                self.stop()
                return None
            self.start()
        if not self.write(address << 1 | 1):
            self.stop()
            return None
        data = [self.read(n + 1 < count) for n in range(count)]
        self.stop()
        return data


@pytest.fixture
def panel():
    return DevicesBench(PANEL, clk_hz=CLK_HZ)


@pytest.fixture
def master(panel):
    return Master(panel)


def address_bytes(address):
    return [address >> 8, address & 0xFF]


# EEPROM


def test_what_is_written_is_read_after_the_write_time(panel, master):
    data = [random.randrange(256) for _ in range(64)]
    assert master.send(EEPROM, [*address_bytes(0x1240), *data])
    assert not master.send(EEPROM)  # busy
    panel.run(4.5e-3)
    assert not master.send(EEPROM)
    panel.run(0.5e-3)
    assert master.fetch(EEPROM, 64, address_bytes(0x1240)) == data
    assert panel.eeprom[0x1240:0x1280] == bytes(data) and panel.state.eeprom_writes == 1


def test_a_write_rolls_over_in_its_page(panel, master):
    assert master.send(EEPROM, [*address_bytes(0x007E), 1, 2, 3, 4])
    panel.run(5e-3)
    assert panel.eeprom[0x40:0x42] == bytes([3, 4]) and panel.eeprom[0x7E:0x82] == bytes(
        [1, 2, 0xFF, 0xFF]
    )
    assert master.send(EEPROM, [*address_bytes(0x0000), *range(70)])  # the last 6 over the first
    panel.run(5e-3)
    assert panel.eeprom[:0x40] == bytes([64, 65, 66, 67, 68, 69, *range(6, 64)])


def test_reading_goes_on_over_pages_and_the_end(panel, master):
    panel.write_eeprom(0x3FFE, [5, 6])
    panel.write_eeprom(0, [7, 8])
    assert master.fetch(EEPROM, 4, address_bytes(0x3FFE)) == [5, 6, 7, 8]
    assert master.fetch(EEPROM, 1) == [0xFF]  # from the address pointer
    assert master.fetch(EEPROM, 2, address_bytes(0xC000)) == [
        7,
        8,
    ]  # the two highest bits do not matter


def test_without_a_stop_after_a_whole_byte_nothing_is_written(panel, master):
    master.start()
    for byte in (EEPROM << 1, 0, 0, 0x55):
        assert master.write(byte)
    assert master.fetch(EEPROM, 1, address_bytes(0)) == [0xFF]  # a start instead of a stop
    master.start()
    for byte in (EEPROM << 1, 0, 0, 0x55):
        assert master.write(byte)
    for level in (0, 1, 0):
        master.bit(level)
    master.stop()  # in the middle of a byte
    assert panel.state.eeprom_writes == 0 and panel.eeprom == b"\xff" * 16384
    assert (
        master.send(EEPROM, address_bytes(5)) and panel.state.eeprom_writes == 0
    )  # only the address


def test_a_power_cut_while_it_writes_tears_the_page_and_no_other(panel, master):
    old, new = bytes([0x11] * 64), bytes([0x22] * 32)
    counts = {"old": 0, "new": 0, "neither": 0}
    for _ in range(20):
        panel.write_eeprom(0x80, old)
        assert master.send(EEPROM, [*address_bytes(0x80), *new])
        panel.run(random.uniform(0.1e-3, 4.9e-3))
        panel.power_cut()
        panel.run(1e-3)
        panel.power_on()
        assert panel.eeprom[:0x80] == b"\xff" * 0x80 and panel.eeprom[0xC0:] == b"\xff" * (
            16384 - 0xC0
        )
        for byte, was, expected in zip(panel.eeprom[0x80:0xC0], old, new + old[32:]):
            counts["old" if byte == was else "new" if byte == expected else "neither"] += 1
        assert master.fetch(EEPROM, 64, address_bytes(0x80)) == list(
            panel.eeprom[0x80:0xC0]
        )  # the write time is over, so the contents are safe
    assert panel.state.eeprom_torn == 20 and min(counts.values()) > 150, counts


def test_a_power_cut_at_rest_changes_nothing(panel, master):
    assert master.send(EEPROM, [*address_bytes(0x100), 1, 2, 3])
    panel.run(5e-3)
    before = panel.eeprom
    panel.power_cut()
    panel.power_on()
    assert panel.eeprom == before and panel.state.eeprom_torn == 0


# key-pad

CFG, INT_STAT, COUNT, EVENT, ROWS, COLUMNS = 0x01, 0x02, 0x03, 0x04, 0x1D, 0x1E


def set_up(master, cfg=0x01):
    for register, value in ((ROWS, 0x1F), (COLUMNS, 0x7F), (CFG, cfg)):
        assert master.send(KEYPAD, [register, value])


def read(master, register):
    return master.fetch(KEYPAD, 1, [register])[0]


def test_every_key_has_its_event(panel, master):
    set_up(master)
    for key in range(34):
        panel.press(key)
        panel.release(key)
        code = 10 * (key // 7) + key % 7 + 1
        assert read(master, COUNT) == 2
        assert [read(master, EVENT), read(master, EVENT), read(master, EVENT)] == [
            0x80 | code,
            code,
            0,
        ]


def test_events_wait_in_order_and_the_flag_stays_until_all_are_read(panel, master):
    set_up(master)
    panel.press(0), panel.press(15), panel.release(0)
    panel.press(15)  # the key is already down: no event
    assert read(master, INT_STAT) == 1 and read(master, COUNT) == 3
    assert master.send(KEYPAD, [INT_STAT, 1]) and read(master, INT_STAT) == 1
    assert [read(master, EVENT) for _ in range(3)] == [0x81, 0x80 | 22, 0x01]
    assert master.send(KEYPAD, [INT_STAT, 1]) and read(master, INT_STAT) == 0


def test_the_eleventh_event_or_the_first_is_lost_and_reported(panel, master):
    for cfg, first, last in ((0x01, 0x81, 0x01 + 4), (0x21, 0x01, 0x80 | 0x01 + 5)):
        set_up(master, cfg)
        for key in range(5):
            panel.press(key), panel.release(key)
        assert read(master, INT_STAT) == 1
        panel.press(5)
        assert read(master, INT_STAT) == 9 and read(master, COUNT) == 10
        events = [read(master, EVENT) for _ in range(10)]
        assert events[0] == first and events[-1] == last
        panel.release(5)
        read(master, EVENT)
        assert master.send(KEYPAD, [INT_STAT, 9]) and read(master, INT_STAT) == 0


def test_keys_that_are_not_switched_to_the_pad_make_no_event(panel, master):
    panel.press(0), panel.release(0)
    assert read(master, COUNT) == 0
    assert master.send(KEYPAD, [ROWS, 0x01]) and master.send(KEYPAD, [COLUMNS, 0x02])
    panel.press(0), panel.press(1), panel.press(8)
    assert read(master, COUNT) == 1 and read(master, EVENT) == 0x82


def test_registers_are_read_in_a_row_if_enabled(panel, master):
    set_up(master, 0x81)
    assert master.fetch(KEYPAD, 2, [ROWS]) == [0x1F, 0x7F]
    set_up(master)
    assert master.fetch(KEYPAD, 2, [ROWS]) == [0x1F, 0x1F]


def test_a_power_cut_forgets_the_set_up_and_the_events(panel, master):
    set_up(master)
    panel.press(3)
    panel.power_cut()
    panel.power_on()
    assert read(master, ROWS) == 0 and read(master, COUNT) == 0 and read(master, INT_STAT) == 0


# displays

RS, RW, E, LIGHT = 1, 2, 4, 8


class Screen:
    """The display as the firmware drives it: 4 bits at a time."""

    def __init__(self, master):
        self.master = master

    def nibble(self, nibble, flags=0):
        byte = nibble << 4 | LIGHT | flags
        assert self.master.send(DISPLAY, [byte | E, byte])

    def byte(self, byte, flags=0):
        self.nibble(byte >> 4, flags)
        self.nibble(byte & 15, flags)

    def command(self, byte):
        self.byte(byte)
        self.master.bench.run(2e-3 if byte < 4 else 50e-6)

    def text(self, text):
        for character in text:
            self.byte(ord(character), RS)

    def set_up(self):
        self.master.bench.run(50e-3)
        for nibble, wait in ((3, 5e-3), (3, 1e-3), (3, 1e-3), (2, 1e-3)):
            self.nibble(nibble)
            self.master.bench.run(wait)
        for command in (0x28, 0x0C, 0x01, 0x06):
            self.command(command)

    def status(self):
        def half():
            self.master.send(DISPLAY, [0xF0 | RW | LIGHT | E])
            value = self.master.fetch(DISPLAY, 1)[0] >> 4
            self.master.send(DISPLAY, [0xF0 | RW | LIGHT])
            return value

        return half() << 4 | half()


@pytest.fixture
def screen(master):
    made = Screen(master)
    made.set_up()
    return made


def test_four_lines_are_shown(panel, screen):
    texts = [
        "Station 12 of 36    ",
        "  target 120.00000°",
        "  angle  119.99987 >",
        "cutting             ",
    ]
    for line, text in zip((0x00, 0x40, 0x14, 0x54), texts):
        screen.command(0x80 | line)
        for character in text:
            screen.text(chr(0xDF) if character == "°" else character)
    assert (
        panel.lines == [text.ljust(20) for text in texts]
        and panel.state.display_too_soon == 0
        and panel.state.back_light
    )
    screen.command(0x08)  # off, and on again
    assert panel.lines == [" " * 20] * 4
    screen.command(0x0C)
    assert panel.lines[3] == texts[3]
    screen.command(0x01)
    assert panel.lines == [" " * 20] * 4


def test_the_first_line_goes_on_in_the_third(panel, screen):
    screen.text("x" * 20 + "abc")
    assert panel.lines == ["x" * 20, " " * 20, "abc" + " " * 17, " " * 20]
    screen.text("y" * 17 + "second")
    assert panel.lines[1] == "second" + " " * 14


def test_what_comes_too_soon_is_lost_and_counted(panel, screen):
    screen.byte(0x01)  # 1.52 ms
    screen.text("A")
    panel.run(2e-3)
    screen.text("B")
    assert panel.lines[0] == "B" + " " * 19 and panel.state.display_too_soon == 1


def test_the_busy_flag_and_the_address_are_read(panel, screen):
    screen.command(0x80 | 0x45)
    assert screen.status() == 0x45
    screen.byte(0x01)
    assert screen.status() & 0x80
    panel.run(2e-3)
    assert screen.status() == 0


def test_without_its_set_up_it_shows_nothing(panel, master):
    panel.run(50e-3)
    Screen(master).text("hello")
    assert panel.lines == [" " * 20] * 4


def test_a_power_cut_darkens_it(panel, screen):
    screen.text("hello")
    panel.power_cut()
    assert panel.lines == [" " * 20] * 4
    panel.power_on()
    screen.set_up()
    screen.text("again")
    assert panel.lines[0].strip() == "again"


def show(panel, register, value, record=None):
    def pins(**levels):
        panel.pins(**levels)
        panel.run_clk(2)
        if record is not None:
            for name, level in levels.items():
                record["levels"][name] = level
            record["rows"].append(
                sum(
                    record["levels"].get(name, 1) << n
                    for n, name in enumerate(("display_sclk", "display_data", "display_cs_n"))
                )
            )

    pins(display_cs_n=0, display_sclk=0)
    for n in range(15, -1, -1):
        pins(display_data=(register << 8 | value) >> n & 1)
        pins(display_sclk=1)
        pins(display_sclk=0)
    pins(display_cs_n=1)


def test_digits_are_decoded_or_drawn(panel):
    assert panel.digits == " " * 8
    for register, value in ((9, 0xFF), (11, 7), (12, 1)):
        show(panel, register, value)
    for digit, code in enumerate((7, 8, 9, 0x81, 0x0A, 0x0B, 0x0F, 0x0F)):
        show(panel, 1 + digit, code)
    assert panel.digits == "  E-1.987"
    show(panel, 11, 2)
    assert panel.digits == "     987"
    show(panel, 11, 7), show(panel, 9, 0x00), show(panel, 8, 0x3E)
    assert panel.digits[0] == "U"
    show(panel, 12, 0)
    assert panel.digits == " " * 8
    panel.power_cut()
    show(panel, 12, 1)
    assert panel.digits == " " * 8  # only the first digit, drawn, and nothing in it


def test_a_word_cut_short_is_counted(panel):
    panel.pins(display_cs_n=0)
    panel.run_clk(1)
    panel.pins(display_cs_n=1)
    panel.run_clk(1)
    assert panel.state.digits_cut_short == 1


# the bus


def test_devices_that_are_absent_or_dead_do_not_answer(panel, master):
    assert [address for address in range(0x08, 0x78) if master.send(address)] == [
        DISPLAY,
        KEYPAD,
        EEPROM,
    ]
    for fault, address in (
        ("eeprom_dead", EEPROM),
        ("keypad_dead", KEYPAD),
        ("display_dead", DISPLAY),
    ):
        with panel.fault(fault):
            assert not master.send(address)
        assert master.send(address)
    other = DevicesBench(Devices(keypad=True))
    assert not Master(other).send(EEPROM) and Master(other).send(KEYPAD)
    other.clear("eeprom_dead")  # a device that was not built stays absent
    assert not Master(other).send(EEPROM)


def test_a_shorted_line_is_low(panel):
    for line in ("scl", "sda"):
        with panel.fault(f"{line}_low"):
            panel.run(1e-3)
            assert not panel.level(f"i2c_{line}")
        panel.run(1e-3)
        assert panel.level(f"i2c_{line}")


def test_what_does_not_exist_is_refused(panel):
    for call, error in (
        (lambda: panel.press(34), IndexError),
        (lambda: panel.write_eeprom(16383, [1, 2]), IndexError),
        (lambda: panel.inject("fire"), KeyError),
        (lambda: panel.set(weight=1), KeyError),
        (lambda: DevicesBench(Devices(parameters={"weight": 1})), KeyError),
    ):
        with pytest.raises(error):
            call()


needs_sigrok = pytest.mark.skipif(not sigrok.installed(), reason="no sigrok-cli: make sigrok")


@needs_sigrok
def test_sigrok_reads_the_same_from_the_bus(panel, master):
    master.recorded = []
    data = [0xDE, 0xAD, 0xBE, 0xEF]
    assert master.send(EEPROM, [*address_bytes(0x0123), *data])
    panel.run(5e-3)
    assert master.fetch(EEPROM, 4, address_bytes(0x0123)) == data
    decoders = "i2c:scl=0:sda=1,eeprom24xx:chip=microchip_24lc64"
    out = sigrok.decoded(bytes(master.recorded), 2, 4 * BUS_HZ, decoders, "eeprom24xx=ops")
    assert re.findall(r"(write|read) \(addr=(\w+), 4 bytes\): ([\w ]+)", out) == [
        ("write", "0123", "DE AD BE EF"),
        ("read", "0123", "DE AD BE EF"),
    ]


@needs_sigrok
def test_sigrok_reads_the_same_from_the_numeric_display(panel):
    record = {"levels": {}, "rows": []}
    for register, value in ((9, 0xFF), (11, 7), (12, 1), (1, 5), (2, 0x83)):
        show(panel, register, value, record)
    decoders, words = "spi:clk=0:mosi=1:cs=2,max7219", "max7219=register:digit"
    out = sigrok.decoded(bytes(record["rows"]), 3, 1_000_000, decoders, words)
    assert re.findall(r"Shutdown: (\w+)|Digit (\d): (\w+)", out) == [
        ("off", "", ""),
        ("", "1", "05"),
        ("", "2", "83"),
    ]
    assert panel.digits.endswith("3.5")

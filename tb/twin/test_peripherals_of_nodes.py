# SPDX-License-Identifier: Apache-2.0
"""The peripherals of nodes in the twin, pin by pin: the RTL is between a program that makes its
registers accessible and the models of the devices.
"""

import math
import struct
from pathlib import Path

import pytest

from firmware import build as firmware_build
from moire.client.bus import Bus
from moire.made.registers import BY_NAME
from twin import Axis, Devices, Node, Twin, TwinTransport

ARC_SECOND = math.pi / 180 / 3600
CUT_S, WRITE_S = 0.3, 0.05  # the bridge is slow
BRIDGE_BAUD = 115200
START = [0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14]
EEPROM, KEYPAD, DISPLAY = 0x50, 0x34, 0x27


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Words of peripherals_bridge.c, made by firmware.build."""
    folder, memory = tmp_path_factory.mktemp("program"), 4 * 4096
    command, libraries = firmware_build.compiler()
    script, elf = folder / "link.ld", folder / "bridge.elf"
    script.write_text(firmware_build.link_script(memory))
    sources = [
        Path(__file__).with_name("peripherals_bridge.c"),
        firmware_build.HERE / "core" / "start.S",
    ]
    firmware_build.run(
        [
            *command,
            *firmware_build.FLAGS,
            firmware_build.SMALL,
            f"-I{firmware_build.HERE}",
            *map(str, sources),
            "-Wl,--gc-sections",
            f"-Wl,-T,{script}",
            "-o",
            str(elf),
            *libraries,
        ]
    )
    content, used = firmware_build.contents(firmware_build.read_elf(elf)[0], memory)
    return [word for (word,) in struct.iter_unpack("<I", content[: (used + 3) // 4 * 4])]


class Bridge:
    """The registers of the peripherals of the first node, accessed over its peer port."""

    def __init__(self, twin):
        self.twin, self.to, self.back = twin, twin.peer_line(1, 0), twin.peer_line(0, 1)
        self.twin.run(2e-3)  # the program starts

    def _wait(self, count):
        self.twin.run(count * 10 / BRIDGE_BAUD + 1e-4)

    def write(self, register, **values):
        word = 0
        for name, value in values.items():
            field = BY_NAME["peripherals", register, name]
            word |= value << field.low
        self.to.put([0x80 | field.offset // 4, *word.to_bytes(4, "little")])
        self._wait(5)

    def word(self, number):
        self.to.put([number])
        self._wait(5)
        return int.from_bytes(self.back.take_received(), "little")

    def read(self, register, name="value"):
        field = BY_NAME["peripherals", register, name]
        return field.value(self.word(field.offset // 4))

    # I2C by the queue of commands

    def i2c(self, *commands):
        """Execute commands (command, data, acknowledge); returns their (result, data)."""
        for command, data, acknowledge in commands:
            self.write("i2c", command=command, data=data, acknowledge=acknowledge)
        while self.read("i2c_state", "busy"):
            self.twin.run(1e-4)
        answers = [
            self.word(BY_NAME["peripherals", "i2c_answer", "data"].offset // 4) for _ in commands
        ]
        assert all(answer >> 10 & 1 for answer in answers)
        return [(answer >> 8 & 3, answer & 0xFF) for answer in answers]

    def send(self, address, *data):
        answers = self.i2c((0, 0, 0), *((2, byte, 0) for byte in (address << 1, *data)), (1, 0, 0))
        return all(result == 0 for result, _ in answers)

    def fetch(self, address, count, *at):
        answers = self.i2c(
            (0, 0, 0),
            *((2, byte, 0) for byte in (address << 1, *at)),
            (0, 0, 0),
            (2, address << 1 | 1, 0),
            *((3, 0, n + 1 < count) for n in range(count)),
            (1, 0, 0),
        )
        assert all(result == 0 for result, _ in answers)
        return [data for _, data in answers[-1 - count : -1]]


@pytest.fixture
def twin(program):
    devices = Devices(
        eeprom=True,
        keypad=True,
        display=True,
        keyboard=True,
        edm=True,
        table=0,
        parameters={"edm_cut_time": CUT_S, "eeprom_write_time": WRITE_S},
    )
    with Twin(
        [Node(1, [Axis("worm_table")], devices), Node(2, [])],
        firmware=program,
        peers=(0, 1),
        peer_baud=BRIDGE_BAUD,
    ) as made:
        yield made


@pytest.fixture
def peripherals(twin):
    return Bridge(twin)


def test_the_panel_is_reached_by_the_bus(twin, peripherals):
    panel = twin.devices(0)
    assert peripherals.send(EEPROM, 0x01, 0x20, 1, 2, 3) and not peripherals.send(
        EEPROM
    )  # it writes
    twin.run(WRITE_S)
    assert peripherals.fetch(EEPROM, 3, 0x01, 0x20) == [1, 2, 3] and panel.eeprom[
        0x120:0x123
    ] == bytes([1, 2, 3])
    assert peripherals.send(KEYPAD, 0x1D, 0x1F) and peripherals.send(KEYPAD, 0x1E, 0x7F)
    panel.press(8)
    assert peripherals.fetch(KEYPAD, 1, 0x04) == [0x80 | 12]
    for nibble, register in (
        (3, 0),
        (3, 0),
        (3, 0),
        (2, 0),
        (2, 0),
        (8, 0),
        (0, 0),
        (0xC, 0),
        (4, 1),
        (8, 1),
        (6, 1),
        (9, 1),
    ):
        peripherals.send(DISPLAY, nibble << 4 | 12 | register, nibble << 4 | 8 | register)
        twin.run(5e-3)
    assert panel.lines[0] == "Hi" + " " * 18
    with panel.fault("eeprom_dead"):
        assert not peripherals.send(EEPROM)
    with panel.fault("sda_low"):
        twin.run(1e-3)
        assert peripherals.read("i2c_state", "sda") == 0


def test_the_numeric_display_shows_what_is_sent(twin, peripherals):
    for word in (0x0C01, 0x0B07, 0x09FF, 0x0104, 0x0283):
        peripherals.write("display", value=word)
    twin.run(5e-3)
    assert twin.devices(0).digits == "0" * 6 + "3.4"


def test_keys_pass_both_ways_and_a_cut_is_injected(twin, peripherals):
    devices = twin.devices(0)
    devices.type([0x1C, 0xF0, 0x1C])
    devices.order([0xED, 0x04])
    twin.run(0.1)
    assert [byte for _, byte in devices.take_received() if byte != 0xFA] == [
        0x1C,
        0xF0,
        0x1C,
    ] and devices.state.keyboard_lights == 4
    assert peripherals.read("ps2_typed") == 3
    peripherals.write("ps2_idle", value=20)
    for n, code in enumerate(START):
        peripherals.write("ps2_inject", data=code, last=n == 5)
    devices.type([0x2A, 0xF0, 0x2A])
    twin.run(0.2)
    received = [byte for _, byte in devices.take_received()]
    assert sorted(received) == sorted([*START, 0x2A, 0xF0, 0x2A]) and devices.state.edm_cutting
    assert peripherals.read("edm_status", "inputs") == 1 and peripherals.read(
        "edm_status", "rose_0"
    )
    twin.run(CUT_S)
    (cut,) = devices.cuts
    assert cut.complete and cut.angle_start_rad == pytest.approx(
        twin.truth(0).position_rad, abs=ARC_SECOND
    )
    assert peripherals.read("edm_status", "inputs") == 0 and peripherals.read(
        "edm_status", "fell_0"
    )
    with devices.fault("edm_alarm"):
        twin.run(0.05)
        assert peripherals.read("edm_status", "inputs") == 2


def test_the_sensor_of_the_first_axis_is_read(twin, peripherals):
    peripherals.write("sensor_bit_time", value=333)
    peripherals.write("sensor_gap", value=2_000)
    twin.run(0.1)
    assert peripherals.read("sensor_frames") >= 9 and peripherals.read("sensor_state", "stale") == 0
    angle = (
        peripherals.word(BY_NAME["peripherals", "sensor_reading", "value"].offset // 4)
        / 2**32
        * 2
        * math.pi
    )
    assert (angle - twin.truth(0).position_rad % (2 * math.pi)) / ARC_SECOND == pytest.approx(
        0, abs=1.0
    )


def test_a_power_cut_stops_the_program_and_tears_the_page_it_wrote(twin, peripherals):
    devices = twin.devices(0)
    devices.write_eeprom(0, [0x11] * 128)
    peripherals.write("sensor_gap", value=2_000)
    devices.type(START)
    twin.run(0.1)
    assert peripherals.send(EEPROM, 0, 0, *[0x22] * 8)
    twin.power_cut(0)
    interrupted = devices.eeprom
    twin.run(0.05)
    assert (
        peripherals.back.take_received() == b""
        and devices.state.edm_cutting
        and devices.state.eeprom_torn == 1
    )
    assert interrupted[:64] not in (
        bytes([0x22] * 8 + [0x11] * 56),
        bytes([0x11] * 64),
    ) and interrupted[64:128] == bytes([0x11] * 64)
    devices.type([0x1C])
    twin.run(0.05)
    assert (
        not [byte for _, byte in devices.take_received() if byte == 0x1C]
        and devices.state.keyboard_sent == 7
    )
    twin.power_on(0)
    twin.run(2e-3)
    assert peripherals.read("sensor_gap") != 2_000 and devices.eeprom == interrupted
    twin.run(CUT_S)
    assert [cut.complete for cut in devices.cuts] == [True]


def test_a_node_without_power_is_silent_with_its_drive_off_and_it_restarts():
    with Twin(seed=1) as twin:
        twin.run(0.1)
        bus = Bus(TwinTransport(twin))
        axis, other = bus.axis(1), bus.axis(2)
        axis.enable()
        assert twin.truth(0).enabled
        twin.power_cut(0)
        twin.run(1e-3)
        assert not twin.truth(0).enabled and twin.bus_stays_idle(0.01)
        before = twin.truth(0).position_m
        twin.send_words([0x111])
        twin.run(0.01)
        assert twin.receive_words() == [] and not other.status().faults
        twin.inject("estop", 0)
        twin.power_on(0)
        twin.power_on(0)  # has no effect
        twin.run(0.1)
        status = axis.status()
        assert (
            status.estop
            and not twin.truth(0).enabled
            and twin.truth(0).position_m == pytest.approx(before, abs=1e-6)
        )
        twin.clear("estop", 0)
        twin.power_cut(1)
        twin.run(0.01)
        assert axis.status().position_nm is not None and twin.bus().collisions == 0


def test_devices_and_peers_that_do_not_exist_are_refused():
    with Twin(seed=1) as twin:
        with pytest.raises(LookupError, match="no node has devices"):
            twin.devices(0)
        with pytest.raises(LookupError, match="no serial line leads from node 0 to node 1"):
            twin.peer_line(0, 1)
        with pytest.raises(IndexError, match="no node 2"):
            twin.power_cut(2)
    with pytest.raises(IndexError, match="no axis 3 to be the table"):
        Twin([Node(1, devices=Devices(table=3))])

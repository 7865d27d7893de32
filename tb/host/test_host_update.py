# SPDX-License-Identifier: Apache-2.0
"""moire.client.update, Node.update() and the command, against the compiled firmware with a model of
its flash: every refusal, every failure, and what runs after it.
"""

import io
import json
import random
import struct
import zlib
from dataclasses import replace

import pytest

from figures.update import FACTORY, update_bricked
from firmware.build import update_file
from moire.cli import command_line
from moire.client import update as client
from moire.client.bus import Bus
from moire.client.update import Firmware, UpdateFailed, WrongFirmware, read_firmware, update_state
from moire.errors import BadFile, NoAnswer, OutOfRange, Refused
from moire.made.bus_tables import PROTOCOL_CRC
from moire.made.registers import MAP_CRC
from tb.bench import seed
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus
from twin.compiled.flash_node import (
    SECTOR,
    SPACING,
    START,
    TRIAL_MS,
    FlashBus,
    FlashNode,
    SerialFlash,
)

ENTRY = struct.Struct("<6I")  # magic, generation, bytes, CRC-32 of image, map and entry
ENTRY_AT, MARK_AT = SPACING - SECTOR, SPACING - SECTOR + 256
PROGRAMS = [bytes(random.Random(n).randbytes(size)) for n, size in enumerate((70, 4096, 33))]


def firmware(n=0, **changes):
    known = Firmware("counter", 8, "serial", 65536, MAP_CRC, PROTOCOL_CRC, PROGRAMS[n])
    return replace(known, **changes)


class Desk:
    """A node on its bus, with a host."""

    def __init__(self):
        flash = SerialFlash(random.Random(seed()), bytes(START) + FACTORY)
        self.board = FlashNode(flash)
        self.bus = Bus(FlashBus(self.board), random_source=random.Random(seed()))

    def update(self, *numbers):
        return [self.bus.node().update(firmware(n)) for n in numbers][-1]

    def power_up(self):
        self.board.power_up()
        return update_state(self.bus, 1)

    def bytes_of(self, image, at, count):
        first = START + image * SPACING + at
        return slice(first, first + count)

    def entry(self, image):
        """The entry of an image, without its CRC-32."""
        words = ENTRY.unpack(self.board.flash.content[self.bytes_of(image, ENTRY_AT, ENTRY.size)])
        return dict(zip(("magic", "generation", "bytes", "image", "map"), words, strict=False))

    def enter(self, image, **changes):
        """Change the entry of an image, with a right CRC-32 and mark."""
        where = self.bytes_of(image, ENTRY_AT, ENTRY.size)
        head = struct.pack("<5I", *{**self.entry(image), **changes}.values())
        crc = zlib.crc32(head)
        self.board.flash.content[where] = head + struct.pack("<I", crc)
        mark = self.bytes_of(image, MARK_AT, 4)
        self.board.flash.content[mark] = struct.pack("<I", ~crc & 0xFFFFFFFF)

    def call(self, *words):
        """Exit code, standard output and standard error of a command."""
        out, err = io.StringIO(), io.StringIO()
        code = command_line.main([*words], lambda options: FlashBus(self.board), out, err)
        return code, out.getvalue(), err.getvalue()


@pytest.fixture
def desk():
    return Desk()


@pytest.fixture
def file(tmp_path):
    def write(program=PROGRAMS[0], content=None):
        path = tmp_path / "new.update"
        path.write_bytes(content or update_file(program, "counter", 8, "serial", 65536))
        return str(path)

    return write


def test_the_new_firmware_runs_is_confirmed_and_runs_after_each_power_up(desk):
    state = desk.update(0)
    assert (state.image, state.trial, state.crc) == (1, False, zlib.crc32(PROGRAMS[0]))
    assert desk.power_up() == state and desk.board.runs.startswith(PROGRAMS[0])


def test_each_update_goes_into_the_image_that_is_not_in_use_and_the_factory_image_stays(desk):
    assert [desk.update(n).image for n in (0, 1, 2)] == [1, 2, 1]
    content = desk.board.flash.content
    assert content[START:].startswith(FACTORY) and not any(content[:START])
    assert content[desk.bytes_of(2, 0, 4096)] == PROGRAMS[1]


def test_each_update_is_one_generation_newer_than_the_newest(desk):
    generations = []
    for n in (0, 1, 2):
        image = desk.update(n).image
        generations.append((image, desk.entry(image)["generation"]))
    assert generations == [(1, 1), (2, 2), (1, 3)]


def test_an_entry_of_the_factory_image_does_not_count(desk):
    desk.update(0)
    content = desk.board.flash.content
    desk.enter(1, generation=9)
    content[desk.bytes_of(0, 0, SPACING)] = content[desk.bytes_of(1, 0, SPACING)]
    desk.enter(1, generation=1)
    assert desk.power_up().image == 1
    assert desk.update(1).image == 2 and desk.entry(2)["generation"] == 2


def test_firmware_that_is_confirmed_still_runs_when_its_trial_would_have_ended(desk):
    desk.update(0)
    core = desk.board.core
    for _ in range(TRIAL_MS + 1):
        desk.board.millisecond()
    assert desk.board.core is core, "it is not started again"


@pytest.mark.parametrize("size", [1, SECTOR - 1, SECTOR, SECTOR + 1, 2 * SECTOR + 1])
def test_all_sectors_of_a_program_are_erased_before_it_is_written(desk, size):
    content, program = desk.board.flash.content, random.Random(seed()).randbytes(size)
    content[desk.bytes_of(1, 0, SPACING)] = bytes(SPACING)
    desk.bus.node().update(firmware(program=program))
    assert content[desk.bytes_of(1, 0, size)] == program


def test_progress_names_each_phase_in_order(desk):
    phases = []
    client.update(desk.bus, 1, firmware(), lambda words, share: phases.append((words, share)))
    assert list(dict(phases)) == ["erasing", "writing", "checking", "starting"]
    assert [share for words, share in phases if words == "writing"] == [1 / 3, 2 / 3, 1.0]


@pytest.mark.parametrize("earlier", [0, 1])
def test_firmware_that_does_not_answer_is_replaced_by_the_one_before(desk, earlier):
    before = desk.update(1) if earlier else update_state(desk.bus, 1)
    desk.board.hangs = PROGRAMS[0]
    words = "the firmware with the CRC-32" if earlier else "its factory firmware"
    with pytest.raises(UpdateFailed, match=f"did not answer in its trial; node 1 now runs {words}"):
        desk.update(0)
    assert update_state(desk.bus, 1) == replace(before, state="idle") == desk.power_up()


def test_firmware_on_trial_counts_only_when_it_is_confirmed(desk, monkeypatch):
    def lost(*_):
        raise NoAnswer(1)

    monkeypatch.setattr(client, "await_start", lost)
    with pytest.raises(UpdateFailed, match="now runs its factory firmware"):
        desk.update(0)
    desk.bus.transport.wait(0.2)
    state = update_state(desk.bus, 1)
    assert state.trial and "on trial, in image 1" in state.words
    with pytest.raises(Refused, match="firmware is on trial"):
        desk.update(1)
    assert desk.power_up().image == 0


def test_a_node_without_power_is_said_to_run_the_firmware_before(desk):
    desk.board.flash.power_up(cut_in=3)
    with pytest.raises(UpdateFailed, match="does not answer now: it will run its factory firmware"):
        desk.update(1)
    assert desk.power_up().image == 0


def test_damaged_images_and_those_of_another_register_map_are_passed_over(desk):
    desk.update(0, 1)
    content = desk.board.flash.content
    content[desk.bytes_of(2, 100, 1)] = bytes([PROGRAMS[1][100] ^ 1])
    assert desk.power_up().image == 1
    desk.enter(1, map=MAP_CRC ^ 1)
    assert desk.power_up().image == 0
    desk.enter(1, map=MAP_CRC)
    assert desk.power_up().image == 1
    desk.enter(1, bytes=32769)
    assert desk.power_up().image == 0


def test_the_highest_generation_runs(desk):
    desk.update(0, 1)
    assert desk.power_up().image == 2
    desk.enter(1, generation=7)
    assert desk.power_up().image == 1


def test_an_update_that_begins_while_a_block_is_still_being_written_is_the_newest(desk):
    desk.update(0, 1)
    ask = desk.board.core.request
    assert ask("begin_update", bytes=70, crc=1, map_crc=MAP_CRC, memory=65536, axes=8)[0] == "ok"
    desk.bus.transport.wait(0.1)
    assert ask("write_update", block=0, **{f"word_{n}": 0 for n in range(8)})[0] == "ok"
    desk.board.flash.polls = 50
    desk.update(2)
    assert desk.power_up().crc == zlib.crc32(PROGRAMS[2])


def test_a_block_that_arrives_wrong_is_found_by_its_crc(desk, monkeypatch):
    real = client.write
    monkeypatch.setattr(
        client, "write", lambda bus, address, program, show: real(bus, address, b"?" * 70, show)
    )
    with pytest.raises(UpdateFailed, match="its CRC-32 is wrong in the flash.*now runs its fact"):
        desk.update(0)


def test_a_flash_that_stays_busy_ends_the_update(desk, monkeypatch):
    monkeypatch.setattr(client, "STEP_TIMEOUT_S", 1)
    monkeypatch.setattr(SerialFlash, "finish", lambda self: setattr(self, "polls", 10**9))
    with pytest.raises(UpdateFailed, match="did not end the step before 'writing'"):
        desk.update(0)


def test_a_flash_that_fails_while_it_is_written_ends_the_update(desk, monkeypatch):
    real, finish = client.write, SerialFlash.finish

    def write(*arguments):
        monkeypatch.setattr(SerialFlash, "finish", lambda self: setattr(self, "polls", 10**9))
        real(*arguments)

    monkeypatch.setattr(client, "write", write)
    with pytest.raises(UpdateFailed, match="the flash failed"):
        desk.update(0)
    monkeypatch.setattr(SerialFlash, "finish", finish)
    assert desk.power_up().image == 0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (dict(core="soft"), "is for the soft core, and node 1 has the serial core"),
        (dict(map_crc=5), "for the register map 00000005, and the bitstream of node 1 has"),
        (dict(axes=0), "serves 0 axes, and node 1 has 1"),
    ],
)
def test_firmware_of_another_node_is_refused_before_anything_is_sent(desk, changes, words):
    with pytest.raises(WrongFirmware, match=words):
        client.update(desk.bus, 1, firmware(**changes))
    assert desk.board.flash.works == 0


@pytest.mark.parametrize(
    ("changes", "cause"),
    [
        (dict(memory=1 << 20), "firmware_of_other_node"),
        (dict(program=bytes(32769)), "firmware_too_long"),
        (dict(program=b""), "out_of_range"),
    ],
)
def test_the_node_refuses_what_it_has_no_room_for(desk, changes, cause):
    with pytest.raises(Refused) as refused:
        client.update(desk.bus, 1, firmware(**changes))
    assert refused.value.cause == cause and desk.board.flash.works == 0


def test_steps_in_a_wrong_order_are_refused(desk):
    ask = desk.board.core.request
    words = {f"word_{n}": 0 for n in range(8)}
    good = dict(bytes=70, crc=1, map_crc=MAP_CRC, memory=65536, axes=8)
    assert [ask("update", action=n)[0] for n in range(4)] == ["not_now"] * 3 + ["out_of_range"]
    assert ask("write_update", block=0, **words)[0] == "not_now"
    assert ask("begin_update", **{**good, "map_crc": 1})[0] == "firmware_of_other_node"
    assert ask("begin_update", **{**good, "axes": 0})[0] == "firmware_of_other_node"
    assert ask("begin_update", **good)[0] == "ok"
    desk.board.flash.polls = 50
    assert ask("begin_update", **good)[0] == "not_now"
    desk.bus.transport.wait(0.1)
    assert ask("write_update", block=3, **words)[0] == "out_of_range"
    assert ask("write_update", block=2, **words)[0] == "ok"


def test_a_drive_that_is_on_refuses_the_update(desk):
    axis = desk.board.core.axes[0]
    assert desk.board.core.request("enable", axis=0, on=1)[0] == "ok" and axis.enabled
    with pytest.raises(Refused, match="a drive is on"):
        desk.update(0)
    desk.board.core.ask("enable", axis=0, on=0)
    assert desk.update(0).image == 1


def test_a_node_without_a_flash_says_what_to_do():
    with pytest.raises(Refused, match=r"does not come out of a flash.*make board"):
        Bus(Rs485Bus(BusNode())).node().update(firmware())


def test_a_serial_core_without_the_port_of_the_flash_answers_not_built(desk, monkeypatch):
    monkeypatch.setattr(FlashNode, "read", lambda self, offset: 0)
    desk.board.power_up()
    with pytest.raises(Refused, match="does not come out of a flash that it can write"):
        desk.update(0)


def test_another_baud_rate_is_refused(desk):
    desk.bus.baud_changed = True
    with pytest.raises(OutOfRange, match="needs the baud rate after power-up"):
        desk.update(0)


def test_files_that_are_no_whole_firmware_are_refused(file, tmp_path):
    whole = read_firmware(file())
    assert whole.program == PROGRAMS[0] and whole.map_crc == MAP_CRC and whole.axes == 8
    assert whole.protocol_crc == PROTOCOL_CRC and whole.memory == 65536
    content = (tmp_path / "new.update").read_bytes()
    for wrong, words in (
        (content[:-1], "is damaged"),
        (content[:-1] + bytes([content[-1] ^ 1]), "is damaged"),
        (PROGRAMS[0], "is no firmware"),
        (b"[1]\n" + PROGRAMS[0], "is no firmware"),
        (content.replace(b'"axes": 8', b'"axes": "8"'), "is no firmware"),
    ):
        with pytest.raises(BadFile, match=words):
            read_firmware(file(content=wrong))
    for name in (str(tmp_path / "none"), "a\0b"):
        with pytest.raises(BadFile, match="cannot be read"):
            read_firmware(name)


def test_the_command_updates_and_says_what_the_node_runs(desk, file):
    assert desk.call("update") == (0, "node 1 runs its factory firmware\n", "")
    code, out, err = desk.call("update", file())
    crc = zlib.crc32(PROGRAMS[0])
    assert (code, err) == (0, "")
    assert f"node 1 runs the firmware with the CRC-32 {crc:08X}, in image 1, confirmed; 70" in out
    found = json.loads(desk.call("--json", "update")[1])
    assert (found["image"], found["crc"], found["trial"]) == (1, crc, False)


def test_the_command_reports_what_is_wrong(desk, file):
    code, out, err = desk.call("update", file(content=b"text"))
    assert (code, out) == (2, "") and "is no firmware" in err


def test_no_power_cut_leaves_a_node_without_an_answer():
    assert update_bricked(seed(), cuts=8) == 0

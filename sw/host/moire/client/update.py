# SPDX-License-Identifier: Apache-2.0
"""New firmware over the bus, into a node whose firmware comes out of a flash.

    node.update("counter_serial.update")        # or update(bus, address, firmware)

The flash has the factory image, which is never written, and two more. The new firmware is written
into the one that is not in use, checked, started on trial, and confirmed once it has answered this
host. Until then every power-up runs the firmware before. A node of other sources than this host can
be updated, too: the operations of an update are the same in all versions.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from moire.client.names import code_name, descriptions
from moire.errors import BadFile, BusError, MoireError, NoAnswer, OutOfRange, Refused, with_more
from moire.made.bus_tables import CAUSES, UPDATE_ACTIONS, UPDATE_STATES

if TYPE_CHECKING:
    from moire.client.bus import Bus

ACTIONS = {name: code for code, (name, _) in UPDATE_ACTIONS.items()}
BLOCK = 32  # bytes of a request
WORDS = struct.Struct("<8I")
CORE = "serial"  # the soft core whose firmware comes out of a flash
STEP_TIMEOUT_S = 60  # to erase or to check: a flash needs up to 0.4 s for each of 8 sectors
START_TIMEOUT_S = 120  # a trial without an answer ends before: 2^28 cycles, 67 s at 4 MHz
REMEDY = (
    "the firmware of this node does not come out of a flash that it can write: build its bitstream "
    "with the new firmware (make board, or make firmware) and load that"
)
KEYS = ("image", "axes", "core", "memory", "map_crc", "protocol_crc", "bytes", "crc")

Progress = Callable[[str, float], None]  # what the update does, and the share that is done


class UpdateFailed(MoireError):
    """The update has ended without the new firmware; the sentence says what the node now runs."""


class WrongFirmware(MoireError):
    """The firmware is not for this node; nothing was sent."""

    exit_code = 5


@dataclass(frozen=True)
class Firmware:
    """A file of `python -m firmware.build`, NAME.update."""

    image: str
    axes: int
    core: str
    memory: int  # bytes
    map_crc: int
    protocol_crc: int
    program: bytes

    @property
    def crc(self) -> int:
        """The CRC-32 of the program."""
        return zlib.crc32(self.program)


@dataclass(frozen=True)
class UpdateState:
    """What a node runs, and what its update does."""

    state: str
    ended: str  # how the last step ended, a cause
    image: int  # that runs: 0 the factory image, 1 or 2 an updated one
    trial: bool  # it is not confirmed
    crc: int  # of the image that runs, 0 for the factory image
    longest: int  # bytes for which there is room

    @property
    def words(self) -> str:
        """What the node runs, in words."""
        if self.image == 0:
            return "its factory firmware"
        trial = " on trial" if self.trial else ""
        return f"the firmware with the CRC-32 {self.crc:08X}{trial}, in image {self.image}"


def read_firmware(file: str | Path) -> Firmware:
    """The firmware of a file; raises BadFile."""
    try:
        content = Path(file).read_bytes()
    except OSError as error:
        raise BadFile(f"the file {file} cannot be read: {error.strerror}") from None
    except ValueError:  # a zero byte in the name
        raise BadFile(f"the file {file!r} cannot be read: this is no name of a file") from None
    head, _, program = content.partition(b"\n")
    try:
        about = json.loads(head)
        image, axes, core, memory, map_crc, protocol_crc, size, crc = (about[key] for key in KEYS)
        good = about["moire_firmware"] == 1 and isinstance(core, str) and isinstance(image, str)
        good = good and all(type(n) is int for n in (axes, memory, map_crc, protocol_crc, size))
    except (ValueError, KeyError, TypeError):
        good = False
    if not good:
        raise BadFile(
            f"the file {file} is no firmware for an update: the firmware build makes one with "
            "--update"
        )
    if len(program) != size or zlib.crc32(program) != crc:
        raise BadFile(
            f"the file {file} is damaged: it has {len(program)} of {size} bytes of firmware, or "
            "their CRC-32 is wrong"
        )
    return Firmware(image, axes, core, memory, map_crc, protocol_crc, program)


def update_state(bus: Bus, address: int) -> UpdateState:
    """What the node runs; raises Refused with the cause not_built if it cannot be updated."""
    try:
        reply = bus.request(address, "update_state")
    except Refused as refused:
        if refused.cause in ("not_built", "unknown_operation"):
            raise with_more(refused, REMEDY) from None
        raise
    return UpdateState(
        state=code_name(UPDATE_STATES, reply["state"], "state"),
        ended=code_name(CAUSES, reply["ended"], "cause"),
        image=reply["image"],
        trial=bool(reply["trial"]),
        crc=reply["crc"],
        longest=reply["longest"],
    )


def update(
    bus: Bus, address: int, firmware: Firmware | str | Path, progress: Progress | None = None
) -> UpdateState:
    """Writes new firmware into a node, starts it and confirms it; returns what the node then runs.

    Raises WrongFirmware, or Refused before anything is changed: for a node without a flash, a drive
    that is on, or firmware that is too long. Raises UpdateFailed when something went wrong later.
    """
    if not isinstance(firmware, Firmware):
        firmware = read_firmware(firmware)
    if bus.baud_changed:
        raise OutOfRange(
            "an update needs the baud rate after power-up, to which the new firmware returns"
        )
    identity = bus.identify(address)
    before = update_state(bus, address)
    require_fit(firmware, identity.map_crc, identity.axes, address)
    show = progress or (lambda words, share: None)
    bus.request(
        address,
        "begin_update",
        bytes=len(firmware.program),
        crc=firmware.crc,
        map_crc=firmware.map_crc,
        memory=firmware.memory,
        axes=firmware.axes,
    )
    try:
        show("erasing", 0.0)
        wait_for(bus, address, "writing")
        write(bus, address, firmware.program, show)
        show("checking", 1.0)
        bus.request(address, "update", action=ACTIONS["check"])
        wait_for(bus, address, "checked")
        show("starting", 1.0)
        bus.request(address, "update", action=ACTIONS["run"])
        await_start(bus, address, before.image, firmware.crc)
        bus.request(address, "update", action=ACTIONS["confirm"])
        return update_state(bus, address)
    except (BusError, Refused, UpdateFailed) as error:
        raise UpdateFailed(f"{error}; {now_runs(bus, address, before)}") from error


def require_fit(firmware: Firmware, map_crc: int, axes: int, address: int) -> None:
    """Raises WrongFirmware unless a node with this register map and so many axes can run it. The
    node itself compares its memory.
    """
    if firmware.core != CORE:
        raise WrongFirmware(
            f"this firmware is for the {firmware.core} core, and node {address} has the {CORE} "
            f"core: build it with --core {CORE}"
        )
    if firmware.map_crc != map_crc:
        raise WrongFirmware(
            f"this firmware is for the register map {firmware.map_crc:08X}, and the bitstream of "
            f"node {address} has {map_crc:08X}: build the firmware from the sources of the "
            "bitstream, or load a new bitstream first"
        )
    if firmware.axes < axes:
        raise WrongFirmware(
            f"this firmware serves {firmware.axes} axes, and node {address} has {axes}: build it "
            f"with --axes {axes}"
        )


def write(bus: Bus, address: int, program: bytes, show: Progress) -> None:
    """Send all blocks; the last one is filled with FFh, as an erased flash is."""
    blocks = -(-len(program) // BLOCK)
    for block in range(blocks):
        content = program[block * BLOCK : (block + 1) * BLOCK].ljust(BLOCK, b"\xff")
        words = {f"word_{n}": word for n, word in enumerate(WORDS.unpack(content))}
        bus.request(address, "write_update", block=block, **words)
        show("writing", (block + 1) / blocks)


def wait_for(bus: Bus, address: int, state: str) -> None:
    """Returns when a step of the update has ended; raises UpdateFailed if it failed."""
    began = bus.transport.now()
    while (found := update_state(bus, address)).state != state:
        if found.ended not in ("ok", "running"):
            raise UpdateFailed(descriptions(CAUSES, [found.ended]))
        if found.state == "idle" or bus.transport.now() - began > STEP_TIMEOUT_S:
            raise UpdateFailed(f"the node did not end the step before '{state}'")
        bus.transport.wait(bus.poll_s)


def await_start(bus: Bus, address: int, before: int, crc: int) -> None:
    """Returns when the new firmware answers; raises UpdateFailed if it does not. The node itself
    returns to the image before.
    """
    began = bus.transport.now()
    while True:
        bus.transport.wait(bus.poll_s)
        late = bus.transport.now() - began > START_TIMEOUT_S
        try:
            found = update_state(bus, address)
        except BusError:
            if late:
                raise
            continue
        if found.image != before and found.crc == crc:
            return
        if found.state != "starting" or late:
            raise UpdateFailed("the new firmware did not answer in its trial")


def now_runs(bus: Bus, address: int, before: UpdateState) -> str:
    """What a node runs after a failed update, as the end of a sentence."""
    try:
        found = update_state(bus, address)
    except NoAnswer:
        return (
            f"node {address} does not answer now: it will run {before.words} after its next "
            "power-up"
        )
    except MoireError as error:
        return f"what node {address} runs could not be read: {error}"
    return f"node {address} now runs {found.words}"

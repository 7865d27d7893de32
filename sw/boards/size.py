# SPDX-License-Identifier: Apache-2.0
"""How large a node becomes, estimated before any synthesis: an error of some percent is usual."""

from dataclasses import dataclass

from boards.machine import LINKS, SERIAL_LINK, SPI_LINK, Axis, Machine
from figures import record
from firmware.build import stem_of

MEASURED = {name: round(entry.value) for name, entry in record.read().items()}
# LUT4 of an ECP5; what no figure measures was measured by synthesis
STEP_AXIS, SINE_AXIS = MEASURED["axis_step_lut"], MEASURED["axis_sine_lut"]
STEP_NODE, SINE_NODE = 8291, 10583  # of two axes each
FEATURES = {
    "segments": 1030,
    "monitor": 750,
    "compare": 440,
    "fine_stage": 310,
    "capture": 280,
    "encoder_check": 190,
    "recorder": 100,
    "backlash": 638,
}
STEPPER = 730  # in an axis that has another drive
PERIPHERALS = 3033  # all six (docs/peripherals.md); one alone was not measured
LINK = 1296  # the real-time link
ETHERNET = {"mii": 3377, "rgmii": 4921}  # core of LiteEth by the interface, as synthesised
SET_POINTS, SET_POINTS_AXIS = 3827, 353  # of the first axis that has them, of each further one
# Block RAMs of an ECP5, as Yosys maps the memories (counted in netlists of the builds)
MEMORY_STEP_KIB, MEMORY_STEP = 32, 16  # memory of the soft core
CODE_CACHE, CODE_LUT = 2, 370  # what it keeps of a flash; LUT4 to execute from there
MICROCODE, ENGINE, ENGINE_AXES = 2, 2, 4  # motion engine; its words for so many axes
SETTINGS = ((1, 1), (4, 2), (8, 4))  # register_memory of at most so many axes
RECORDER, SEGMENT_TABLE, HARMONICS_AXES = 2, 1, 2  # of an axis; two axes of a chain share tables
ETHERNET_RAM = 4  # core of LiteEth for RGMII and the link
LINK_RAM = {SERIAL_LINK: 3, SPI_LINK: 2}  # lists of the link, and its frames on a serial line
I2C_RAM, SET_POINTS_RAM = 2, 2  # commands and results; the queue of all axes
SCOPE_STEP_WORDS, WAVEFORM = 512, 4  # recorder of ticks: words of a block; its excitation
# On an iCE40: the node of four axes that count in logic cells, the LUT4 by which netlists of four
# and three of them differ, and the queue of an axis' captures
COUNTING_NODE, COUNTING_AXIS = MEASURED["node_up5k_lc"], 562
ICE40_BLOCK_RAM, ICE40_CAPTURE = 5, 6
ICE40_KIB = 2  # block RAMs of a KiB
RELAY, RELAY_BLOCK_RAM = MEASURED["relay_up5k_lc"], 5  # of 16 orders, on an iCE40
TICK, TICK_AXIS = 70, 365  # cycles of the motion engine (docs/engine.md)
TICK_FILTERS = {0: 0, 2: 115, 4: 219}  # further cycles of an axis with so many biquads


@dataclass(frozen=True)
class Size:
    """What a node takes of a part."""

    lut: int
    block_ram: int


def firmware_stem(machine: Machine) -> str:
    """The name of the files of the firmware's image."""
    return stem_of(machine.image, len(machine.axes), machine.core, machine.update)


def axis_lut(axis: Axis) -> int:
    """LUT4 that a further axis takes on an ECP5."""
    base = SINE_AXIS if axis.has("sine") else STEP_AXIS
    more = sum(lut for name, lut in FEATURES.items() if axis.has(name))
    both = "stepper" in axis.drives and (axis.has("sine") or len(axis.drives) > 1)
    return base + more + STEPPER * both


def ecp5_block_ram(machine: Machine) -> int:
    """Block RAMs on an ECP5."""
    axes = machine.axes

    def count(*names: str) -> int:
        """Axes that have all of these features."""
        return sum(all(axis.has(name) for name in names) for axis in axes)

    found = MEMORY_STEP * -(-machine.memory_kib // MEMORY_STEP_KIB)
    found += CODE_CACHE * (machine.core == "flash")
    found += next(ram for most, ram in SETTINGS if len(axes) <= most)
    found += RECORDER * count("recorder") + SEGMENT_TABLE * count("segments")
    own = count("harmonics", "own_chain")
    found += own + -(-(count("harmonics") - own) // HARMONICS_AXES)
    if count("velocity"):
        found += MICROCODE + ENGINE * -(-len(axes) // ENGINE_AXES)
    found += ETHERNET_RAM * bool(machine.ip_address)
    found += sum(ram for link, ram in LINK_RAM.items() if link in machine.peripherals)
    found += I2C_RAM * ("i2c" in machine.peripherals) + SET_POINTS_RAM * (count("set_points") > 0)
    if machine.scope_words:
        found += -(-machine.scope_words // SCOPE_STEP_WORDS) + WAVEFORM
    return found


def estimate(family: str, machine: Machine, interface: str = "", spram: bool = False) -> Size:
    """The size of a node for this machine; over Ethernet, with this interface to the PHY. With
    `spram`, the memory of the soft core is no block RAM.
    """
    axes = machine.axes
    if machine.orders:
        return Size(RELAY, RELAY_BLOCK_RAM)
    if family == "ice40":
        lut = COUNTING_NODE + (len(axes) - 4) * COUNTING_AXIS
        block_ram = ICE40_BLOCK_RAM + ICE40_CAPTURE * sum(axis.has("capture") for axis in axes)
        if machine.core != "serial":
            lut += STEP_NODE - 2 * STEP_AXIS
            block_ram += 0 if spram else ICE40_KIB * machine.memory_kib
        return Size(lut, block_ram)
    sine = any(axis.has("sine") for axis in axes)
    shared = SINE_NODE - 2 * SINE_AXIS if sine else STEP_NODE - 2 * STEP_AXIS
    block_ram = ecp5_block_ram(machine)
    if family == "xc7":  # twice as large
        block_ram = -(-block_ram // 2)
    shared += PERIPHERALS * any(name not in LINKS for name in machine.peripherals)
    linked = any(name in LINKS for name in machine.peripherals) or bool(machine.ip_address)
    shared += LINK * linked + CODE_LUT * (machine.core == "flash")
    if machine.ip_address:
        shared += ETHERNET[interface]
    if followers := sum(axis.has("set_points") for axis in axes):
        shared += SET_POINTS + (followers - 1) * SET_POINTS_AXIS
    return Size(shared + sum(map(axis_lut, axes)), block_ram)


def tick_cycles(machine: Machine) -> int:
    """Cycles of the motion engine for a servo tick, at most; 0 without an engine."""
    if not any(axis.has("velocity") for axis in machine.axes):
        return 0
    filters = next((n for size, n in TICK_FILTERS.items() if size >= machine.filters), 0)
    return TICK + len(machine.axes) * (TICK_AXIS + filters)

# SPDX-License-Identifier: Apache-2.0
"""The numbers that the firmware and a node without hardware share: the register map and the tables
of the bus.
"""

import re

from tables import bus
from twin.build import FIRMWARE

DEFINES = {
    name: int(value.rstrip("u"), 0)
    for name, value in re.findall(
        r"^#define (\w+)\s+(0x[0-9a-fA-F]+u?|\d+u?)\b",
        (FIRMWARE / "made" / "registers.h").read_text(),
        re.M,
    )
}
TABLE = bus.read()
CAUSE: dict[int, str] = {code: name for name, (code, _) in TABLE["cause"].items()}
STATE: dict[int, str] = {code: name for name, (code, _) in TABLE["state"].items()}
FAULT = {name: 1 << bit for name, (bit, _) in TABLE["fault"].items()}
FLAG = {name: 1 << bit for name, (bit, _) in TABLE["flag"].items()}
PARAMETER = TABLE["parameter"]
CLK_HZ = 4_000_000
PERIOD = 65536
LOW_WORDS = {  # addresses of those that wait until their high words are written
    base + DEFINES[f"{block}_BASE"] + offset
    for block in ("AXIS", "FEEDBACK", "ACTUATOR")
    for base in range(0, DEFINES["FEEDBACK_BASE"] - DEFINES["AXIS_BASE"], DEFINES["AXIS_STRIDE"])
    for name, offset in DEFINES.items()
    if name.startswith(block) and name.endswith("_LOW")
    if DEFINES.get(f"{name.removesuffix('_LOW')}_HIGH") == offset + 4
}
INDEX, SOFTWARE = 1 << 0, 1 << 2  # bits of capture_sources
END_OF_MAP = 1 << 16  # the port of the flash begins here


def signed(value: int, bits: int) -> int:
    """The number that the low `bits` of a word hold as two's complement."""
    return value - (1 << bits) if value >> bits - 1 & 1 else value

# SPDX-License-Identifier: Apache-2.0
"""Make rtl/control/engine_words.sv: which registers are words of motion_engine.

The property `engine` of a register in tables/registers.rdl is the name of its word, one of the
settings in tables/microcode/numbers.py, with the bits by which its value is shifted left. A word of
the engine has the number of its register with bit 4 inverted.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tables import made_files, registers
from tables.microcode.numbers import SETTINGS

MADE = made_files.ROOT / "rtl" / "control" / "engine_words.sv"
BLOCKS = ("axis", "feedback", "actuator")  # by their kind
BASE, BLOCKS_OF_KIND = 0x400, 8  # byte address of the first block, blocks of each kind
GAINS = ("kp", "kd", "kv", "ka")  # after whose change the integral takes what keeps the command
PUSH = "segment_ticks"  # a write of it queues the segment
SEGMENT = "segment_"  # how the words of a segment begin
FILTER_ADDRESS, FILTER_VALUE = "filter_address", "filter_value"  # of all values of the filters


@dataclass(frozen=True)
class Word:
    """A register that is a word of the engine; `kind` and `at` of its (high) word in the map."""

    kind: int
    at: int
    name: str
    shift: int
    wide: bool
    signed: bool

    @property
    def places(self) -> int:
        """Bits, in pairs, by which the value is shifted right from the top of 64 bits."""
        return 0 if self.wide else 16 - self.shift // 2

    @property
    def entry(self) -> str:
        return registers.literal(8, self.kind << 6 | self.at)


def words() -> list[Word]:
    found = []
    for block in registers.read():
        for r in block.registers:
            if not r.engine:
                continue
            if block.name not in BLOCKS:
                raise ValueError(f"registers.rdl: {block.name}.{r.name} is of no axis")
            kind = BLOCKS.index(block.name)
            if block.base != BASE + kind * BLOCKS_OF_KIND * registers.SLOT:
                raise ValueError(f"registers.rdl: the block {block.name} is not where it should be")
            name, _, shift = r.engine.partition(" << ")
            number = SETTINGS.get(name)
            if number is None and name not in (FILTER_ADDRESS, FILTER_VALUE):
                raise ValueError(f"registers.rdl: {r.name}: the engine has no word {name}")
            if number not in (None, r.word + r.wide ^ 0x10):
                raise ValueError(f"registers.rdl: {r.name}: the word {name} has another number")
            if r.fields[0].low or (len(r.fields) > 1 and r.fields[0].signed):
                raise ValueError(f"registers.rdl: {r.name}: its value is not the whole word")
            signed = r.fields[0].signed
            found.append(Word(kind, r.word + r.wide, name, int(shift or 0), r.wide, signed))
    missing = {*SETTINGS} - {w.name for w in found}
    if missing:
        raise ValueError(f"registers.rdl: no register is the word {sorted(missing)[0]}")
    return found


def case(found: Sequence[Word], output: str) -> list[str]:
    """A case that sets an output for these words."""
    if not found:
        return []
    entries = ", ".join(w.entry for w in found)
    return [f"        case (entry) {entries}: {output} = 1'b1; default: ; endcase"]


def text() -> str:
    found = words()
    shifted = [
        f"            {', '.join(w.entry for w in found if w.places == places)}: "
        f"places = 5'd{places};"
        for places in sorted({w.places for w in found} - {16})
    ]
    flags = {
        "of_engine": [w for w in found if w.name != FILTER_ADDRESS],
        "wide": [w for w in found if w.wide],
        "has_sign": [w for w in found if w.signed and not w.wide],
        "gain": [w for w in found if w.name in GAINS],
        "push": [w for w in found if w.name == PUSH],
        "segment": [w for w in found if w.name.startswith(SEGMENT)],
        "filter_address": [w for w in found if w.name == FILTER_ADDRESS],
        "filter_value": [w for w in found if w.name == FILTER_VALUE],
    }
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// engine_words -- report what motion_engine does with a word of the register map.
//
// latency   0 cycles, combinational
// rate      one word per cycle
// source    tables/registers.rdl
// model     tb/control/engine_words.py, equal for every word
// made      by tables/engine_words.py, not to be edited
`default_nettype none

module engine_words (
    input wire [1:0] kind,  // number of the kind of block: 0 axis, 1 feedback channel, 2 actuator
    input wire [5:0] word,  // word of the block
    output logic [4:0] places,  // pairs of bits: shift to the right from the top of 64 bits
    output logic of_engine,  // level: the engine has this word
    output logic wide,  // level: it is the high word of a value of 64 bits
    output logic has_sign,  // level: its value has 32 bits or less and is signed
    output logic gain,  // level: it is a gain of the servo
    output logic push,  // level: a write of it queues the segment
    output logic segment,  // level: it is a word of the segment
    output logic filter_address,  // level: it is the number of a value of a filter
    output logic filter_value  // level: it is the value of a filter
);
    wire [7:0] entry = {kind, word};

    always_comb begin
        case (entry)""",
            *shifted,
            """            default: places = 5'd16;
        endcase""",
            f"        {{{', '.join(flags)}}} = '0;",
            *(line for output, some in flags.items() for line in case(some, output)),
            """    end
endmodule

`default_nettype wire
""",
        ]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    def make() -> dict[Path, str | None]:
        return {MADE: made_files.systemverilog(text())}

    return made_files.main(__doc__, make, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make three modules from the microcode of motion_engine: engine_microcode.sv (the program),
engine_memory.sv (the words at power-up) and engine_regions.sv (for a proof), all in rtl/control.

In tables/microcode are the program (program.txt), the numbers of all that a line can name
(numbers.py), the assembler (assembler.py), and what a tick takes at most (timing.py).
"""

import sys
from pathlib import Path

from tables import made_files
from tables.microcode.assembler import LINES, assembled, codes
from tables.microcode.numbers import ADDRESS, CONSTANTS
from tables.microcode.timing import REGIONS, regions, worst

RTL = made_files.ROOT / "rtl" / "control"
MADE = RTL / "engine_microcode.sv"
MEMORY = RTL / "engine_memory.sv"
PROOF = RTL / "engine_regions.sv"


def text() -> str:
    lines = assembled()
    rows = [
        f"        lines[{n}] = 36'h{code:09x};  // {line}".rstrip()
        for n, (line, code) in enumerate(codes())
    ]
    bounds = [worst(lines, filters) for filters in range(5)]
    between = bounds[0][0]
    choice = " : ".join(f"FILTERS == {n} ? {axis}" for n, (_, axis) in enumerate(bounds[:-1]))
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// engine_microcode -- the microcode of motion_engine: what it does at a tick and between two ticks,
// line by line.
//
// latency   1 cycle from next and target to their codes
// rate      two lines per cycle: the one that follows, and the one that a jump leads to
// method    A code is target or action 10 bits, unless 1, condition 6, word 6, operand 7, acc 1,
//           sign 1, effect 4.
// model     codes() and worst() of tables/engine_microcode.py
// made      by tables/engine_microcode.py, not to be edited
`default_nettype none

module engine_microcode #(
    parameter int AXES        = 1,  // axes of the engine, 1 to 8
    parameter int FILTERS     = 0,  // filters of each axis, 0 to 4
    parameter int TICK_CYCLES = 0   // cycles between two ticks; 0: not checked
) (
    input  wire         clk,
    input  wire  [ 9:0] next,        // number of a line to be read
    input  wire  [ 9:0] target,      // number of another one
    output logic [35:0] next_code,   // code of the line `next`
    output logic [35:0] target_code, // code of the line `target`
    output logic [15:0] cycles       // cycles that a tick needs at most
);""",
            f"    localparam int AXIS = {choice} : {bounds[-1][1]};",
            f"    localparam int CYCLES = {between} + AXES * AXIS;",
            "",
            "    if (TICK_CYCLES != 0 && TICK_CYCLES < CYCLES) begin : g_check",
            "        A_SERVO_TICK_HAS_TOO_FEW_CYCLES_FOR_THE_AXES u_error ();",
            "    end",
            "",
            "    assign cycles = 16'(CYCLES);",
            "",
            f'    (* rom_style = "block" *) logic [35:0] lines[0:{LINES - 1}];',
            "",
            "    initial begin",
            *rows,
            f"        for (int n = {len(rows)}; n < {LINES}; n++) lines[n] = '0;",
            """    end

    always_ff @(posedge clk) begin
        next_code   <= lines[next];
        target_code <= lines[target];
    end
endmodule

`default_nettype wire
""",
        ]
    )


def memory_text() -> str:
    rows = [
        f"            words[n*WORDS+{ADDRESS[name]}] = 72'h{value:x};  // {name}"
        for name, value in CONSTANTS.items()
    ]
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// engine_memory -- store the words of all axes of motion_engine: state, settings, queues, filters
// and constants.
//
// latency   1 cycle from read_at to stored, and from write to the new word
// rate      one word read and one written per cycle, which must not be the same
// limits    A word that is read in the cycle in which it is written has no certain value.
// model     tb/control/engine_memory.py, equal in every bit of every cycle
// made      by tables/engine_microcode.py, not to be edited
`default_nettype none

module engine_memory #(
    parameter int AXES = 1,  // axes of the engine, 1 to 8
    parameter int WORD_W = 7,  // bits of the address of a word of an axis: 7, or 8 with filters
    localparam int A = WORD_W + $clog2(AXES)  // bits of an address
) (
    input  wire         clk,
    input  wire  [A-1:0] read_at,   // address of the word to be read
    output logic [71:0] stored,     // word that was read
    input  wire         write,      // strobe: write a word
    input  wire  [A-1:0] write_at,  // address of that word
    input  wire  [71:0] word        // value of that word
);
    localparam int WORDS = 1 << WORD_W;

    (* no_rw_check *) logic [71:0] words[0:AXES*WORDS-1];

    initial begin
        for (int n = 0; n < AXES * WORDS; n++) words[n] = '0;
        for (int n = 0; n < AXES; n++) begin""",
            *rows,
            """        end
    end

    always_ff @(posedge clk) begin
        if (write) words[write_at] <= word;
        stored <= words[read_at];
    end
endmodule

`default_nettype wire
""",
        ]
    )


def regions_text() -> str:
    found = regions(assembled())
    rows, begin = [], 0
    for n in range(1, len(found) + 1):
        if n == len(found) or found[n] != found[begin]:
            number = REGIONS.index(found[begin])
            if number:
                rows.append(
                    f"        if (line >= 10'd{begin} && line <= 10'd{n - 1}) region = 3'd{number};"
                    f"  // {found[begin]}"
                )
            begin = n
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// engine_regions -- report which part of the microcode a line belongs to, for the proof of
// engine_sequencer.
//
// latency   0 cycles, combinational
// rate      one line per cycle
// model     tb/control/engine_regions.py, equal for every line
// made      by tables/engine_microcode.py, not to be edited
`default_nettype none

module engine_regions (
    input  wire  [9:0] line,   // number of a line
    output logic [2:0] region  // 0 idle, 1 idle and service, 2 service, 3 to the next axis, 4 begin
);
    always_comb begin
        region = 3'd0;""",
            *rows,
            """    end
endmodule

`default_nettype wire
""",
        ]
    )


def main(arguments: list[str] | None = None) -> int:
    def make() -> dict[Path, str | None]:
        return {
            MADE: made_files.systemverilog(text()),
            MEMORY: made_files.systemverilog(memory_text()),
            PROOF: made_files.systemverilog(regions_text()),
        }

    return made_files.main(__doc__, make, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make rtl/control/profile_microcode.sv: what profile_player does between two ticks, one addition
or subtraction per cycle.

A line is  TERMS [>> 1] [-> WORD] [; JOB [LABEL]]. TERMS are `acc`, the sum of the line before, and
one operand with + or -, or with `along` (+ if upward, else -) or `against` (the opposite). The sum
goes to acc, halved by >> 1, and unhalved to a word. The conditions `negative` and `positive` test
the sign of the sum of the line before.
"""

import re
import sys

from tables import made_files
from tables.made_files import ROOT

MADE = ROOT / "rtl" / "control" / "profile_microcode.sv"

# Words of the player's memory. The names in SHARED mean one of two words: that of a controlled
# stop, or that of the ramp of the rate.
WORDS = (
    "velocity",
    "acceleration",
    "jerk",
    "step",
    "ramp_area",
    "ramp_slope",
    "ramp_increment",
    "distance",
    "change",
    "low",
    "offset",
    "fraction",
    "left",
    "rate",
    "part",
    "base",
)
SHARED = (
    "area",
    "slope",
    "increment",
    "value",
)  # controlled stop: words 0 to 3, ramp of the rate: words 4 to 7
OUTSIDE = ("nothing", "limit", "curve", "setting", "full", "half", "queue_low", "queue_high")
OPERANDS = {
    name: first + n
    for first, names in ((0, WORDS), (16, SHARED), (24, OUTSIDE))
    for n, name in enumerate(names)
}
SIGNS = {"+": 0, "-": 1, "along": 2, "against": 3}
JOBS = (
    "next",
    "goto",
    "negative",
    "positive",
    "quotient",
    "loop",
    "multiply",
    "factor",
    "count_31",
    "word",
    "pop",
    "last",
    "starved",
    "ready",
    "cross",
    "crossed",
    "first",
    "later",
    "stopping",
    "wide",
    "arrived",
    "set_upward",
    "end",
    "arrive",
    "prepared",
    "wait",
    "make",
    "dispatch",
)

PROGRAM = """
        # acc is the step of target: keep it
wait:   acc                             ; wait begin
        # the sum is not used: velocity is read from the word named here, and acceleration from the
        # word named in the next line
make:   acc + step                      ; make wait
        change                          ; dispatch brake

# the rate comes one step nearer to its setting
        - limit
        # without a limit the rate is the setting at once
        - slope                         ; positive at_once
        # a ramp that has begun goes on
        rate                            ; negative distance
        # the smaller of limit and curve, unless curve is 0
choose: limit -> increment
        acc - curve
        - curve                         ; negative chosen
        curve                           ; positive chosen
        acc -> increment
chosen: rate                            ; stopping divide
distance: acc - setting -> value        ; goto law

# a controlled stop: slope becomes the acceleration in whole increments
brake:  - limit                         ; later law
        0                               ; positive stop
        0                               ; goto choose
divide: - change                        ; set_upward
        along change -> part
        increment -> base               ; count_31
double: acc + base -> base              ; loop double
digit:  part
        acc - base
        acc                             ; quotient smaller
        acc -> part
smaller: base >> 1
        acc -> base                     ; loop digit
        part
        acc - increment
        along change                    ; positive stop
        acc - part -> slope
        0 -> area
        # slope times quotient, highest bit first
square: acc + area -> area
        acc + slope -> area             ; multiply square
        acc + slope >> 1                ; wide stop
        acc -> area
        - slope
        - part                          ; negative law
        # otherwise it would be more than an increment
        0                               ; negative move

# bring `value` to zero: area is what the slope still adds while it falls to zero, one increment
# per step
law:    - slope
        value                           ; positive turn
        # what the slope still has to remove
        against value -> part
        acc - area
        limit                           ; negative fall
        acc - slope
        part                            ; negative fall
try:    acc - area
        acc - slope
        acc - increment
        limit                           ; negative move
        acc - slope
        acc - increment
        slope                           ; negative move
        acc + increment -> slope
        acc + area -> area              ; goto move
turn:   value                           ; set_upward
        # one tick without change before the next ramp
        against value -> part           ; arrived move
        acc - increment
        part                            ; positive try
        0                               ; first move
        rate                            ; stopping stop
        # the old setting: it may have changed since
        acc - value -> rate
        - part                          ; arrive advance
fall:   area                            ; first move
        acc - slope -> area
        slope
        acc - increment -> slope
move:   along slope -> change           ; stopping set
        acc + rate -> rate
        acc - full                      ; negative below
        0                               ; negative advance
        full -> rate                    ; goto advance
below:  0 -> rate                       ; goto advance

# the first tick of a profile
begin:  0 -> step
        0 -> change
        0 -> low
        0 -> offset
        0 -> fraction                   ; stopping brake
at_once: 0 -> slope
        0 -> area
        setting -> rate                 ; arrived advance

# the time advances; a segment is taken from the queue
advance: - offset -> base               ; ready go_on
load:   0                               ; last ended
        # counts the first word: two cycles from here to queue_low
        0                               ; starved brake
        0                               ; word
        queue_low                       ; word
        acc + queue_high -> velocity    ; word
        queue_low                       ; word
        acc + queue_high -> acceleration ; word
        queue_low                       ; word
        acc + queue_high -> jerk
        queue_high -> left              ; pop
        - left
        0                               ; positive load
        0                               ; crossed scale
go_on:  fraction
        acc + rate -> fraction
        acc - full
        acc                             ; negative scale
        # into the next interval
        acc -> fraction                 ; cross
        base
        acc + velocity -> base
        acceleration
        acc + velocity -> velocity
        acceleration
        acc + jerk -> acceleration
        left
        acc - full -> left
        - left
        0                               ; positive load

# offset = v / 2 + fraction (v + fraction a / 2)
scale:  - fraction
        velocity >> 1                   ; positive known
        fraction                        ; factor
slope_of: acc + acceleration >> 1       ; multiply slope_of
        acc >> 1
        acc + velocity -> part
        fraction                        ; factor
mean_of: acc + part >> 1                ; multiply mean_of
        acc -> part
        velocity >> 1
        acc + part
known:  acc -> offset
finish: acc + base
        acc - step -> change
set:    acc + step -> step
        acc + low -> low
        # half an LSB at the end of the profile
        acc + half                      ; prepared wait

ended:  0 -> offset                     ; end finish
stop:   - step -> change                ; end set
"""


def assembled() -> list[tuple[str, str, int]]:
    """(label or "", text, code) of each line."""
    lines: list[str] = []
    labels: dict[str, int] = {}
    for line in PROGRAM.splitlines():
        line = line.split("#")[0].strip()
        if found := re.match(r"(\w+):\s*(.*)", line):
            labels[found[1]], line = len(lines), found[2]
        if line:
            lines.append(" ".join(line.split()))
    names = {address: label for label, address in labels.items()}
    return [
        (names.get(address, ""), line, code_of(line, labels)) for address, line in enumerate(lines)
    ]


def code_of(line: str, labels: dict[str, int]) -> int:
    """The code of a line: target 7 bits, job 5, halved 1, acc 1, sign 2, operand 5, word 5."""
    found = re.fullmatch(
        r"(?:(acc)\b ?)?(?:(\+|-|along|against)? ?(\w+))?( >> 1)?(?: -> (\w+))?"
        r"(?: ; (\w+)(?: (\w+))?)?",
        line,
    )
    assert found, line
    acc, sign, operand, halved, word, job, label = found.groups()
    operand = "nothing" if operand in (None, "0") else operand
    code = labels[label] if label else 0
    for value, width in (
        (JOBS.index(job or "next"), 5),
        (bool(halved), 1),
        (bool(acc), 1),
        (SIGNS[sign or "+"], 2),
        (OPERANDS[operand], 5),
        (OPERANDS[word or "nothing"], 5),
    ):
        code = code << width | value
    return code


def text() -> str:
    rows = [
        f"        lines[{n}] = 26'h{code:07x};  // {label + ': ' if label else ''}{line}"
        for n, (label, line, code) in enumerate(assembled())
    ]
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// profile_microcode -- the microcode of profile_player: what it does between two ticks, line by
// line.
//
// latency   1 cycle from next to code
// rate      one line per cycle
// method    A code is target 7 bits, job 5, halved 1, acc 1, sign 2, operand 5, word 5.
// limits    Block memory would answer too late for the adder behind it, so the table is logic.
// model     assembled() of tables/profile_microcode.py
// made      by tables/profile_microcode.py, not to be edited
`default_nettype none

module profile_microcode (
    input  wire         clk,
    input  wire  [ 6:0] next,  // number of the line to be read
    output logic [25:0] code   // code of the line
);
    (* rom_style = "logic" *) logic [25:0] lines[0:127];

    initial begin""",
            *rows,
            f"""        for (int n = {len(rows)}; n < 128; n++) lines[n] = '0;
    end

    always_ff @(posedge clk) code <= lines[next];
endmodule

`default_nettype wire
""",
        ]
    )


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, lambda: {MADE: text()}, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make rtl/control/profile_microcode.sv: what profile_player does between two ticks, one addition
or subtraction a clk.

A line is  TERMS [>> 1] [-> WORD] [; JOB [LABEL]]. TERMS are `acc`, the sum of the line before, and
one place with + or -, or with
`along` (+ if upward, else -) or `against` (the reverse). The sum goes to acc, halved with >> 1, and
unhalved to a word. A condition
`negative` or `positive` asks for the sign of the sum of the line before.
"""

import re
import sys
from pathlib import Path

from tables import made_files

MADE = Path(__file__).resolve().parent.parent / "rtl" / "control" / "profile_microcode.sv"

# words of the player's memory; four of them are shared by the profile (or brake) and, from `area`
# on, chosen by what is at work
WORDS = (
    "velocity",
    "acceleration",
    "jerk",
    "step",
    "ramp_area",
    "ramp_slope",
    "ramp_pace",
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
SHARED = ("area", "slope", "pace", "value")  # brake: words 0 to 3, ramp of the rate: words 4 to 7
OUTSIDE = ("nothing", "limit", "curve", "setting", "full", "half", "queue_low", "queue_high")
PLACES = {
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
wait:   acc                             ; wait begin            # acc is what target grows by: kept
make:   acc + step                      ; make wait             # not added: velocity is read off the word named here,
        change                          ; dispatch brake        # and acceleration

# the rate, a step nearer to its setting
        - limit
        - slope                         ; positive at_once      # no limit
        rate                            ; negative distance     # in the middle of a ramp
choose: limit -> pace                                           # the smaller of limit and curve, if curve is not 0
        acc - curve
        - curve                         ; negative chosen
        curve                           ; positive chosen
        acc -> pace
chosen: rate                            ; stopping divide
distance: acc - setting -> value        ; goto law

# a brake: slope becomes the acceleration in whole paces
brake:  - limit                         ; later law
        0                               ; positive stop
        0                               ; goto choose
divide: - change                        ; set_upward
        along change -> part
        pace -> base                    ; count_31
double: acc + base -> base              ; loop double
digit:  part
        acc - base
        acc                             ; quotient smaller
        acc -> part
smaller: base >> 1
        acc -> base                     ; loop digit
        part
        acc - pace
        along change                    ; positive stop
        acc - part -> slope
        0 -> area
square: acc + area -> area                                      # slope times quotient, from the highest bit on
        acc + slope -> area             ; multiply square
        acc + slope >> 1                ; wide stop
        acc -> area
        - slope
        - part                          ; negative law
        0                               ; negative move         # from its other side it would be more than a pace

# bring `value` to zero: area is what the slope still adds while it falls to zero, pace by pace
law:    - slope
        value                           ; positive turn
        against value -> part                                   # what is left for the slope to take away
        acc - area
        limit                           ; negative fall
        acc - slope
        part                            ; negative fall
try:    acc - area
        acc - slope
        acc - pace
        limit                           ; negative move
        acc - slope
        acc - pace
        slope                           ; negative move
        acc + pace -> slope
        acc + area -> area              ; goto move
turn:   value                           ; set_upward
        against value -> part           ; arrived move          # a rest of one tick before the next ramp
        acc - pace
        part                            ; positive try
        0                               ; first move
        rate                            ; stopping stop
        acc - value -> rate                                     # the setting as it was: it may have changed since
        - part                          ; arrive advance
fall:   area                            ; first move
        acc - slope -> area
        slope
        acc - pace -> slope
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

# the time goes on; a segment is taken from the queue
advance: - offset -> base               ; ready go_on
load:   0                               ; last ended
        0                               ; starved brake         # counts the first word: two clk from here to queue_low
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
        acc -> fraction                 ; cross                 # into the next interval
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
way_of: acc + part >> 1                 ; multiply way_of
        acc -> part
        velocity >> 1
        acc + part
known:  acc -> offset
finish: acc + base
        acc - step -> change
set:    acc + step -> step
        acc + low -> low
        acc + half                      ; prepared wait         # half an LSB at the end of the profile, else nothing

ended:  0 -> offset                     ; end finish
stop:   - step -> change                ; end set
"""


def assembled():
    """(label or "", the words of the line, its code) of each line."""
    lines, labels = [], {}
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


def code_of(line, labels):
    """target 7, job 5, halved 1, acc 1, sign 2, place 5, word 5."""
    found = re.fullmatch(
        r"(?:(acc)\b ?)?(?:(\+|-|along|against)? ?(\w+))?( >> 1)?(?: -> (\w+))?(?: ; (\w+)(?: (\w+))?)?",
        line,
    )
    acc, sign, place, halved, word, job, label = found.groups()
    place = "nothing" if place in (None, "0") else place
    code = labels[label] if label else 0
    for value, width in (
        (JOBS.index(job or "next"), 5),
        (bool(halved), 1),
        (bool(acc), 1),
        (SIGNS[sign or "+"], 2),
        (PLACES[place], 5),
        (PLACES[word or "nothing"], 5),
    ):
        code = code << width | value
    return code


def text():
    rows = [
        f"        lines[{n:3}] = 26'h{code:07x};   // {label + ':' if label else '':14} {line}"
        for n, (label, line, code) in enumerate(assembled())
    ]
    return "\n".join(
        [
            """// SPDX-License-Identifier: Apache-2.0
// profile_microcode -- what profile_player does between two ticks, a line a clk; made by tables/profile_microcode.py, not to be edited.
//
// latency  1 clk from next to code      rate  one line per clk
// code     target 7 bits, job 5, halved 1, acc 1, sign 2, place 5, word 5
// model    assembled() of tables/profile_microcode.py
`default_nettype none

module profile_microcode (
    input  wire         clk,
    input  wire  [6:0]  next,
    output logic [25:0] code
);
    (* rom_style = "logic" *) logic [25:0] lines [0:127];       // block memory would answer too late for the adder behind it

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


def main(arguments=None) -> int:
    return made_files.main(__doc__, lambda: {MADE: text()}, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make rtl/control/engine_microcode.sv: what motion_engine does, one addition or subtraction per
line and cycle.

A line is  [LABEL:] [TERMS] [>> 8] [-> WORD] [; EFFECT or JOB, …]. TERMS are `acc`, the sum of the
line before, and one operand with + or -, or with `along` (+ if upward, else -) or `against` (the
opposite); without terms the line passes acc on. The sum goes to acc, divided by 256 with >> 8, and
undivided to a word. Effects and jobs are in the tables below.

The engine works on three lines at once: it fetches one while it reads the operand of the line
before and adds up the line before that. So what a line changes is known DISTANCE lines later, and
one line sooner to a condition, which is tested one cycle after its line is fetched. Where the
program needs it sooner, the assembler inserts lines that only pass acc on.
"""

import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tables import made_files

RTL = made_files.ROOT / "rtl" / "control"
MADE = RTL / "engine_microcode.sv"
MEMORY = RTL / "engine_memory.sv"
PROOF = RTL / "engine_regions.sv"

DISTANCE = 3  # lines from a change to the first line that can read it
TEST_DISTANCE = 2  # from a change to the first line whose condition depends on it
SEEN_DISTANCE = 1  # more, from a change of the axis to what is seen of it
LINES = 1024
FINISH = 12  # cycles between two axes, the scan and the tick, at most

# The words of an axis, by address. There are two banks: `area`, `slope` and so on mean the words of
# the feed override or, while `halting` is set, of a controlled stop.
BANK = ("area", "slope", "increment", "value")
RAMP = ("ramp_area", "ramp_slope", "ramp_increment", "distance")
STOP = ("stop_area", "stop_slope", "stop_increment", "step")
RAMP_AT, STOP_AT = 0x00, 0x10
STATE = (  # written by the engine; 0 after reset
    "context",
    "velocity",
    "acceleration",
    "jerk",
    "left",
    "fraction",
    "offset",
    "rate",
    "change",
    "anchor",
    "moved",
    "target",
    "target_velocity",
    "target_acceleration",
    "last_position",
    "run",
    "quiet",
    "speed",
    "measured",
    "error",
    "integral",
    "sum",
    "command",
    "total",
)
SCRATCH = ("part", "base", "magnitude", "limit")
# Written by the register bus. A word has the number of its register in its block with bit 4
# inverted (tables/engine_words.py checks it), so the bus needs no table of them, and most are above
# the words that the engine writes.
SETTINGS = {
    "trim_scale": 0x15,
    "step_ratio": 0x17,
    "following_limit": 0x18,
    "integral_limit": 0x0C,
    "kp": 0x30,
    "ki": 0x31,
    "kd": 0x32,
    "kv": 0x33,
    "ka": 0x34,
    "output_limit": 0x35,
    "dead_band": 0x36,
    "quantum": 0x37,
    "open_command": 0x39,
    "segment_velocity": 0x3D,
    "segment_acceleration": 0x3F,
    "segment_jerk": 0x20,
    "segment_ticks": 0x21,
    "stop_deceleration": 0x22,
    "stop_jerk": 0x23,
    "override": 0x24,
    "override_slope": 0x25,
    "override_curve": 0x26,
    "start_at": 0x27,
}
CONSTANTS = {
    "one": 1,
    "byte": 1 << 8,
    "half_byte": 1 << 7,
    "two16": 1 << 16,
    "two20": 1 << 20,
    "half_step": 1 << 23,
    "two24": 1 << 24,
    "longest": (1 << 24) - 1,
    "top": (1 << 31) - 1,
    "two31": 1 << 31,
    "range": (1 << 32) - 1,
    "full": 1 << 32,
    "two33": 1 << 33,
    "top34": (1 << 33) - 1,
    "range34": (1 << 34) - 1,
    "two36": 1 << 36,
    "two66": 1 << 66,
}
FILTER_SETTINGS = ("b0", "b1", "b2", "c1", "c2", "in_use")  # one bank of words per filter
FILTER_STATE = ("cut_off", "x1", "x2", "y1", "y2", "known", "filtering")
FILTER = {name: n for n, name in enumerate(FILTER_SETTINGS)} | {
    name: 8 + n for n, name in enumerate(FILTER_STATE)
}


def number_of(at: int) -> int:
    """How a line names the word at this address."""
    return at if at < 64 else 64 + (at >> 2) % 16


def addresses() -> dict[str, int]:
    """The address of every word in the memory of an axis; words of filters as of filter 0."""
    found = {name: RAMP_AT + n for n, name in enumerate(RAMP)}
    found |= {name: STOP_AT + n for n, name in enumerate(STOP)} | SETTINGS
    taken = {*found.values()}
    low = [at for at in range(48) if at not in taken]  # what the engine writes is here
    high = [at for at in range(48, 64) if at not in taken] + [4 * n + 3 for n in range(16, 31)]
    written = [*STATE, *SCRATCH]
    names, free = [*written, *CONSTANTS], [*low, *high]
    if len(taken) < len(found) or len(written) > len(low) or len(names) > len(free):
        raise ValueError(f"{len(names)} words for {len(low)} and {len(high)} addresses")
    return found | dict(zip(names, free)) | {name: 128 + n for name, n in FILTER.items()}


ADDRESS = addresses()
SLOT = ("velocity", "acceleration", "rest")  # of a segment in the queue
OUTSIDE = ("0", "product", "product_high", "product_low", "halve") + (
    "position",
    "elapsed",
    "period",
    "now",
    "flags",
    "shift_by",
    "setting",
    "take_up",
)
OPERANDS = (  # how a line names what it adds
    {name: number_of(at) for name, at in ADDRESS.items() if at < 128}
    | {name: 0x50 + n for name, n in FILTER.items()}
    | {f"head_{name}": 0x60 + n for n, name in enumerate(SLOT)}
    | {name: 0x68 + n for n, name in enumerate(BANK)}
    | {name: 0x70 + n for n, name in enumerate(OUTSIDE)}
)
WORDS = (  # how a line names where its sum goes
    {name: ADDRESS[name] for name in (*RAMP, *STOP, *STATE, *SCRATCH)}
    | {name: 0x30 + n for n, name in enumerate(BANK)}
    | {f"tail_{name}": 0x34 + n for n, name in enumerate(SLOT)}
    | {"setting": 0x37}  # the word of the setting that waits, if one does
    | {name: 0x38 + n for n, name in enumerate(FILTER_STATE)}
)
NOWHERE = 0x3F

# What a line does with its sum besides storing it. `below` and `above` clear acc unless the sum is
# negative, or is not; `divide` keeps acc if the sum is negative, and shifts the digit into y.
EFFECTS = (
    "none",
    "test",
    "below",
    "above",
    "shift_8",
    "x",
    "x_low",
    "x_high",
    "y",
    "y_low",
    "divide",
    "upward",
    "along",
)

FLAGS = (  # of an axis, saved in its word `context`
    "moving",
    "braking",
    "stopping",
    "last",
    "final",
    "ready",
    "arrived",
    "armed",
    "powered",
    "limited_up",
    "limited_down",
    "anchored",
    "rebased",
    "upward",
)
PASSING = ("ticking", "crossed", "first", "halting", "bounding")  # while an axis is served
REQUESTS = ("shift", "set", "push", "start", "arm", "stop", "gains")
CONDITIONS = {"never": 0} | {
    name: n
    for first, names in (
        (1, FLAGS),
        (16, PASSING),
        (21, ("quiet",)),
        (24, ("negative", "loop", "due", "asked", "wrapped", "empty", "full", "filters")),
        (32, tuple(f"{name}_seen" for name in REQUESTS)),
        (39, ("stepped", "down", "block_up", "block_down", "closed", "lost", "lost_off")),
        (46, ("powerless", "off", "start_now", "unfiltered")),
    )
    for n, name in enumerate(names, start=first)
}
GIVEN = (
    *("state", "target", "target_velocity", "velocity", "error", "command", "steps", "underrun"),
    "integral",  # has a strobe of its own, the others have result_valid and their number
)
ACTIONS = (
    {"load_context": 0x20, "first_axis": 0x21, "next_axis": 0x22, "sample": 0x23, "stand": 0x24}
    | {"finished": 0x25, "pop": 0x26, "push": 0x27, "empty": 0x28, "booted": 0x29}
    | {"first_filter": 0x2A, "next_filter": 0x2B}
    | {f"set {name}": 0x40 + CONDITIONS[name] for name in (*FLAGS, *PASSING)}
    | {f"clear {name}": 0x60 + CONDITIONS[name] for name in (*FLAGS, *PASSING)}
    | {f"give {name}": 0x80 + n for n, name in enumerate(GIVEN)}
    | {f"count {n}": 0xA0 + n for n in range(32)}
    | {f"done {name}": 0xC0 + n for n, name in enumerate(REQUESTS)}
)

PROGRAM = """
0                               ; load_context
        0                               ; next_axis
                                        ; unless wrapped boot
                                        ; booted

# between two ticks: write the setting that waits, serve the requests of one axis after the other;
# while there is nothing to do, the same line is fetched again and again, and no flip-flop changes
scan:                                   ; next_axis
rest:                                   ; if quiet rest
idle:   setting -> setting              ; if due tick
                                        ; unless asked scan
                                        ; sample
                                        ; goto requests

# at the tick: serve one axis after the other
tick:                                   ; set ticking
                                        ; first_axis
axis:   setting -> setting
        context                         ; load_context
                                        ; if shift_seen shift
                                        ; if start_now start
                                        ; goto measure

requests: context                       ; load_context
                                        ; unless shift_seen unshifted
shift:  anchor
        acc + shift_by -> anchor
        target
        acc + shift_by -> target        ; give target
        last_position
        acc + shift_by -> last_position ; done shift
        run
        acc + shift_by -> run           ; set rebased
                                        ; if start_now start
                                        ; if ticking measure
unshifted:                              ; unless set_seen unset
        position -> anchor              ; done set
        position -> target              ; give target
        0 -> moved                      ; set rebased
        0 -> step                       ; clear armed
        0 -> change                     ; stand
        0 -> target_velocity            ; give target_velocity
        0 -> target_acceleration        ; empty
unset:                                  ; unless push_seen unpushed
        one                             ; y
        segment_ticks                   ; x
        # a segment of 0 ticks that does not end the profile is left out
        - segment_ticks                 ; test
                                        ; done push
                                        ; if full unpushed
                                        ; if braking unpushed
                                        ; unless negative unpushed
        segment_velocity -> tail_velocity
        segment_acceleration -> tail_acceleration
        segment_jerk
        acc + product_high -> tail_rest
                                        ; push
unpushed:                               ; unless start_seen unstarted
start:                                  ; done start
                                        ; if moving unstarted
                                        ; if empty unstarted
                                        ; if stop_seen unstarted
                                        ; set moving
unstarted:                              ; if ticking measure
                                        ; unless arm_seen unarmed
                                        ; done arm
                                        ; set armed
unarmed:                                ; unless stop_seen unstopped
                                        ; done stop
                                        ; clear armed
                                        ; empty
                                        ; unless moving unstopped
                                        ; set braking
unstopped: flags -> context             ; give state
                                        ; goto scan

# velocity: distance by time between the last two steps, near the distance of the tick
measure: byte                           ; y
        position
        acc - last_position             ; x
        quantum                         ; x
        position -> last_position
        earlier_product -> total
        product -> magnitude            ; unless stepped still
        position                        ; unless down edge
        acc + quantum
edge:   acc -> base
        quiet
        acc + elapsed -> part
        acc - longest                   ; test
        period
        acc - elapsed -> quiet          ; unless anchored fresh
        base                            ; unless negative fresh
        acc - run -> measured
        base -> run                     ; goto divisor
fresh:  base -> run                     ; set anchored
        0 -> speed
                                        ; goto near
still:  quiet
        acc + period
        acc - longest                   ; below
        acc + longest -> quiet          ; unless anchored limits
# a time without step bounds the speed
        period
        acc - quiet
        acc - quiet                     ; test
        quiet -> part                   ; set bounding
        acc - longest                   ; unless negative limits
        acc                             ; test
        speed
        0                               ; if negative signed
        acc -> speed
                                        ; goto near
signed: speed                           ; test
# ratio = period / max(2 part, period), in 21 digits
divisor: part
        acc + part
        acc - period                    ; above
        acc + period -> base
        two20                           ; y
        period                          ; x
        base                            ; x
                                        ; count 20
        earlier_product
        acc - product                   ; divide
digit:  acc - halve                     ; divide, if loop digit
        quantum                         ; x, if bounding sign
        measured                        ; x, goto ratio
sign:                                   ; unless negative ratio
        - quantum                       ; x
ratio:  product >> 8
        acc -> part
        part
        halve
        halve
        halve -> part                   ; if bounding bounded
        acc -> speed                    ; goto near
bounded: speed                          ; if negative rising
        acc - part                      ; below
        acc + part -> speed             ; goto near
rising: acc - part                      ; above
        acc + part -> speed             ; goto near
limits: speed
near:   acc - total
        acc - magnitude                 ; below
        acc + magnitude
        acc + magnitude                 ; above
        acc - magnitude
        acc + total
        acc + half_byte >> 8
        acc - top                       ; below
        acc + range                     ; above
        acc - two31 -> measured         ; give velocity

# a start at a time: this tick, if the time has come
        one                             ; y, unless armed make
        now
        acc - start_at                  ; x_low
        product
        acc - two31                     ; test
                                        ; unless negative make
                                        ; clear armed
                                        ; if moving make
                                        ; if empty make
                                        ; set moving
# the target makes the step that was prepared
make:                                   ; unless moving made
        moved                           ; unless ready made
        acc + step -> moved             ; if final end
        acc >> 8
        acc >> 8
        acc >> 8
        acc + anchor -> target          ; give target
        step >> 8
        acc >> 8
        acc >> 8
        acc - top                       ; below
        acc + range                     ; above
        acc - two31 -> target_velocity  ; give target_velocity
        change >> 8
        acc >> 8
        acc >> 8
        acc - top                       ; below
        acc + range                     ; above
        acc - two31 -> target_acceleration ; goto made
# the last step rounds to the LSB, a half up
end:    acc + half_step >> 8            ; stand
        acc >> 8
        acc >> 8
        acc + anchor -> target          ; give target
        acc -> anchor
        0 -> moved
        0 -> step
        0 -> change
        0 -> target_velocity            ; give target_velocity
        0 -> target_acceleration

# the following error
made:   target
        acc - position
        acc - top                       ; below
        acc + range                     ; above
        acc - two31 -> error            ; test
        acc
        acc -> magnitude                ; unless negative positive
        - error -> magnitude
positive: - following_limit             ; test
        following_limit
                                        ; unless negative unlimited
        acc - magnitude                 ; test
unlimited: error                        ; test, give error

# the servo: without power the command is held, and the integral is 0
        error                           ; x, unless lost integrate
        0 -> integral                   ; clear powered
        0 -> sum                        ; if lost_off integrate
        command                         ; x
        two16                           ; y
        product -> sum
        error                           ; x
# the integral stays constant towards a limit, and within the dead band at standstill
integrate: ki                           ; y, if negative downward
        dead_band                       ; if block_up keep
        acc - magnitude                 ; if limited_up keep
                                        ; goto inside
downward: dead_band                     ; if block_down keep
        acc - magnitude                 ; if limited_down keep
inside: acc                             ; test
        integral                        ; if moving grow
                                        ; unless negative clamp
grow:   acc + product                   ; goto clamp
keep:   integral
clamp:  acc - integral_limit            ; below, first_filter
        acc + integral_limit
        acc + integral_limit            ; above
        acc - integral_limit >> 8 -> integral
        acc -> total                    ; give integral
        error                           ; x
        kp                              ; y
        target_velocity
        acc - measured                  ; x
        kd                              ; y
        earlier_product
        acc + total
        acc + product -> total
        target_velocity                 ; x
        kv                              ; y
        target_acceleration             ; x
        ka                              ; y
        earlier_product
        acc + total
        acc + product -> total
# after a change of the gains or the power the integral takes what keeps the command
        sum                             ; if lost asked
        - ki                            ; test
        total                           ; if gains_seen retake
                                        ; if powered asked
retake:                                 ; unless negative computed
        total
        acc - top34                     ; below
        acc + range34                   ; above
        acc - two33 -> part
        byte                            ; y
        sum
        acc - part                      ; x
        integral
        acc + product
        acc - integral_limit            ; below
        acc + integral_limit
        acc + integral_limit            ; above
        acc - integral_limit -> integral
        sum
computed:                               ; set powered
asked:  acc -> part                     ; clear limited_up
        acc - output_limit              ; clear limited_down
        acc - two16                     ; test, done gains
        output_limit                    ; if negative lower
        acc -> sum                      ; set limited_up
                                        ; goto sample
lower:  part
        acc + output_limit              ; test
        part                            ; unless negative neither
        - output_limit                  ; set limited_down
neither: acc -> sum

sample: acc -> base                     ; if closed section
        open_command                    ; x
        two16                           ; y
        product -> base
section:                                ; unless filters filtered
        base -> part                    ; if lost track
        filtering                       ; test
        b0                              ; x
        - in_use                        ; test, unless negative pass
        base                            ; y
        b1                              ; x, unless negative pass
        x1                              ; y
        earlier_product
        acc + cut_off
        acc + product -> total
        b2                              ; x
        x2                              ; y
        c1                              ; x
        y1                              ; y
        earlier_product
        acc + total
        acc + product -> total
        c2                              ; x
        y2                              ; y
        one                             ; y
        total
        acc + earlier_product >> 8 -> total
        acc >> 8
        acc >> 8
        acc >> 8
        acc -> magnitude
        acc - top                       ; below
        acc + range                     ; above
        acc - two31 -> part
        total                           ; x_low
        magnitude
        acc - part                      ; test
        product -> cut_off
        part                            ; if negative cut
        acc - magnitude                 ; test
                                        ; unless negative shift_in
cut:    0 -> cut_off                    ; goto shift_in
pass:   0 -> cut_off
shift_in: known                         ; test
        - in_use
                                        ; if negative newer
track:  0
newer:  acc -> filtering
        - one -> known
        x1 -> x2
        base -> x1
        part -> base
        y1 -> y2
        part -> y1                      ; next_filter
                                        ; goto section

filtered: output_limit >> 8             ; unless closed open
        acc >> 8
        acc -> magnitude
        sum                             ; if lost held
        base
held:   acc >> 8
        acc >> 8
        acc -> command                  ; if unfiltered commanded
        acc -> part
        magnitude
        acc - part                      ; test
        magnitude
        acc + part                      ; if negative too_high
        acc                             ; test
        part
        acc -> command                  ; unless negative commanded
        - magnitude -> command          ; set limited_down
                                        ; goto commanded
too_high: magnitude -> command          ; set limited_up
                                        ; goto commanded
open:   open_command -> command         ; clear limited_up
                                        ; clear limited_down
commanded: acc                          ; test, give command
        acc                             ; x, unless powerless trim
        0 -> integral                   ; clear powered
        0 -> sum                        ; if off trim
        command                         ; x
        two16                           ; y
        product -> sum

# the target in motor steps, with the command as a trim, and with what takes up the backlash
trim:   trim_scale                      ; y
        target                          ; if negative trim_down
                                        ; if block_up untrimmed
                                        ; goto trimmed
trim_down:                              ; if block_down untrimmed
trimmed: acc + product
untrimmed: acc + take_up -> part        ; y_low
        step_ratio                      ; x_low
        step_ratio                      ; x_high
        acc
        earlier_product_low
        acc + product -> total
        part >> 8
        acc >> 8
        acc >> 8
        acc >> 8
        acc                             ; y
        step_ratio                      ; x_low
        total
        acc + earlier_product_high
        acc + product                   ; give steps
                                        ; clear rebased

# the profile: prepare the step of the next tick
        - offset -> base                ; unless moving prepared
        override_slope -> limit         ; if braking stop
        override_curve -> magnitude     ; unless ready begin
        - override_slope                ; test
        - ramp_slope                    ; unless negative at_once
        acc                             ; test
        rate                            ; if negative toward
# the smaller of limit and curve, which is in magnitude, unless the curve is 0
choose: limit -> increment
        acc - magnitude                 ; test
        - magnitude                     ; if negative chosen
        acc                             ; test
        magnitude                       ; unless negative chosen
        acc -> increment
chosen: rate                            ; if halting divide
toward: acc - override -> distance      ; goto law

# a controlled stop: slope becomes the acceleration in whole increments
stop:   - stop_deceleration             ; test, set halting
        stop_deceleration -> limit      ; if stopping law
        stop_jerk -> magnitude          ; set stopping
                                        ; set first
                                        ; unless negative at_end
                                        ; goto choose
divide: increment                       ; x_low
        two31                           ; y
        - change                        ; upward
        product -> base
        along change -> part
        increment                       ; x_high
        base
        acc                             ; count 31
        acc + product_high -> base
        part
        acc - base                      ; divide
halves: acc - halve                     ; divide, if loop halves
        increment                       ; x_low
        increment                       ; x_high
        acc
        earlier_product
        acc + product_high -> slope
        part
        acc - slope -> part
        acc - increment                 ; test
        slope
        acc - two66                     ; unless negative at_end
        acc                             ; test
        slope                           ; x_low
        slope                           ; x_high
                                        ; unless negative at_end
        earlier_product
        acc + product_high
        acc + slope -> base
        product
        acc - two36                     ; test
        base
        halve -> area
        - slope                         ; unless negative at_end
        acc                             ; test
        - part                          ; if negative law
        acc                             ; test
                                        ; if negative move

# bring `value` to zero: area is what the slope still adds while it falls to zero, one increment
# per step
law:    - slope                         ; test
        limit                           ; unless negative turn
        acc - slope                     ; test
        against value -> part
        acc - area                      ; if negative fall
        acc                             ; test
        part                            ; if negative fall
try:    acc - area
        acc - slope
        acc - increment                 ; test
        limit
        acc - slope                     ; if negative move
        acc - increment
        acc                             ; test
        slope                           ; if negative move
        acc + increment -> slope
        acc + area -> area              ; goto move
turn:   value                           ; upward
        0                               ; if halting measure_left
        0                               ; unless arrived measure_left
                                        ; clear arrived
                                        ; goto move
measure_left: against value -> part
        acc - increment                 ; test
        part
                                        ; unless negative try
# less than an increment is left: the last change
                                        ; if first move
        rate                            ; if halting at_end
        acc - distance -> rate
        - part                          ; test
                                        ; unless negative advance
                                        ; set arrived
                                        ; goto advance
fall:   area                            ; if first move
        acc - slope -> area
        slope
        acc - increment -> slope
move:   along slope -> change           ; if halting settle
        acc + rate                      ; above
        acc - full                      ; below
        acc + full -> rate              ; goto advance

begin:  0 -> offset
        0 -> fraction
        0 -> base
at_once: 0 -> ramp_slope                ; clear arrived
        0 -> ramp_area
        override -> rate
# the time advances; a segment is taken from the queue
advance:                                ; if ready go_on
load:                                   ; if last ended
                                        ; unless empty take
# a segment is missing: the acceleration stays for this tick, and then a controlled stop begins
                                        ; give underrun
                                        ; set braking
        change                          ; empty
                                        ; goto settle
take:   head_rest
        acc + two31                     ; x_high
        one                             ; y
        head_velocity -> velocity       ; clear last
        head_acceleration -> acceleration
        head_rest
        acc - product_high -> jerk
        product -> left
        acc - two24                     ; test
        acc                             ; pop
        acc                             ; if negative loaded
        acc -> left                     ; set last
loaded: - left                          ; test
                                        ; unless negative load
                                        ; if crossed scale
go_on:  fraction
        acc + rate -> fraction
        acc - full                      ; test
        base
                                        ; if negative scale
# into the next interval
        acc + velocity -> base
        velocity
        acc + acceleration -> velocity
        acceleration
        acc + jerk -> acceleration
        left
        acc - one -> left
        acc - one                       ; test
        fraction
        acc - full -> fraction          ; set crossed
                                        ; if negative load
# offset = velocity / 2 + fraction (velocity + fraction acceleration / 2)
scale:  - fraction                      ; test
        fraction                        ; y_low
        acceleration                    ; x_low
        acceleration                    ; x_high
        velocity                        ; unless negative half
        earlier_product_low
        acc + product -> part
        part
        halve
        acc + velocity -> part          ; x_low
        part                            ; x_high
        acc
        earlier_product_low
        acc + product -> part
        velocity
        halve
        acc + part -> offset            ; goto finish
half:   halve -> offset
finish: acc + base
        acc - step -> change
        acc + step -> step              ; set ready
                                        ; goto prepared
ended:  0 -> offset                     ; set final
                                        ; goto finish

at_end: - step -> change                ; set final
settle: acc + step -> step              ; set ready
prepared: flags -> context              ; give state
                                        ; next_axis
                                        ; unless wrapped axis
                                        ; finished
                                        ; goto idle
"""


@dataclass
class Line:
    """A line of the program, and what of the engine it changes, reads and tests."""

    text: str
    label: str = ""
    acc: bool = True
    sign: int = 0
    operand: str = "0"
    effect: str = "none"
    word: str = ""
    condition: str = "never"
    unless: bool = False
    target: str = ""
    action: str = ""
    changes: set[str] = field(default_factory=set)
    reads: set[str] = field(default_factory=set)
    tests: set[str] = field(default_factory=set)

    def loads(self) -> bool:
        return self.effect[0] in "xy" or self.effect == "divide"


def parsed(text: str) -> Line:
    """The line of this text. A ValueError says what is wrong with it."""
    found = re.fullmatch(
        r"(?:(\w+):)?\s*(?:(acc)\b ?)?(?:(\+|-|along|against)? ?(\w+))?(?: >> (8))?"
        r"(?: -> (\w+))?(?: ?; (.*))?",
        text,
    )
    if not found:
        raise ValueError(f"engine_microcode: not a line: {text}")
    label, acc, sign, operand, divided, word, jobs = found.groups()
    line = Line(text, label or "", acc=bool(acc) or operand is None)
    if operand:
        line.operand = operand.replace("earlier_", "")
    line.sign = int(sign in ("-", "against"))
    effects = [f"shift_{divided}"] * bool(divided) + ["along"] * (sign in ("along", "against"))
    line.word = word or ""
    for job in (jobs or "").split(", ") if jobs else ():
        if job in EFFECTS:
            effects.append(job)
        elif found := re.fullmatch(r"(if|unless) (\w+) (\w+)", job):
            line.unless, line.condition, line.target = found[1] == "unless", found[2], found[3]
        elif found := re.fullmatch(r"goto (\w+)", job):
            line.unless, line.condition, line.target = True, "never", found[1]
        elif job in ACTIONS:
            line.action = job
        else:
            raise ValueError(f"engine_microcode: {job} in {text}")
    if len(effects) > 1 or (line.action and line.target):
        raise ValueError(f"engine_microcode: too much in one line: {text}")
    line.effect = effects[0] if effects else "none"
    if line.operand not in OPERANDS or (line.word and line.word not in WORDS):
        raise ValueError(f"engine_microcode: no such word: {text}")
    dependences(line)
    return line


QUEUE = {"empty", "full"}


def dependences(line: Line) -> None:
    """Fill in what a line changes at its end, reads when it is fetched, and tests."""
    word, operand = line.word, line.operand
    if word:
        line.changes.add(word)
        for n, name in enumerate(BANK):
            if word in (RAMP[n], STOP[n]):
                line.changes.add(name)
            if word == name:
                line.changes |= {RAMP[n], STOP[n]}
    line.reads.add(operand)
    if operand not in OUTSIDE:
        line.reads.add("axis")
    if operand in BANK:
        line.reads.add("halting")
    if operand.startswith("head_"):
        line.reads.add("queue")
    if operand in FILTER:
        line.reads.add("filters")
    if operand == "flags":
        line.reads |= {*FLAGS, "queue"}
    if operand in ("position", "elapsed"):
        line.reads.add("seen")
    condition = line.condition
    line.tests.add("queue" if condition in QUEUE else condition)
    if condition.endswith("_seen") or CONDITIONS[condition] >= CONDITIONS["stepped"]:
        line.tests.add("seen")
    if condition == "asked":
        line.tests.add("seen")
    if condition == "wrapped":
        line.tests.add("axis")
    action = line.action
    if line.effect in ("test", "upward"):
        line.changes.add("negative" if line.effect == "test" else "upward")
    if action.split(" ")[0] in ("set", "clear"):
        line.changes.add(action.split(" ")[1])
    if action == "load_context":
        line.changes |= {*FLAGS, *PASSING, "queue"} - {"ticking"}
    if action == "stand":
        line.changes |= {*FLAGS}
    if action in ("first_axis", "next_axis"):
        line.changes |= {"axis", "seen"}
    if action in ("pop", "push", "empty"):
        line.changes.add("queue")
    if action == "sample" or action.startswith("done"):
        line.changes.add("seen")
    if action.startswith("count"):
        line.changes.add("loop")
    if action in ("first_filter", "next_filter"):
        line.changes.add("filters")
    if action == "finished":
        line.changes |= {"due", "ticking"}


def source() -> list[Line]:
    """The lines of the program as written, after those that clear the words of an axis."""
    cleared = [*RAMP, *STOP, *STATE]
    texts = [f"{'boot: ' if not n else ''}0 -> {name}" for n, name in enumerate(cleared)]
    for text in PROGRAM.splitlines():
        text = " ".join(text.split("#")[0].split())
        if text:
            texts.append(text)
    lines = [parsed(text) for text in texts]
    labels = {line.label for line in lines}
    for line in lines:
        if line.target and line.target not in labels:
            raise ValueError(f"engine_microcode: no label {line.target}")
    return lines


def successors(lines: list[Line]) -> list[list[int]]:
    """The lines that may follow each line."""
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    found = []
    for n, line in enumerate(lines):
        follow = [] if line.target and line.condition == "never" and line.unless else [n + 1]
        found.append(follow + ([labels[line.target]] if line.target else []))
    return found


def distance_of(line: Line, later: Line) -> int:
    """How many lines after a line a later one may come at the earliest, if that depends on it."""
    read, tested = line.changes & later.reads, line.changes & later.tests
    needed = [DISTANCE + SEEN_DISTANCE * ("seen" in read)] * bool(read)
    needed += [TEST_DISTANCE + SEEN_DISTANCE * ("seen" in tested)] * bool(tested)
    if "product" in later.operand and "earlier_" not in later.text and line.loads():
        needed.append(DISTANCE)
    if later.effect == "along" and "upward" in line.changes:
        needed.append(2)
    return max(needed, default=0)


def missing(lines: list[Line]) -> tuple[int, int] | None:
    """(number of a line, lines that are missing before it), of the first that comes too soon."""
    before: list[list[int]] = [[] for _ in lines]
    for n, follow in enumerate(successors(lines)):
        for m in follow:
            if m < len(lines):
                before[m].append(n)
    for n, line in enumerate(lines):
        reached = {n}
        for distance in range(1, DISTANCE + SEEN_DISTANCE):
            reached = {b for r in reached for b in before[r]}
            needed = max((distance_of(lines[b], line) for b in reached), default=0)
            if needed > distance:
                return n, needed - distance
    return None


def assembled() -> list[Line]:
    """All lines, with those that only wait."""
    lines = source()
    while wait := missing(lines):
        n, count = wait
        if lines[n].operand == "halve" or "earlier_" in lines[n].text:
            raise ValueError(f"engine_microcode: no line may come before {lines[n].text}")
        fillers = [parsed("acc") for _ in range(count)]
        if lines[n].label:
            fillers[0].label, lines[n].label = lines[n].label, ""
        lines[n:n] = fillers
    return lines


# What stays as it is while an axis is served, unless the program itself changes it.
STEADY = (*PASSING, "lost", "lost_off", "powerless", "off", "closed", "stepped", "unfiltered") + (
    "moving",
    "ready",
    "braking",
    "stopping",
    "powered",
    "final",
)


def tested_later(lines: list[Line], follow: list[list[int]]) -> list[frozenset[str]]:
    """For each line, the steady conditions of which a value known before it matters: those that it
    or a later line tests before they change.
    """
    tested: list[frozenset[str]] = [frozenset()] * (len(lines) + 1)
    settled = False
    while not settled:
        settled = True
        for n in reversed(range(len(lines))):
            line = lines[n]
            later = frozenset().union(*(tested[m] for m in follow[n])) - line.changes
            found = later | ({line.condition} & {*STEADY})
            if found != tested[n]:
                tested[n], settled = found, False
    return tested


def longest(lines: list[Line], begin: str, end: int, filters: int, ticking: bool) -> list[int]:
    """The longest path from a label to the line `end`, both included, as the numbers of its lines.
    A jump back is taken once, to the next filter `filters` times; a repeated line counts as often
    as it is executed; and a condition that nothing changed is met again as it was.
    """
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    follow = successors(lines)
    bits = {name: 1 << n for n, name in enumerate(STEADY)}

    def mask(names: Iterable[str]) -> int:
        return sum(bits[name] for name in names if name in bits)

    tested = [mask(names) for names in tested_later(lines, follow)]
    changed = [mask(line.changes) for line in lines]
    given = [(0, 0)] * len(lines)  # (which conditions are known after a line, which of them hold)
    for n, line in enumerate(lines):
        verb, _, flag = line.action.partition(" ")
        if line.action == "load_context":
            given[n] = mask(name for name in PASSING if name != "ticking"), 0
        elif flag in STEADY and verb in ("set", "clear"):
            given[n] = bits[flag], bits[flag] * (verb == "set")

    def repeated(n: int) -> int:
        if lines[n].condition != "loop":
            return 1
        counts = [line.action for line in lines[:n] if line.action.startswith("count")]
        return int(counts[-1].split(" ")[1])

    def passes_on(n: int) -> bool:
        """Whether the next line follows, in whatever state."""
        return n != end and follow[n] == [n + 1] and not changed[n] and given[n] == (0, 0)

    fork = [*range(len(lines))]  # the next line from here that does more
    for n in reversed(range(len(lines) - 1)):
        if passes_on(n):
            fork[n] = fork[n + 1]
    memory: dict[tuple[int, tuple[int, ...], int, int], tuple[int, ...]] = {}

    def walk(begin: int, taken: tuple[int, ...], known: int, true: int) -> tuple[int, ...]:
        """The lines from here to the end, none if it is not reached."""
        n = fork[begin]
        known &= tested[n]
        true &= known
        key = n, taken, known, true
        if key not in memory:
            memory[key] = (n,) if n == end else branch(n, taken, known, true)
        return (*range(begin, n), *memory[key]) if memory[key] else ()

    def branch(n: int, taken: tuple[int, ...], known: int, true: int) -> tuple[int, ...]:
        line, count = lines[n], repeated(n)
        more, hold = given[n]
        stays = known & ~changed[n] & ~more
        facts = stays | more, true & stays | hold
        best: tuple[int, ...] = ()
        for m in follow[n]:
            if m == n:
                continue
            jumps = bool(line.target) and m == labels[line.target]
            after, now = facts, taken
            if bit := bits.get(line.condition, 0):
                value = jumps != line.unless
                if known & bit and bool(true & bit) != value:
                    continue
                if not facts[0] & bit:
                    after = facts[0] | bit, facts[1] | bit * value
            if line.condition == "filters" and filters == 0 and not jumps:
                continue
            if m <= n:
                most = filters if lines[m].label == "section" else 1
                if taken.count(m) >= most:
                    continue
                now = tuple(sorted((*taken, m)))
            rest = walk(m, now, *after)
            if rest and len(rest) + count > len(best):
                best = (n,) * count + rest
        return best

    first = {"ticking": ticking, "unfiltered": filters == 0} | dict.fromkeys(PASSING[1:], False)
    true = mask(name for name, value in first.items() if value)
    return list(walk(labels[begin], (), mask(first), true))


def worst(lines: list[Line], filters: int) -> tuple[int, int]:
    """Cycles at most (between a tick and the first axis, for each axis)."""
    sys.setrecursionlimit(10_000)
    wrapped = [n for n, line in enumerate(lines) if line.condition == "wrapped"]
    scan = next(n for n, line in enumerate(lines) if line.text.endswith("; goto scan"))
    # a tick may find the engine at the beginning of a request; the scan goes on to the next axis
    request = len(longest(lines, "requests", scan, filters, ticking=False)) + FINISH
    return request, len(longest(lines, "axis", wrapped[-1], filters, ticking=True))


def code_of(line: Line, labels: Mapping[str, int]) -> int:
    """The code of a line: target or action 10 bits, unless 1, condition 6, word 6, operand 7, acc
    1, sign 1, effect 4."""
    code = labels[line.target] if line.target else ACTIONS[line.action] if line.action else 0
    for value, width in (
        (line.unless, 1),
        (CONDITIONS[line.condition], 6),
        (WORDS[line.word] if line.word else NOWHERE, 6),
        (OPERANDS[line.operand], 7),
        (line.acc, 1),
        (line.sign, 1),
        (EFFECTS.index(line.effect), 4),
    ):
        code = code << width | int(value)
    return code


def codes() -> list[tuple[str, int]]:
    """(text, code) of each line."""
    lines = assembled()
    if len(lines) > LINES:
        raise ValueError(f"engine_microcode: {len(lines)} lines, {LINES} fit")
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    shown = [line.text.split(": ", 1)[-1] if ":" in line.text else line.text for line in lines]
    return [
        (f"{line.label}: {text}" if line.label else text, code_of(line, labels))
        for line, text in zip(lines, shown)
    ]


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


def reached(lines: list[Line], begin: int, ticking: bool, ends: set[int]) -> set[int]:
    """The lines that can be reached from one line, up to the lines that end it."""
    follow, found, left = successors(lines), set[int](), [begin]
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    while left:
        n = left.pop()
        if n in found:
            continue
        found.add(n)
        line = lines[n]
        after = follow[n]
        if line.condition == "ticking":
            jumps = ticking != line.unless
            after = [m for m in follow[n] if (m == labels[line.target]) == jumps]
        if n not in ends:
            left += after
    return found


REGIONS = ("idle", "shared", "serve", "leave", "enter")


def regions(lines: list[Line]) -> list[str]:
    """Where each line belongs: to the time between two ticks, to the service of an axis at a tick,
    to both, or to the steps from one axis to the next."""
    labels = {line.label: n for n, line in enumerate(lines) if line.label}
    last = max(n for n, line in enumerate(lines) if line.action == "next_axis")
    finished = next(n for n, line in enumerate(lines) if line.action == "finished")
    first = next(n for n, line in enumerate(lines) if line.action == "first_axis")
    leave, enter = set(range(last + 1, finished + 1)), set(range(labels["tick"] + 1, first + 1))
    serve = reached(lines, labels["axis"], True, {last})
    idle = reached(lines, 0, False, {labels["tick"]})
    found = []
    for n in range(len(lines)):
        if n in leave or n in enter:
            found.append("leave" if n in leave else "enter")
        elif n in serve:
            found.append("shared" if n in idle else "serve")
        else:
            found.append("idle")
    return found


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

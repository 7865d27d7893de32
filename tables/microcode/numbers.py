# SPDX-License-Identifier: Apache-2.0
"""The words of an axis in the memory of motion_engine, and the numbers of all that a line of its
microcode can name: operands, words, effects, conditions and actions.
"""

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

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/tick_recorder.sv: step() advances one cycle."""

TARGET, TARGET_VELOCITY, VELOCITY, ERROR, COMMAND, INTEGRAL = range(1, 7)  # signals
POSITION, PHASE, FINE_COMMAND, FAULTS, SIGNALS = range(7, 12)
LEVELS = {  # of the signals that are taken; a target that does not move has no velocity
    **{0: "sine_cosine", TARGET: "target", TARGET_VELOCITY: None, POSITION: "position"},
    **{PHASE: "interpolated", FINE_COMMAND: "fine_command", FAULTS: "faults", 11: "faults"},
    **{12: "interpolated", 13: "fine_command", 14: "faults", 15: "faults"},  # are no signals
}
CHANNELS = 8
TRIGGER = CHANNELS  # entry after the channels
EMPTY, WAITING, RECORDING, FULL = range(4)
ALWAYS, RISES, FALLS, BEYOND, BITS = range(5)
IDLE = dict(
    start=0,
    last=0,
    channels=0,
    trigger=0,
    trigger_mode=ALWAYS,
    level=0,
    length=1,
    every=1,
    earlier=0,
    delay=0,
    tick=0,
    ready=1,
    sine_cosine=0,
    target=0,
    position=0,
    interpolated=0,
    fine_command=0,
    faults=0,
    valid=0,
    integral_valid=0,
    result_axis=0,
    kind=0,
    result=0,
    read=0,
    rst=0,
)


def signed(word):
    """32 bits in two's complement."""
    return (word + (1 << 31)) % (1 << 32) - (1 << 31)


def channel(signal, axis=0):
    """The byte of a channel."""
    return axis << 4 | signal


def packed(*channels):
    """The settings of these channels."""
    return dict(
        last=len(channels) - 1, channels=sum(one << 8 * n for n, one in enumerate(channels))
    )


class TickRecorder:
    """step() returns (word, phase, available, triggered, seen_axis) after the cycle; word is None
    while what was read has not been written, seen_axis is None before the first sample.
    """

    def __init__(self, words=4096, axes=1):
        self.axes, self.words, self.memory, self.word = axes, words, [None] * words, None
        self.phase = EMPTY
        self.base = self.at = self.used = self.kept = self.passed = self.left = 0
        self.take = None
        self.begun = self.sampling = self.delaying = self.known = self.was_above = 0
        self.got, self.watched = set(), 0

    def entries(self, i):
        """The channels and what triggers, by signal and axis."""
        codes = [i["channels"] >> 8 * n & 0x7F for n in range(CHANNELS)] + [i["trigger"] & 0x7F]
        return [(code & 15, code >> 4) for code in codes]

    def seen_axis(self, i):
        """The axis whose levels are taken next."""
        if self.take is None:
            return None
        return self.entries(i)[self.take][1] if self.take <= TRIGGER else 0

    def step(self, **inputs):
        i = IDLE | inputs
        active, each = self.phase in (WAITING, RECORDING), i["last"] + 1
        if self.delaying:
            over = self.left <= 1 and i["ready"]
        else:
            over = not self.begun or (self.passed + 1) % 65536 >= i["every"]
        due = active and i["tick"] and over
        counted = i["valid"] and 1 <= i["kind"] <= COMMAND
        number = INTEGRAL if i["integral_valid"] else i["kind"]
        entries, match = self.entries(i), set()
        if self.sampling and (counted or i["integral_valid"]):
            match = {n for n, entry in enumerate(entries) if entry == (number, i["result_axis"])}
        taken = self.sampling and not match and self.take <= TRIGGER
        index = value = None
        if match:
            index, value = min(match), i["result"]
        elif taken and entries[self.take][0] in LEVELS and self.take not in self.got:
            name = LEVELS[entries[self.take][0]]
            index, value = self.take, i[name] if name else 0
        if due:
            index = None
        last_axis = i["result_axis"] == self.axes - 1
        ends = self.sampling and i["valid"] and i["kind"] == COMMAND and last_axis and not due
        hits = above = False
        if ends:
            seen = value if TRIGGER in match else self.watched
            above = signed(seen) >= signed(i["level"])
            hits = {
                ALWAYS: True,
                RISES: self.known and above and not self.was_above,
                FALLS: self.known and not above and self.was_above,
                BEYOND: above or signed(seen) <= signed(-signed(i["level"])),
                BITS: seen & i["level"] != 0,
            }.get(i["trigger_mode"], False)
        readable = self.available(i["length"])
        passes = i["read"] and readable

        if index is not None and index <= i["last"]:
            self.memory[(self.base + index) % self.words] = value
        else:
            self.word = self.memory[self.at]

        fits = self.used + 2 * each <= self.words
        ripe = self.kept == i["earlier"] or not fits
        counts = self.phase == RECORDING or self.delaying or hits and ripe and i["delay"] == 0
        last = not fits or i["length"] and (self.kept + 1) % 65536 >= i["length"]
        if active and i["tick"]:
            self.passed = 0 if due else (self.passed + 1) % 65536
            self.left -= self.left > 1
        if taken:
            self.take += 1
        self.got |= match
        if index is not None and (TRIGGER in match if match else index == TRIGGER):
            self.watched = value
        if ends:
            self.sampling, self.known, self.was_above = 0, True, above
            self.base = (self.base + each) % self.words
            if counts or not ripe:
                self.kept = (self.kept + 1) % 65536
                self.used += each
            else:
                self.at = (self.at + each) % self.words
            if hits and not self.delaying:
                self.left = i["delay"]
            self.delaying = not counts and hits and ripe
            if counts:
                self.phase = FULL if last else RECORDING
        if passes:
            self.used -= 1
            self.at = (self.at + 1) % self.words
        if due:
            self.begun, self.sampling, self.take, self.got = 1, 1, 0, set()
        if i["start"]:
            self.phase = WAITING
            self.begun = self.sampling = self.delaying = self.known = 0
            self.base = self.at = self.used = self.kept = self.passed = self.left = 0
            self.watched = 0
        if i["rst"]:
            self.phase, self.used = EMPTY, 0
            self.begun = self.sampling = self.delaying = self.known = 0
        return (
            self.word,
            self.phase,
            self.available(i["length"]),
            int(self.phase == RECORDING or bool(self.delaying)),
            self.seen_axis(i),
        )

    def available(self, length):
        """Words that can be read."""
        return self.used if self.phase == FULL or self.phase == RECORDING and not length else 0

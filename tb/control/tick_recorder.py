# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/tick_recorder.sv: step() advances one cycle."""

COMMAND = 5
SIGNALS = 10
TAKEN = (0, 1, 2, 6, 7, 8, 9)  # signals that are taken, in this order
EMPTY, WAITING, RECORDING, FULL = range(4)
ALWAYS, RISES, FALLS, BEYOND, BITS = range(5)
IDLE = dict(
    start=0,
    axis=0,
    signals=0,
    trigger_signal=0,
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
    result_axis=0,
    kind=0,
    result=0,
    read=0,
    rst=0,
)


def signed(word):
    """32 bits in two's complement."""
    return (word + (1 << 31)) % (1 << 32) - (1 << 31)


class TickRecorder:
    """step() returns (word, phase, available, triggered) after the cycle; word is None while what
    was read has not been written.
    """

    def __init__(self, words=4096):
        self.words, self.memory, self.word = words, [None] * words, None
        self.phase = EMPTY
        self.base = self.at = self.used = self.kept = self.passed = self.left = self.take = 0
        self.begun = self.sampling = self.delaying = self.known = self.was_above = 0
        self.got, self.watched = set(), None

    def step(self, **inputs):
        i = IDLE | inputs
        active, each = self.phase in (WAITING, RECORDING), i["signals"].bit_count()
        if self.delaying:
            over = self.left <= 1 and i["ready"]
        else:
            over = not self.begun or (self.passed + 1) % 65536 >= i["every"]
        due = active and i["tick"] and over
        given = (
            i["valid"]
            and self.sampling
            and i["result_axis"] == i["axis"]
            and 1 <= i["kind"] <= COMMAND
        )
        taken = self.sampling and not given and self.take < len(TAKEN)
        number = value = None
        if given:
            number, value = i["kind"], i["result"]
        elif taken:
            number = TAKEN[self.take]
            taken_values = (
                *(i["sine_cosine"], i["target"], 0, i["position"]),
                *(i["interpolated"], i["fine_command"], i["faults"]),
            )
            value = taken_values[self.take]
        new_value = not due and number is not None and not (taken and number in self.got)
        ends = given and i["kind"] == COMMAND and not due
        hits = above = False
        if ends:
            seen = value if i["trigger_signal"] == COMMAND else self.watched
            if seen is not None:
                above = signed(seen) >= signed(i["level"])
                hits = {
                    RISES: self.known and above and not self.was_above,
                    FALLS: self.known and not above and self.was_above,
                    BEYOND: above or signed(seen) <= signed(-signed(i["level"])),
                    BITS: seen & i["level"] != 0,
                }.get(i["trigger_mode"], False)
            hits = hits or i["trigger_mode"] == ALWAYS
        readable = self.available(i["length"])
        passes = i["read"] and readable

        if new_value and i["signals"] >> number & 1:
            below = (i["signals"] & (1 << number) - 1).bit_count()
            self.memory[(self.base + below) % self.words] = value
        else:
            self.word = self.memory[self.at]

        fits = self.used + 2 * each <= self.words
        ripe = self.kept == i["earlier"] or not fits
        counts = self.phase == RECORDING or self.delaying or hits and ripe and i["delay"] == 0
        last = not fits or i["length"] and (self.kept + 1) % 65536 >= i["length"]
        if active and i["tick"]:
            self.passed = 0 if due else (self.passed + 1) % 65536
            self.left -= self.left > 1
        self.take += bool(taken)
        if given and number in (1, 2):
            self.got.add(number)
        if new_value and number == i["trigger_signal"]:
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
        if i["rst"]:
            self.phase, self.used = EMPTY, 0
            self.begun = self.sampling = self.delaying = self.known = 0
        return (
            self.word,
            self.phase,
            self.available(i["length"]),
            int(self.phase == RECORDING or bool(self.delaying)),
        )

    def available(self, length):
        """Words that can be read."""
        return self.used if self.phase == FULL or self.phase == RECORDING and not length else 0

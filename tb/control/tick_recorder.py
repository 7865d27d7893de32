# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/control/tick_recorder.sv: step() advances one cycle."""

COMMAND = 5


class TickRecorder:
    """step() returns (word, recording, full) after the cycle; word is None while what was read has
    not been written.
    """

    def __init__(self, words=4096):
        self.words, self.memory, self.word = words, [None] * words, None
        self.recording = self.full = self.begun = self.taking = 0
        self.base = self.at = self.left = self.passed = 0

    def step(
        self,
        start=0,
        axis=0,
        signals=0,
        length=1,
        every=1,
        tick=0,
        ready=1,
        sine_cosine=0,
        valid=0,
        result_axis=0,
        kind=0,
        result=0,
        read=0,
        rst=0,
    ):
        due = self.recording and tick and (self.passed + 1 >= every if self.begun else ready)
        given = valid and self.taking and result_axis == axis and 1 <= kind <= COMMAND
        kept, was_full = None, self.full
        if due and signals & 1:
            kept = 0, sine_cosine
        elif not due and given and signals >> kind & 1:
            kept = (signals & (1 << kind) - 1).bit_count(), result
        if kept is None:
            self.word = self.memory[self.at]
        else:
            self.memory[(self.base + kept[0]) % self.words] = kept[1]
        if self.recording and tick:
            self.passed = 0 if due else (self.passed + 1) % 65536
        if due:
            self.begun = self.taking = 1
        elif given and kind == COMMAND:
            self.taking = 0
            self.base = (self.base + signals.bit_count()) % self.words
            self.left -= 1
            if self.left <= 0:
                self.recording, self.full = 0, 1
        if was_full and read:
            self.at = (self.at + 1) % self.words
        if start:
            self.recording, self.full, self.begun, self.taking = 1, 0, 0, 0
            self.base = self.at = self.passed = 0
            self.left = length
        if rst:
            self.recording = self.full = self.begun = self.taking = 0
        return self.word, self.recording, self.full

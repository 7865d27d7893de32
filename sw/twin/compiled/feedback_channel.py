# SPDX-License-Identifier: Apache-2.0
"""The registers of a feedback channel of a node without hardware."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from twin.compiled.tables import DEFINES, INDEX, signed


class FeedbackChannel:
    """The registers of a feedback channel. `burst(phases, every)` gives the 1024 words of a burst,
    which is full after `delay` polls.
    """

    def __init__(self) -> None:
        self.word: dict[int, int] = {}
        self.strobes: list[int] = []
        self.records: list[tuple[bool, int]] = []  # (phases, decimation) of each recording
        self.burst: Callable[[bool, int], Sequence[int]] | None = None
        self.spoiled, self.delay = False, 0
        self.waiting, self.taken, self.full = 0, 0, False
        self.words: Sequence[int] = []
        self.points: dict[int, int] = {}  # the table in force
        self.written: dict[int, int] = {}  # the table that is being written
        self.correction: dict[str, int] | None = None
        self.loads = 0
        # waiting captures, oldest first: the register `captured`, cycle, 2^-16 period
        self.captures: deque[tuple[int, int, int]] = deque()
        self.armed, self.latch = False, 0
        self.segments: dict[int, int] = {}
        self.use: dict[str, Any] | None = None  # the settings in force
        self.uses: list[bool | None] = []  # whether linear, of each use; None: out of force

    def capture(self, source: int, clk: int, position: int) -> None:
        """An event of this bit of capture_sources, which is captured if that is selected."""
        if self.word.get(DEFINES["FEEDBACK_CAPTURE_SOURCES"], 0) & source:
            self.captures.append((source, clk, position))

    def index(self, clk: int, position: int) -> None:
        """An index mark passes at a position."""
        each = self.word.get(DEFINES["FEEDBACK_INDEX"], 0) & DEFINES["FEEDBACK_INDEX_EACH_MASK"]
        if self.armed or each:
            self.armed = False
            self.capture(INDEX, clk, position)

    def read(self, offset: int) -> int:
        """A register of the feedback block."""
        d = DEFINES
        if offset == d["FEEDBACK_RECORDER_STATE"]:
            self.waiting -= 1
            self.full = bool(self.records) and self.burst is not None and self.waiting < 0
            return self.full | self.spoiled << 1
        if offset == d["FEEDBACK_RECORDER_WORD"]:
            assert self.full, "a word was read that is not there"
            self.taken += 1
            return self.words[(self.taken - 1) % len(self.words)]
        if offset == d["FEEDBACK_CAPTURE_STATE"]:
            present = d["FEEDBACK_CAPTURE_STATE_PRESENT_MASK"] * bool(self.captures)
            return present | self.word.get(offset, 0)
        if offset == d["FEEDBACK_CAPTURED"] and self.captures:
            return self.captures[0][0]
        if offset == d["FEEDBACK_CAPTURED_TIME"] and self.captures:
            return self.captures[0][1] & 0xFFFFFFFF
        if offset == d["FEEDBACK_CAPTURED_POSITION"] and self.captures:
            self.latch = self.captures[0][2] >> 32 & 0xFFFF
            return self.captures[0][2] & 0xFFFFFFFF
        if offset == d["FEEDBACK_CAPTURED_POSITION"] + 4:
            return self.latch
        if offset == d["FEEDBACK_SEGMENT_STATE"]:
            return (
                d["FEEDBACK_SEGMENT_STATE_IN_FORCE_MASK"] * (self.use is not None)
                | d["FEEDBACK_SEGMENT_STATE_KNOWN_MASK"]
            )
        if offset == d["FEEDBACK_SEGMENT_STORED"]:
            return self.segments.get(self.word[d["FEEDBACK_SEGMENT_READ"]], 0) & 0xFFFFFFFF
        return self.word.get(offset, 0)

    def wide(self, name: str, bits: int) -> int:
        """The signed number that was written to NAME_HIGH and NAME_LOW."""
        return signed(
            self.word[DEFINES[f"{name}_HIGH"]] << 32 & (1 << bits) - 1
            | self.word[DEFINES[f"{name}_LOW"]],
            bits,
        )

    def use_segments(self, value: int) -> None:
        """Put the segment table into force, or out of it, as the register segment_use demands."""
        self.use = (
            dict(
                linear=bool(value & 2),
                segments=value >> 2,
                length=self.wide("FEEDBACK_SEGMENT_LENGTH", 48),
                origin=self.wide("FEEDBACK_SEGMENT_ORIGIN", 48),
            )
            if value & 1
            else None
        )
        self.uses.append(self.use["linear"] if self.use else None)

    def write(self, offset: int, value: int) -> None:
        """Write a register of the feedback block."""
        d = DEFINES
        if offset in (d["FEEDBACK_CAPTURE_STATE"], d["FEEDBACK_COMPARE_STATE"]):
            self.word[offset] = self.word.get(offset, 0) & ~value  # writing 1 clears a bit
            return
        self.word[offset] = value
        if offset == d["FEEDBACK_SEGMENT_POINT"]:
            self.segments[value >> 24] = signed(value & 0xFFFFFF, 24)
        if offset == d["FEEDBACK_SEGMENT_USE"]:
            self.use_segments(value)
        if offset == d["FEEDBACK_HARMONIC_POINT"]:
            self.written[value >> 18 & 255] = signed(value & 0x3FFFF, 18)
        if offset == d["FEEDBACK_STROBES"]:
            self.strobes.append(value)
            self.armed = self.armed or bool(value & d["FEEDBACK_STROBES_ARM_INDEX_MASK"])
            if value & d["FEEDBACK_STROBES_CAPTURE_CLEAR_MASK"]:
                self.captures.clear()
            if value & d["FEEDBACK_STROBES_CAPTURE_NEXT_MASK"] and self.captures:
                self.captures.popleft()
            if value & d["FEEDBACK_STROBES_RECORD_MASK"]:
                setting = self.word[d["FEEDBACK_RECORDER"]]
                self.records.append((bool(setting >> 16 & 1), setting & 0xFFFF))
                self.waiting, self.taken, self.full = self.delay, 0, False
                self.words = self.burst(*self.records[-1]) if self.burst else []
            if value & d["FEEDBACK_STROBES_LOAD_CORRECTION_MASK"]:
                offsets = self.word[d["FEEDBACK_CORRECTION_OFFSET"]]
                self.correction = dict(
                    sin_offset=signed(offsets & 0xFFFF, 16),
                    cos_offset=signed(offsets >> 16, 16),
                    gain=self.word[d["FEEDBACK_CORRECTION_GAIN"]],
                    quadrature_error=signed(
                        self.word[d["FEEDBACK_CORRECTION_QUADRATURE_ERROR"]], 17
                    ),
                )
            if value & d["FEEDBACK_STROBES_SWAP_HARMONICS_MASK"]:
                assert len(self.written) == 256, "a table was put into force before it was complete"
                self.points, self.written, self.loads = self.written, {}, self.loads + 1

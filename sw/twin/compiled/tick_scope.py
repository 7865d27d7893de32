# SPDX-License-Identifier: Apache-2.0
"""The recorder of ticks of a node without hardware, and the excitation that begins with it."""

from collections.abc import Sequence

from twin.compiled.axis import Axis
from twin.compiled.tables import DEFINES, TABLE, signed


class TickScope:
    """The recorder of ticks and the excitation, by the registers of the node; a sample at once."""

    EMPTY, WAITING, RECORDING, FULL = range(4)  # scope_state of bus.toml

    def __init__(self, words: int) -> None:
        self.size = words
        self.word: dict[int, int] = {}
        self.waveform: dict[int, int] = {}
        self.samples: list[list[int]] = []
        self.recorded: list[int] = []  # words of a recording that has begun
        self.phase = self.EMPTY
        self.taken = self.passed = 0
        self.delay: int | None = None  # ticks that are left of it, while it runs
        self.was_above: bool | None = None  # the signal of the trigger; None: not seen yet

    def field(self, name: str) -> int:
        """A field of a setting, by its name in the header of the registers."""
        registers = ("SCOPE_SAMPLES", "SCOPE_PLACE", "SCOPE", "EXCITATION")
        register = next(d for d in registers if name.startswith(d))
        value = self.word.get(DEFINES[f"NODE_{register}"], 0)
        return (value & DEFINES[f"NODE_{name}_MASK"]) >> DEFINES[f"NODE_{name}_SHIFT"]

    def write(self, offset: int, value: int) -> None:
        """Write a register of the node."""
        self.word[offset] = value
        if offset == DEFINES["NODE_EXCITATION_VALUE"]:
            self.waveform[value >> 16 & 0xFFF] = signed(value & 0xFFFF, 16)
        if offset == DEFINES["NODE_SCOPE_LEVEL"]:
            self.samples, self.recorded, self.phase = [], [], self.WAITING
            self.taken, self.delay, self.was_above = 0, None, None
            self.passed = self.field("SCOPE_SAMPLES_EVERY")

    @property
    def available(self) -> int:
        """Words that can be read."""
        stream = self.phase == self.RECORDING and self.field("SCOPE_SAMPLES_LENGTH") == 0
        return len(self.recorded) - self.taken if stream or self.phase == self.FULL else 0

    def read(self, offset: int) -> int | None:
        """A register of the node; None if it is not one of these."""
        if offset == DEFINES["NODE_SCOPE_STATE"]:
            return self.phase | self.available << DEFINES["NODE_SCOPE_STATE_AVAILABLE_SHIFT"]
        if offset == DEFINES["NODE_SCOPE_WORD"]:
            assert self.available, "a word was read that is not there"
            self.taken += 1
            return self.recorded[self.taken - 1]
        return None

    def triggers(self, value: int) -> bool:
        """Whether this value of the signal of the trigger starts the recording."""
        level = signed(self.word[DEFINES["NODE_SCOPE_LEVEL"]], 32)
        above, before = value >= level, self.was_above
        self.was_above = above
        mode, modes = self.field("SCOPE_MODE"), TABLE["tick_trigger"]
        name = next((name for name, (code, _) in modes.items() if code == mode), None)
        return {
            "now": True,
            "rises": before is False and above,
            "falls": before is True and not above,
            "beyond": above or value <= -level,
            "bits": value & level != 0,
        }.get(name or "", False)

    @staticmethod
    def value(axis: Axis, signal: int) -> int:
        """A signal of an axis now; these axes have no integral and no fine stage."""
        return (
            axis.word.get(DEFINES["AXIS_SAMPLE"], 0),
            axis.target,
            0,
            axis.speed,
            axis.error,
            signed(axis.word.get(DEFINES["AXIS_COMMAND"], 0) & 0xFFFF, 16),
            0,
            axis.position,
            axis.position & 0xFFFF,
            0,
            axis.faults,
        )[signal]

    def tick(self, axes: Sequence[Axis]) -> None:
        """A servo tick has passed."""
        if self.phase not in (self.WAITING, self.RECORDING):
            return
        self.passed += 1
        if self.delay is not None:
            self.delay -= 1
            if self.delay > 0:
                return
        elif self.passed < self.field("SCOPE_SAMPLES_EVERY"):
            return
        self.passed = 0
        codes = (1 << DEFINES["NODE_SCOPE_LAST_WIDTH"]) * [0]
        for first in range(0, len(codes), 4):
            word = self.word.get(DEFINES[f"NODE_SCOPE_CHANNELS_{first}"], 0)
            codes[first : first + 4] = word.to_bytes(4, "little")
        chosen = codes[: self.field("SCOPE_LAST") + 1]
        sample = [self.value(axes[code >> 4 & 7], code & 15) & 0xFFFFFFFF for code in chosen]
        earlier, delay = self.field("SCOPE_PLACE_EARLIER"), self.field("SCOPE_PLACE_DELAY")
        seen = self.value(axes[self.field("SCOPE_AXIS")], self.field("SCOPE_TRIGGER"))
        hit = self.triggers(signed(seen & 0xFFFFFFFF, 32))
        if self.phase == self.WAITING and self.delay is None:
            ripe = len(self.samples) == earlier
            if not (hit and ripe and delay == 0):
                self.samples = [*self.samples, sample][-earlier:] if earlier else []
                self.delay = delay if hit and ripe else None
                return
        if self.phase == self.WAITING:
            self.recorded = [word for old in self.samples for word in old]
            self.phase = self.RECORDING
            self.delay = None
        self.recorded += sample
        used, each = len(self.recorded) - self.taken, len(sample)
        length = self.field("SCOPE_SAMPLES_LENGTH")
        if used + each > self.size or length and len(self.recorded) >= length * each:
            self.phase = self.FULL

# SPDX-License-Identifier: Apache-2.0
"""Position capture and position compare of an axis."""

from fractions import Fraction

from moire import units
from moire.client.access import AxisAccess
from moire.client.names import bit_names
from moire.client.records import Capture, Compare
from moire.errors import OutOfRange, UnknownName

CAPTURE_SOURCES = (
    "index",
    "tick",
    "software",
    "probe_0_rising",
    "probe_1_rising",
    "probe_0_falling",
    "probe_1_falling",
)
SOURCE_BITS = {bit: (name, name) for bit, name in enumerate(CAPTURE_SOURCES)}
POSITIONS = range(-(1 << 47), 1 << 47)  # counts that a register of positions holds
PULSE_CYCLES = range(1, 1 << 24)  # cycles that a register of pulse lengths holds
POINTS = range(1 << 32)
LONGEST_AGE = 65535  # cycles: the age of a capture that has this one or a longer one


class AxisCapture(AxisAccess):
    """The part of an axis that captures positions, and sends pulses at positions."""

    def capture_from(self, *sources: str) -> None:
        """Selects the events that capture the position; none: captures nothing from now on.

        Captures that wait to be read remain. Raises UnknownName for an unknown source.
        """
        bits = {1 << CAPTURE_SOURCES.index(capture_source(source)) for source in sources}
        self.write_feedback("capture_sources", value=sum(bits))
        if "index" in sources:
            self.write_feedback("strobes", arm_index=1)

    def capture_now(self) -> None:
        """Makes one capture of the source "software", if that is selected."""
        self.write_feedback("strobes", capture_now=1)

    def captures(self, most: int = 16) -> tuple[list[Capture], bool]:
        """Reads and removes the captures that wait, oldest first.

        The second result is whether some were lost since the last call.
        """
        found: list[Capture] = []
        overrun = bool(self.feedback("capture_state")["overrun"])
        while len(found) < most and self.feedback("capture_state")["present"]:
            captured = self.feedback("captured")
            found.append(
                Capture(
                    sources=bit_names(SOURCE_BITS, captured["sources"]),
                    position_nm=self.to_nm(self.feedback("captured_position")["value"]),
                    time_clk=self.feedback("captured_time")["value"],
                    age_s=captured["age"] / self.node.identity.clk_hz,
                )
            )
            self.write_feedback("strobes", capture_next=1)
        if overrun:
            self.write_feedback("capture_state", overrun=1)
        return found, overrun

    def compare(self) -> Compare:
        """The state of position compare."""
        state = self.feedback("compare_state")
        return Compare(
            bool(state["armed"]), self.feedback("compare_passed")["value"], bool(state["late"])
        )

    def compare_from(
        self,
        start: units.Value,
        step: units.Value,
        count: int = 0,
        pulse: units.Value = "1us",
        gap: units.Value = "1us",
    ) -> None:
        """Puts out pulses at start, start + step and so on: `count` of them, or endlessly for 0.

        Positions are in nm or texts with a unit; a negative step is for motion downwards. `pulse`
        is the length of a pulse and `gap` the shortest pause after it, in s or with a unit. Raises
        OutOfRange when a value does not fit.
        """
        positions = {"compare_start": self.to_counts(start), "compare_step": self.to_counts(step)}
        clk_hz = self.node.identity.clk_hz
        cycles = {
            "compare_pulse": round(units.parse_time(pulse) * clk_hz),
            "compare_gap": round(units.parse_time(gap) * clk_hz),
        }
        if positions["compare_step"] == 0 or not all(
            position in POSITIONS for position in positions.values()
        ):
            raise OutOfRange(
                "start and step must be lengths inside the range of positions, the step not zero"
            )
        if count not in POINTS or not all(length in PULSE_CYCLES for length in cycles.values()):
            shortest, longest = (
                units.format_time(Fraction(length, clk_hz))
                for length in (PULSE_CYCLES[0], PULSE_CYCLES[-1])
            )
            raise OutOfRange(
                f"pulse and gap allow {shortest} to {longest}, the count 0 to 2^32 - 1"
            )
        self.compare_off()
        for name, value in {**positions, "compare_count": count, **cycles}.items():
            self.write_feedback(name, value=value)
        self.write_feedback("compare_state", late=1)
        self.write_feedback("strobes", compare_arm=1)

    def compare_off(self) -> None:
        """Ends position compare."""
        self.write_feedback("strobes", compare_disarm=1)


def capture_source(name: str) -> str:
    """Returns the name of a source; raises UnknownName for any other."""
    if name not in CAPTURE_SOURCES:
        raise UnknownName(
            f"there is no capture source '{name}': known are {', '.join(CAPTURE_SOURCES)}"
        )
    return name

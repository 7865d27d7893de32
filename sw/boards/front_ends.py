# SPDX-License-Identifier: Apache-2.0
"""Front ends: the circuits between the pins of a board and the machine, one file each in
constraints/front_ends.
"""

from dataclasses import dataclass
from functools import cache

from boards.toml_file import ROOT, Misfit, Table, read

FOLDER = ROOT / "constraints" / "front_ends"
UNITS = ("ohm", "F", "piece")
PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"), (1e-12, "p"))


@dataclass(frozen=True)
class Part:
    """A part of the schematic."""

    ref: str
    part: str
    value: float
    unit: str
    tolerance_pct: float
    nets: list[str]  # both ends, for the parts that are simulated
    why: str

    @property
    def shown(self) -> str:
        """The value as a parts table names it."""
        if self.unit == "piece":
            return f"{self.value:g}"
        scale, prefix = next(pair for pair in PREFIXES if self.value >= pair[0] * 0.999)
        return f"{self.value / scale:.4g} {prefix}{self.unit}"


@dataclass(frozen=True)
class Analogue:
    """What the simulation of an analogue front end needs besides its parts."""

    signal: dict[str, float]
    amplifier: dict[str, float]
    converter: dict[str, float]
    sources: list[str]  # of the numbers of amplifier and converter
    boards: int  # of the Monte Carlo
    seed: int


@dataclass(frozen=True)
class FrontEnd:
    """A front end that has been checked by itself."""

    name: str
    file: str
    title: str
    purpose: str
    groups: list[str]  # of signals that it may serve
    volts: list[float]  # levels on the side of the board that it may have
    channels: int
    parts: list[Part]
    analogue: Analogue | None


SIGNAL = ("nominal_vpp", "highest_vpp", "common_mode", "common_mode_range", "highest_hz", "supply")
AMPLIFIER = (
    *("gain_bandwidth", "open_loop_gain", "noise", "current_noise"),
    *("offset", "rail", "swing"),
)
CONVERTER = ("bits", "reference", "reference_pct", "snr_db")


def numbers(table: Table, keys: tuple[str, ...]) -> dict[str, float]:
    found = {key: table.take(key, float) for key in keys}
    table.close()
    return found


def part_of(table: Table) -> Part:
    part = Part(
        table.take("ref", str),
        table.take("part", str),
        table.take("value", float),
        table.take("unit", str),
        table.take("tolerance_pct", float, 0.0),
        table.words("nets"),
        table.take("why", str),
    )
    table.close()
    if part.unit not in UNITS:
        raise table.misfit(f"the unit {part.unit!r} of {part.ref} is none of {', '.join(UNITS)}")
    if part.value <= 0:
        raise table.misfit(f"the value of {part.ref} must be more than 0")
    if len(part.nets) not in (0, 2):
        raise table.misfit(f"{part.ref} must have two nets, or none")
    return part


def analogue_of(table: Table) -> Analogue | None:
    if "analogue" not in table.left:
        return None
    signal = numbers(table.table("analogue"), SIGNAL)
    amplifier, converter = table.table("amplifier", True), table.table("converter", True)
    sources = [each.take("source", str) for each in (amplifier, converter)]
    check = table.table("check", True)
    boards, seed = check.take("boards", int), check.take("seed", int)
    check.close()
    if boards < 1:
        raise check.misfit("boards must be at least 1")
    return Analogue(
        signal,
        numbers(amplifier, AMPLIFIER),
        numbers(converter, CONVERTER),
        sources,
        boards,
        seed,
    )


def front_end_of(table: Table, name: str) -> FrontEnd:
    """The front end of the table of its file."""
    volts = table.take("volts", list)
    if not volts or not all(isinstance(each, float) for each in volts):
        raise table.misfit("volts must be a list of numbers with a decimal point")
    made = FrontEnd(
        name=name,
        file=table.file,
        title=table.take("title", str),
        purpose=table.take("purpose", str),
        groups=table.words("groups"),
        volts=volts,
        channels=table.take("channels", int),
        parts=[part_of(row) for row in table.rows("part")],
        analogue=analogue_of(table),
    )
    table.close()
    refs = [part.ref for part in made.parts]
    if twice := [ref for ref in refs if refs.count(ref) > 1]:
        raise table.misfit(f"two parts have the name {twice[0]}")
    return made


def names() -> list[str]:
    """All front ends of the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def unknown(name: str) -> str:
    """Why a front end is refused that the project does not have."""
    return f"there is no front end {name!r}; there are: {', '.join(names())}"


@cache
def named(name: str) -> FrontEnd:
    """A front end of the project."""
    if name not in names():
        raise Misfit(unknown(name))
    return front_end_of(read(FOLDER / f"{name}.toml"), name)

# SPDX-License-Identifier: Apache-2.0
"""The file of a study, in TOML: a machine, its specification, what is measured, and a distribution
for each effect. `moire study --example` prints one with all effects.

Each error names the file and the line.
"""

import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from statistics import NormalDist
from typing import Any, NoReturn

from moire import units
from moire.errors import BadFile, MoireError
from moire.nearest import did_you_mean, near_names
from study import quantities
from study.machines import MACHINES, Machine, Measure
from twin.parameters import tables

RUNS, REPEATS = 100, 2  # where the file says nothing
MOST_RUNS = 10**5
MOST_NM = 10**12  # of a length
TYPICAL_TO_BAD = "typical to bad"
TYPICAL, NOMINAL = "typical", "nominal"
LEAST_SHARE = 1e-3  # of a normal distribution that must be inside its limits
TAIL = 2.0  # deviations from the mean, at which one effect alone is tried
Path = tuple[str, ...]  # of a key: ("effects", "scale_linear", "uniform")


@dataclass(frozen=True)
class Distribution:
    """How an effect is distributed over the machines: evenly from `low` to `high`, or normally
    within them. All in the unit of the effect.
    """

    low: float
    high: float
    normal: tuple[float, float] | None = None  # mean, standard deviation

    def at(self, share: float) -> float:
        """The value below which this share of the machines lies, 0 < share < 1."""
        if self.normal is None:
            return self.low + share * (self.high - self.low)
        bell = NormalDist(*self.normal)
        low, high = bell.cdf(self.low), bell.cdf(self.high)
        inside = low + share * (high - low)
        return min(self.high, max(self.low, bell.inv_cdf(min(1 - 1e-15, max(1e-300, inside)))))

    def end(self, upper: bool) -> float:
        """Its bad end: of a normal distribution where 2 deviations are."""
        if self.normal is None:
            return self.high if upper else self.low
        mean, deviation = self.normal
        reach = TAIL * deviation if upper else -TAIL * deviation
        return min(self.high, max(self.low, mean + reach))


@dataclass(frozen=True)
class Effect:
    """A parameter of the machine that differs from machine to machine."""

    name: str
    distribution: Distribution
    alone: float  # its bad value when it is tried alone
    baseline: float  # its value when another one is tried


@dataclass(frozen=True)
class Spec:
    """What a good machine keeps, in nm; None: not asked for."""

    largest_nm: float | None = None
    rms_nm: float | None = None

    def met(self, largest_nm: float, rms_nm: float) -> bool:
        return (self.largest_nm is None or largest_nm <= self.largest_nm) and (
            self.rms_nm is None or rms_nm <= self.rms_nm
        )

    @property
    def words(self) -> str:
        found = [
            f"{name} error up to {units.format_length(limit, 6)}"
            for name, limit in (("largest", self.largest_nm), ("rms", self.rms_nm))
            if limit is not None
        ]
        return " and ".join(found)


@dataclass(frozen=True)
class Study:
    """What a file asks for. `fixed` are parameters that all runs have."""

    machine: str
    spec: Spec
    measure: Measure
    effects: tuple[Effect, ...]
    fixed: Mapping[str, float] = field(default_factory=dict)
    runs: int = RUNS  # of the Monte Carlo part
    repeats: int = REPEATS  # of each effect alone

    @property
    def name(self) -> str:
        """Identifies the runs: what changes no run (the specification, the number of runs) is no
        part of it, so that a study can be extended, and judged by another specification."""
        plain = asdict(replace(self, spec=Spec(), runs=0))
        text = json.dumps(plain, sort_keys=True)
        return f"study-{self.machine}-{hashlib.sha256(text.encode()).hexdigest()[:10]}"

    @property
    def singles(self) -> int:
        """Number of the runs with one effect alone, those without any included."""
        return self.repeats * (1 + len(self.effects))

    @property
    def parts(self) -> int:
        return self.singles + self.runs

    @property
    def baseline(self) -> dict[str, float]:
        return {effect.name: effect.baseline for effect in self.effects}


# ------------------------------------------------------------------ reading


HEADER = re.compile(r"\s*\[\s*([\w.\s-]+?)\s*\]")
KEY = re.compile(r"\s*([\w.-]+)\s*=")


def line_of(text: str, path: Path) -> int | None:
    """The line, from 1 on, of the key at this path, or of the innermost table around it."""
    section: Path = ()
    best, found = 0, None
    for number, line in enumerate(text.splitlines(), 1):
        if header := HEADER.match(line):
            section = here = tuple(part.strip() for part in header[1].split("."))
        elif key := KEY.match(line):
            here = (*section, *key[1].split("."))
        else:
            continue
        if len(here) > best and path[: len(here)] == here:
            best, found = len(here), number
    return found


class Reader:
    """Takes the values out of a file; what is wrong becomes BadFile with its line."""

    def __init__(self, text: str, file: str) -> None:
        self.text, self.file = text, file
        try:
            self.content = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            found = re.fullmatch(
                r"(.*) \(at (?:line (\d+), column \d+|end of document)\)", str(error)
            )
            reason = found[1] if found else str(error)
            line = int(found[2]) if found and found[2] else len(text.splitlines())
            raise BadFile(f"{file}, line {line}: this is no TOML: {reason}") from None

    def refuse(self, path: Path, reason: str) -> NoReturn:
        line = line_of(self.text, path)
        raise BadFile(f"{self.file}{f', line {line}' if line else ''}: {reason}") from None

    def table(self, name: str) -> dict[str, Any]:
        """A table of the file, empty where there is none."""
        found = self.content.get(name, {})
        if not isinstance(found, dict):
            self.refuse((name,), f"'{name}' is a table: write [{name}]")
        return found

    def known(self, path: Path, what: str, name: str, names: Sequence[str]) -> None:
        """Refuses a name that is not among these."""
        if name not in names:
            more = did_you_mean(near_names(name, names))
            if not more:
                more = (
                    f": there are {', '.join(names)}"
                    if len(names) < 20
                    else (": 'moire study --example' lists all")
                )
            self.refuse(path, f"there is no {what} '{name}'{more}")

    def parsed(self, path: Path, value: Any, parse: Callable[[Any], Any]) -> Any:
        """parse(value); what it refuses is refused with the line."""
        try:
            return parse(value)
        except MoireError as error:
            self.refuse(path, str(error))

    def whole(self, path: Path, value: Any, low: int, high: int) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            self.refuse(path, f"{path[-1]} is a whole number from {low} to {high}, not {value!r}")
        return value

    def flag(self, path: Path, value: Any) -> bool:
        if not isinstance(value, bool):
            self.refuse(path, f"{path[-1]} is true or false, not {value!r}")
        return value

    def length(self, path: Path, value: Any) -> float:
        """A length above zero, in nm."""
        if not isinstance(value, str):
            self.refuse(path, f'{value!r} has no unit: write a length such as "0.3 um"')
        found = self.parsed(path, value, units.parse_length)
        if not 0 < found < MOST_NM:
            least_and_most = f"above zero and below {MOST_NM / 10**9:g} m"
            self.refuse(path, f"{path[-1]} is a length {least_and_most}, not '{value}'")
        return float(found)

    def keys(self, name: str, known: Sequence[str]) -> None:
        """Refuses keys of a table that have no meaning."""
        for key in self.table(name):
            self.known((name, key), f"key of [{name}]", key, known)


def read(text: str, file: str) -> Study:
    """The study in the text of a file; raises BadFile."""
    reader = Reader(text, file)
    parts = ("machine", "spec", "measure", "one_at_a_time", "monte_carlo", "fixed", "effects")
    for key in reader.content:
        reader.known((key,), "key", key, parts)
    machine = machine_of(reader)
    alone = reader.table("one_at_a_time")
    reader.keys("one_at_a_time", ("others", "repeats"))
    reader.keys("monte_carlo", ("runs",))
    others = alone.get("others", TYPICAL)
    if others not in (TYPICAL, NOMINAL):
        path = ("one_at_a_time", "others")
        reader.refuse(path, f"others is '{TYPICAL}' or '{NOMINAL}', not {others!r}")
    runs = reader.table("monte_carlo").get("runs", RUNS)
    repeats = alone.get("repeats", REPEATS)
    fixed = fixed_of(reader, machine)
    effects = tuple(
        effect_of(reader, machine, name, value, others)
        for name, value in reader.table("effects").items()
    )
    if not effects:
        reader.refuse(("effects",), "[effects] has none: 'moire study --example' lists all")
    for effect in effects:
        if effect.name in fixed:
            reader.refuse(("fixed", effect.name), f"'{effect.name}' is in [effects], too")
    return Study(
        machine.name,
        spec_of(reader),
        measure_of(reader, machine),
        effects,
        fixed,
        reader.whole(("monte_carlo", "runs"), runs, 0, MOST_RUNS),
        reader.whole(("one_at_a_time", "repeats"), repeats, 0, MOST_RUNS),
    )


def machine_of(reader: Reader) -> Machine:
    name = reader.content.get("machine")
    if not isinstance(name, str):
        reader.refuse(
            ("machine",), f'the machine is missing: write machine = "{next(iter(MACHINES))}"'
        )
    reader.known(("machine",), "machine for a study", name, tuple(MACHINES))
    return MACHINES[name]


def spec_of(reader: Reader) -> Spec:
    reader.keys("spec", ("largest_error", "rms_error"))
    found = {
        key: reader.length(("spec", key), value) for key, value in reader.table("spec").items()
    }
    if not found:
        reader.refuse(("spec",), "[spec] needs largest_error, rms_error or both")
    return Spec(found.get("largest_error"), found.get("rms_error"))


def measure_of(reader: Reader, machine: Machine) -> Measure:
    table = reader.table("measure")
    lengths, flags = ("travel", "shortest_move", "longest_move"), ("calibrated", "scale_corrected")
    reader.keys("measure", ("moves", *lengths, *flags))
    found: dict[str, Any] = {
        f"{key}_nm": reader.length(("measure", key), table[key]) for key in lengths if key in table
    }
    found |= {key: reader.flag(("measure", key), table[key]) for key in flags if key in table}
    if "moves" in table:
        found["moves"] = reader.whole(("measure", "moves"), table["moves"], 1, 10**4)
    measure = Measure(**found)
    if measure.travel_nm > machine.travel_nm:
        most = units.format_length(machine.travel_nm, 6)
        reader.refuse(("measure", "travel"), f"the travel of {machine.name} is {most}")
    if measure.longest_move_nm > measure.travel_nm:
        reader.refuse(("measure", "longest_move"), "longest_move is longer than the travel")
    if measure.shortest_move_nm > measure.longest_move_nm:
        reader.refuse(("measure", "shortest_move"), "shortest_move is longer than longest_move")
    return measure


def value_of(reader: Reader, path: Path, machine: Machine, name: str, value: Any) -> float:
    """A value of a parameter of the machine, not below what is possible."""
    entry = machine.parameters[name]
    found = float(reader.parsed(path, value, lambda one: quantities.parse(one, str(entry["unit"]))))
    lowest = entry.get("lowest")
    if lowest is not None and found < lowest:
        least = quantities.text_of(float(lowest), entry["unit"])
        reader.refuse(path, f"{name} cannot be below {least}: it is '{value}' here")
    return found


def fixed_of(reader: Reader, machine: Machine) -> dict[str, float]:
    found = {}
    for name, value in reader.table("fixed").items():
        path = ("fixed", name)
        reader.known(path, f"parameter of {machine.name}", name, tuple(machine.parameters))
        found[name] = value_of(reader, path, machine, name, value)
    return found


def pair(reader: Reader, path: Path, value: Any, what: str) -> tuple[Any, Any]:
    if not isinstance(value, list) or len(value) != 2:
        reader.refuse(path, f"{path[-1]} is a pair [{what}], not {value!r}")
    return value[0], value[1]


def effect_of(reader: Reader, machine: Machine, name: str, value: Any, others: str) -> Effect:
    path = ("effects", name)
    reader.known(path, f"effect of {machine.name}", name, tuple(machine.effects))
    entry = machine.parameters[name]
    worlds = {world: tables.world(world, machine.table)[name] for world in tables.WORLDS}
    typical, bad = worlds[TYPICAL], worlds["bad"]
    if value == TYPICAL_TO_BAD:
        distribution, alone = Distribution(min(typical, bad), max(typical, bad)), bad
    elif isinstance(value, dict):
        distribution = distribution_of(reader, machine, name, value)
        alone = distribution.end(upper=bad >= typical)
        if "alone" in value:
            alone = value_of(reader, (*path, "alone"), machine, name, value["alone"])
    else:
        unit = entry["unit"]
        low, high = quantities.text_of(typical, unit), quantities.text_of(bad, unit)
        reader.refuse(
            path,
            f'{name} needs a distribution: "{TYPICAL_TO_BAD}", {{ uniform = ["{low}", '
            f'"{high}"] }} or {{ normal = [mean, deviation] }}; what all runs have is in [fixed]',
        )
    return Effect(
        name, distribution, alone, typical if others == TYPICAL else float(entry["value"])
    )


def distribution_of(
    reader: Reader, machine: Machine, name: str, table: Mapping[str, Any]
) -> Distribution:
    path = ("effects", name)
    for key in table:
        known = ("uniform", "normal", "within", "alone")
        reader.known((*path, key), f"key of the effect {name}", key, known)
    if ("uniform" in table) == ("normal" in table):
        reader.refuse(path, f"{name} needs one of uniform and normal")

    def ends(key: str) -> Distribution:
        here = (*path, key)
        low, high = (
            value_of(reader, here, machine, name, one)
            for one in pair(reader, here, table[key], "low, high")
        )
        if low >= high:
            reader.refuse(here, f"{key} of {name} is empty: {table[key][0]} to {table[key][1]}")
        return Distribution(low, high)

    if "uniform" in table:
        if "within" in table:
            reader.refuse((*path, "within"), "within belongs to normal: uniform has its own ends")
        return ends("uniform")
    here = (*path, "normal")
    mean, deviation = pair(reader, here, table["normal"], "mean, standard deviation")
    unit = str(machine.parameters[name]["unit"])
    found = value_of(reader, here, machine, name, mean)
    spread = float(reader.parsed(here, deviation, lambda one: quantities.parse(one, unit)))
    if spread <= 0:
        reader.refuse(here, f"the standard deviation of {name} is above zero, not '{deviation}'")
    lowest = float(machine.parameters[name].get("lowest", float("-inf")))
    limits = ends("within") if "within" in table else Distribution(lowest, float("inf"))
    bell = NormalDist(found, spread)
    if bell.cdf(limits.high) - bell.cdf(limits.low) < LEAST_SHARE:
        reader.refuse((*path, "within"), f"the normal distribution of {name} is not within these")
    return replace(limits, normal=(found, spread))


# ------------------------------------------------------------------ an example


def example(machine: Machine = MACHINES["s0"]) -> str:
    """The text of a study with all effects, their sources and their typical and bad values."""
    typical, bad = tables.world(TYPICAL, machine.table), tables.world("bad", machine.table)
    rows = []
    for name in machine.effects:
        entry = machine.parameters[name]
        unit = str(entry["unit"])
        low, high = sorted((typical[name], bad[name]))
        ends = [quantities.text_of(one, unit) for one in (low, high)]
        rows += [
            f"# {quantities.place(unit)}typical {quantities.text_of(typical[name], unit)}, bad "
            f"{quantities.text_of(bad[name], unit)}: {entry['why']}",
            f'{name} = {{ uniform = ["{ends[0]}", "{ends[1]}"] }}',
        ]
    return EXAMPLE.format(
        name=machine.name,
        what=machine.what,
        effects="\n".join(rows),
        runs=RUNS,
        repeats=REPEATS,
    )


EXAMPLE = """\
# A study of the machine {name}:
# {what}.
# Run it with `moire study FILE`; docs/study.md explains it.
machine = "{name}"

[spec]                        # a machine is good if it keeps both; one of them is enough
largest_error = "0.3 um"      # largest |target - true position| of its moves
rms_error = "0.15 um"

[measure]                     # what each run does after homing
moves = 10                    # the same targets in each run
travel = "10 mm"              # the targets are from 0 to here
shortest_move = "100 nm"
longest_move = "2 mm"         # the lengths are spread evenly over their logarithm
calibrated = false            # true: sine and cosine are calibrated first
scale_corrected = false       # true: a segment table corrects the scale, measured each 0.5 mm

[one_at_a_time]               # each effect alone at its bad value
others = "typical"            # the others then: "typical", or "nominal" as in sw/twin/parameters
repeats = {repeats}                   # with other random numbers

[monte_carlo]                 # all effects drawn, each run another machine
runs = {runs}                    # --runs N overrides it; more runs later repeat nothing

[fixed]                       # parameters of sw/twin/parameters that all runs have
drift_time = "10 s"           # what drifts has drifted then; a run takes about this long
temperature_time = "10 s"

# Each effect has a distribution over the machines:
#   name = "typical to bad"                     evenly between these two values
#   name = {{ uniform = ["low", "high"] }}        evenly between two values
#   name = {{ normal = ["mean", "deviation"] }}   and within = ["low", "high"] cuts it off
# With alone = "value" it has this one when it is tried alone. Otherwise that is the end on the side
# of the bad value; of a normal distribution it is two deviations from the mean. An effect that is
# left out stays as in sw/twin/parameters.
[effects]
{effects}
"""

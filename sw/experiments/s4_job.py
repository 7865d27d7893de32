# SPDX-License-Identifier: Apache-2.0
"""S4: an indexing table and a wire-EDM machine cut all stations of a list without an operator.

    python -m experiments.s4_job

Two nodes run the firmware image `station`: the main node has the EEPROM, key-pad, display, PS/2
keyboard and the EDM machine, and the sub-node has the worm table and its angle sensor. An operator
divides the turn on the panel and presses START; then the job runs unattended. Each cut is checked
against the log of the EDM machine, which has the true angle of the table. The result is
build/report/s4_job.html.

`--trouble` adds damaged sensor frames, garbage between the nodes, an operator who types, and a
power failure, after which the operator answers.

The times are shortened: a cut takes 0.3 s, and the table turns 10 degrees per second.
"""

import html
import math
import random
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Self

from rich.console import Console
from rich.status import Status
from rich.table import Table as Rows

from experiments import command, start_page
from experiments.report_page import picture, text_of
from moire.analysis import report
from moire.client.bus import Bus
from moire.client.indexing_table import MOST_STATIONS, TURN, IndexingTable
from moire.client.job import Job, JobState, equal_parts
from moire.client.node import Node as ClientNode
from moire.client.nonvolatile import SavedSettings
from moire.client.settings import Settings
from moire.units import Value
from twin import Axis, Devices, Node, Twin, TwinTransport, build
from twin.nodes.twin import drives

MAIN, SUB = 0, 1  # numbers of the nodes in the twin
ADDRESSES = (1, 2)
CLK_HZ = 1_840_000
PEER_BAUD = 115200
NODE = {**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0}
AXIS: dict[str, Value] = {
    "drive": "steps",
    "position_source": "own_steps",
    "steps_per_period": 4,
    "counts_per_period": 4,
    "period": "1um",
    "velocity": "50mm/s",
    "acceleration": "200mm/s2",
    "jerk": "1000mm/s3",
    "homing_latch_speed": "0.4mm/s",
    "following_limit": "10mm",
    "disagreement_limit": 0,
    "encoder_fault_mask": 0,
    "kp": 0,
    "ki": 0,
    "kd": 0,
    "kv": 0,
    "ka": 0,
    "settle_window": "1um",
    "settle_time": "5ms",
    "step_high": "1us",
    "step_low": "1us",
    "watchdog_time": 0,
}
WORM = {
    "worm_error": (4, 12),
    "worm_second_error": (0, 4),
    "worm_wheel_error": (5, 25),
    "worm_backlash": (5, 40),
}  # arcsec
CUT_S = 0.3
POLL_S = 0.1
KEY_S = 0.06  # a key is pressed, and released, for this time
SHOWN_S = 0.6  # until the display shows a new state
ANSWER_S = 1.0  # the operator reads the display before answering
DARK_S = 0.5  # duration of a power failure
# a job takes at most STATION_S per station, and MORE_S for motion, faults and answers
STATION_S, MORE_S = 12, 90
ABOUT = 5  # degrees: before the job the table is anywhere from 0 to this angle
NEAR = 60  # arcsec: a cut farther away from every station belongs to none
TABLE: dict[str, Value] = {"turn_settle": "40ms"}
TOLERANCE = 2.0  # arcsec, as in the paper
MODES = ("frames", "legacy")
STATIONS = 36  # of the job, equal parts of the turn
LEFT_OUT = "bending of the work piece, wear, temperature; errors of the sensor above 1 arcsec"

PAD = """7 8 9 START PAUSE RESUME STOP
         4 5 6 AGAIN NEXT UP DOWN
         1 2 3 DIVIDE LIST LIMIT SPEED
         0 . ENTER CLEAR""".split()
# scan codes of the keys that the operator types, including those of the start
LETTERS = (0x1C, 0x32, 0x21, 0x23, 0x24, 0x2B, 0x1D, 0x14)


@dataclass(frozen=True)
class Trouble:
    """The disturbances of a job."""

    corrupt: float = 0.0  # share of the sensor frames
    garbage_hz: float = 0.0  # rate of the bursts in each direction between the nodes
    typing: bool = False
    power_cut_s: float | None = None  # after the start
    dark: tuple[int, ...] = ()  # the nodes that lose their power


CALM = Trouble()


@dataclass(frozen=True)
class Cut:
    """One cut of the EDM machine."""

    station: int | None  # from 0 on; None: the cut belongs to no station
    target: float  # arcsec
    # the true angle in arcsec at the beginning or at the end, whichever has the larger error; at
    # the beginning if the table lost its power during the cut
    angle: float
    error: float  # arcsec, target - angle
    start_s: float
    complete: bool


@dataclass
class Outcome:
    """The result of a job: the cuts in the log of the EDM machine, and the course of the job."""

    stations: list[float]  # arcsec
    cuts: list[Cut]
    state: JobState  # the last one
    seconds: float
    tries: dict[int, int] = field(default_factory=dict)  # of each station
    # (seconds, state and cause, key)
    answers: list[tuple[float, str, str]] = field(default_factory=list)
    # the last text on the panel in each state
    displays: dict[str, list[str]] = field(default_factory=dict)
    spared: bool = False  # the job ended before the power failure that was to come in it

    @property
    def uncut(self) -> list[int]:
        """The stations without a complete cut."""
        return sorted(
            set(range(len(self.stations))) - {cut.station for cut in self.cuts if cut.complete}
        )

    @property
    def twice(self) -> list[int]:
        """The stations with more than one cut."""
        begun = [cut.station for cut in self.cuts]
        return sorted(
            {station for station in begun if station is not None and begun.count(station) > 1}
        )

    @property
    def outside_tolerance(self) -> list[Cut]:
        """The cuts that belong to no station."""
        return [cut for cut in self.cuts if cut.station is None]

    @property
    def complete(self) -> bool:
        """Whether each station was cut once, nothing else was cut, and the job has finished."""
        return (
            not (self.uncut or self.twice or self.outside_tolerance)
            and self.state.state == "finished"
        )

    @property
    def worst(self) -> float:
        """The largest error of a cut, in arcsec."""
        return max((abs(cut.error) for cut in self.cuts), default=math.inf)

    @property
    def failed(self) -> bool:
        """Whether the job is not complete, a cut is outside the tolerance, or nothing is known of a
        power failure since none came in the job.
        """
        return not self.complete or self.worst > TOLERANCE or self.spared

    @property
    def words(self) -> str:
        """The result in one line."""
        return (
            f"{len(self.cuts)} cuts for {len(self.stations)} stations, {len(self.uncut)} uncut, "
            f"{len(self.twice)} cut twice, {len(self.outside_tolerance)} elsewhere; "
            f"largest error {self.worst:.2f} arcsec; {self.seconds:.0f} s"
            + (", without the power failure that was to come" if self.spared else "")
        )


def apart(angle: float, other: float) -> float:
    """One angle minus another in arcsec, within half a turn."""
    return (angle - other + TURN / 2) % TURN - TURN / 2


def random_worm(source: random.Random) -> dict[str, float]:
    """Random errors of a worm table."""
    return {name: source.uniform(*limits) for name, limits in WORM.items()}


def random_stations(count: int, source: random.Random, share: float = 1.0) -> list[float]:
    """Random stations in arcsec: one in each of `count` equal parts of this share of a turn. The
    angle of the worm is different at each station.
    """
    part = share * TURN / count
    return [round((n + source.uniform(0.1, 0.9)) * part, 2) for n in range(count)]


def set_up_table(node: ClientNode, **settings: Value) -> None:
    """Writes the settings of the table and the parameters of its axis into a node."""
    for name, value in {**TABLE, **settings}.items():
        Settings(node).set(name, value)
    for name, value in AXIS.items():
        node.bus.axis(node.address).set_parameter(name, value)


class IndexingMachine:
    """The simulated machine: its two nodes, the host on their bus, and an operator at the panel."""

    def __init__(
        self, seed: int = 1, mode: str = MODES[0], worm: dict[str, float] | None = None
    ) -> None:
        around = Devices(
            eeprom=True,
            keypad=True,
            display=True,
            keyboard=True,
            edm=True,
            table=SUB,
            parameters={"edm_cut_time": CUT_S},
        )
        table = Node(ADDRESSES[SUB], [Axis("worm_table", worm or {})], Devices(eeprom=True))
        self.twin = Twin(
            [Node(ADDRESSES[MAIN], [], around), table],
            seed=seed,
            clk_hz=CLK_HZ,
            node_parameters=NODE,
            firmware=build.firmware("station"),
            peers=(MAIN, SUB),
            peer_baud=PEER_BAUD,
        )
        self.bus = Bus(TwinTransport(self.twin), random_source=random.Random(seed), poll_s=POLL_S)
        self.nodes = [self.bus.node(address) for address in ADDRESSES]
        self.job, self.table = Job(self.nodes[MAIN]), IndexingTable(self.nodes[SUB])
        self.panel, self.mode = self.twin.devices(MAIN), mode
        self.source, self.stations = random.Random(seed), list[float]()
        self.table_dark_s: list[float] = []
        self.twin.set_position(SUB, math.radians(self.source.uniform(0, ABOUT)))
        self.twin.run_until_ready()
        for name, value in {
            "peer_mode": mode,
            "peer_role": "main",
            "job_cut_limit": "20s",
            "job_start_limit": "5s",
        }.items():
            # the main node saves them to the EEPROM with the next station list
            Settings(self.nodes[MAIN]).set(name, value)
        set_up_table(self.nodes[SUB], peer_mode=mode, peer_role="sub")
        SavedSettings(self.nodes[SUB]).save()  # they remain valid after a power failure

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.twin.close()

    # the operator

    def wait_for_panel(self) -> None:
        """Waits until the panel is ready and the display shows something."""
        while (
            not {"keypad", "display"} <= set((state := self.job.state()).flags)
            or state.state == "loading"
            or not self.shown
        ):
            self.twin.run(POLL_S)

    @property
    def shown(self) -> str:
        """The text on the display."""
        return "".join(self.panel.lines).strip()

    def press(self, *keys: str) -> None:
        """Presses keys of the panel one after the other."""
        for key in keys:
            self.panel.press(PAD.index(key))
            self.twin.run(KEY_S)
            self.panel.release(PAD.index(key))
            self.twin.run(KEY_S)

    def divide(self, count: int) -> None:
        """Divides the turn into equal parts, on the panel."""
        self.wait_for_panel()
        self.press("DIVIDE", *str(count), "ENTER")
        self.twin.run(POLL_S)
        self.job.ready()
        self._load_stations(equal_parts(count))

    def enter(self, degrees: Sequence[str]) -> None:
        """Enters the station list on the panel, angle by angle."""
        self.wait_for_panel()
        self.press("LIST")
        for angle in degrees:
            self.press(*angle, "ENTER")
        self.press("ENTER")
        self.twin.run(POLL_S)
        self.job.ready()
        self._load_stations([float(angle) * 3600 for angle in degrees])

    def load(self, angles: Sequence[float]) -> None:
        """Loads the station list (arcsec) from the host."""
        self.job.load(angles)
        self._load_stations(angles)

    def _load_stations(self, angles: Iterable[float | Fraction]) -> None:
        self.stations = [float(angle) for angle in angles]
        if self.mode == "legacy":
            Job(self.nodes[SUB]).load(self.stations)

    def answer(self, state: JobState) -> str:
        """The key that an operator presses who sees the display and the workpiece."""
        if state.state == "paused":
            return "RESUME" if "resume" in state.answers else "STOP"
        if self.panel.state.edm_cutting:
            return "RESUME"
        return (
            "NEXT"
            if any(cut.station == state.station and cut.complete for cut in self.cuts())
            else "AGAIN"
        )

    def type(self) -> None:
        """Types a word on the keyboard of the PC."""
        after = 0.0
        for _ in range(self.source.randint(2, 6)):
            letter = self.source.choice(LETTERS)
            self.panel.type([letter], after)
            self.panel.type([0xF0, letter], after + 0.06)
            after += self.source.uniform(0.1, 0.2)

    # a job

    def cuts(self) -> list[Cut]:
        """The cuts in the log of the EDM machine."""
        found = []
        for cut in self.panel.cuts:
            angles = [
                math.degrees(angle) * 3600 % TURN
                for angle in (cut.angle_start_rad, cut.angle_end_rad)
                if angle is not None
            ]
            station = min(
                range(len(self.stations)), key=lambda n: abs(apart(angles[0], self.stations[n]))
            )
            target = self.stations[station]
            # without power the drive of the table loses its elastic tension, and the table turns
            if any(0 <= dark - cut.start_s <= CUT_S for dark in self.table_dark_s):
                angles = angles[:1]
            angle = max(angles, key=lambda angle: abs(apart(angle, target)))
            error = apart(target, angle)
            found.append(
                Cut(
                    station if abs(error) < NEAR else None,
                    target,
                    angle,
                    error,
                    cut.start_s,
                    cut.complete,
                )
            )
        return found

    def power_cut(self, dark: Sequence[int]) -> None:
        """Switches these nodes off for DARK_S."""
        if SUB in dark:
            self.table_dark_s.append(self.twin.time())
        for node in dark:
            self.twin.power_cut(node)
        self.twin.run(DARK_S)
        for node in dark:
            self.twin.power_on(node)
        self.twin.run_until_ready()

    def run(
        self, trouble: Trouble = CALM, watch: Callable[[JobState], object] | None = None
    ) -> Outcome:
        """Runs the job from START to its end."""
        self.twin.set_plant(SUB, sensor_corrupt=trouble.corrupt)
        for sender, receiver in ((MAIN, SUB), (SUB, MAIN)):
            self.twin.peer_line(sender, receiver).garbage(trouble.garbage_hz)
        begun, dark, types_at = self.twin.time(), trouble.power_cut_s, self.twin.time()
        self.press("START")
        outcome = Outcome(self.stations, [], self.job.state(), 0.0)
        while outcome.seconds < MORE_S + STATION_S * len(self.stations):
            self.twin.run(POLL_S)
            if trouble.typing and self.twin.time() >= types_at:
                self.type()
                types_at = self.twin.time() + self.source.uniform(1, 3)
            if dark is not None and self.twin.time() - begun >= dark:
                self.twin.run(self.source.uniform(0, POLL_S))
                self.power_cut(trouble.dark)
                dark = None
            state, outcome.seconds = self.job.state(), self.twin.time() - begun
            if watch and state.station != outcome.state.station:
                watch(state)
            if state.state == outcome.state.state:  # now the display shows this state
                outcome.displays[state.state] = self.panel.lines
            outcome.state = state
            table = self.table.state()
            if state.state == "cutting":
                outcome.tries[state.station] = table.tries
            if state.state in ("finished", "idle"):
                break
            if state.state in ("paused", "unsure"):
                self.twin.run(ANSWER_S)
                key = self.answer(state)
                outcome.answers.append(
                    (outcome.seconds, f"{state.state}: {state.cause_words}", key)
                )
                self.press(key)
        outcome.spared = dark is not None
        self.twin.run(SHOWN_S)
        outcome.displays[outcome.state.state] = self.panel.lines
        outcome.cuts = self.cuts()
        return outcome


def some_trouble(seconds: float, source: random.Random) -> Trouble:
    """1 % damaged sensor frames, garbage, an operator who types, and a power failure at a random
    time within these seconds.
    """
    return Trouble(
        0.01, 2.0, True, source.uniform(0, seconds), source.choice([(MAIN,), (SUB,), (MAIN, SUB)])
    )


# ------------------------------------------------------------------ the experiment

HEAD = (
    "station",
    "target / deg",
    "true angle at the cut / deg",
    "error / arcsec",
    "tries",
    "cut at / s",
)


def rows(outcome: Outcome) -> list[Sequence[report.Cell]]:
    """The rows of the table of cuts."""
    return [
        (
            "-" if cut.station is None else str(cut.station + 1),
            f"{cut.target / 3600:.5f}",
            f"{cut.angle / 3600:.5f}",
            (f"{cut.error:+.2f}", "good" if abs(cut.error) <= TOLERANCE else "bad"),
            "-" if cut.station is None else str(outcome.tries.get(cut.station, "-")),
            f"{cut.start_s:.1f}",
        )
        for cut in outcome.cuts
    ]


def errors_picture(outcome: Outcome) -> str:
    """The picture of the errors and tries, as HTML."""
    figure, (errors, tries) = report.drawing(height=3.8, ncols=2)
    errors.axhspan(-TOLERANCE, TOLERANCE, color="#eef4ee")
    errors.plot(
        [cut.target / 3600 for cut in outcome.cuts],
        [cut.error for cut in outcome.cuts],
        "o",
        color=report.colour(0),
        markersize=4,
    )
    errors.set(
        xlabel="station / deg",
        ylabel="error (target \N{MINUS SIGN} true angle) / arcsec",
        title="error at the cut, and the tolerance",
        ylim=(-3, 3),
    )
    tries.bar(
        [station + 1 for station in outcome.tries],
        list(outcome.tries.values()),
        color=report.colour(1),
    )
    tries.set(
        xlabel="station",
        ylabel="tries",
        title="bisection: each try turns by half the remaining angle",
    )
    return picture(
        "errors", "Error of each station by the model, and the number of tries", report.png(figure)
    )


def displays(outcome: Outcome) -> str:
    """The texts of the panel, as HTML."""
    blocks = [
        f"<figure><pre>{html.escape(chr(10).join(lines))}</pre>"
        f"<figcaption>{html.escape(state)}</figcaption></figure>"
        for state, lines in outcome.displays.items()
    ]
    return "<h2>Texts on the panel</h2>" + "".join(blocks)


def shown_by(console: Console, status: Status) -> Callable[[str], None]:
    """What shows the progress of a job: in its place on a terminal, elsewhere line by line."""
    return status.update if console.is_terminal else console.print


def run(
    count: int = STATIONS,
    mode: str = MODES[0],
    seed: int = 1,
    trouble: bool = False,
    folder: Path = start_page.FOLDER,
    console: Console | None = None,
) -> tuple[Outcome, Path]:
    """Runs the whole experiment and returns its outcome and the path of the report."""
    console, source = console or Console(), random.Random(seed)
    console.print(
        f"[bold]S4: an unattended job of {count} stations[/] "
        f"(seed {seed}, {mode} between the nodes)"
    )
    with (
        console.status("building the twin") as status,
        IndexingMachine(seed, mode, random_worm(source)) as machine,
    ):
        say = shown_by(console, status)
        machine.divide(count)
        outcome = machine.run(
            some_trouble(3.5 * count, source) if trouble else CALM,
            lambda state: say(f"station {state.station + 1} of {count}"),
        )
        lost = machine.twin.truth(SUB).lost_steps
        peer, sensor = machine.table.peer(), machine.table.sensor()
    shown = Rows(*HEAD, title="cuts in the log of the EDM machine")
    for row in rows(outcome):
        shown.add_row(*(cell[0] if isinstance(cell, tuple) else cell for cell in row))
    console.print(shown)
    for line in outcome.displays[outcome.state.state]:
        console.print(f"    [reverse]{line}[/]", highlight=False)
    for seconds, why, key in outcome.answers:
        console.print(f"after {seconds:.1f} s the panel showed '{why}'; the operator pressed {key}")
    compared = [
        report.Compared(
            "stations that were cut once",
            "not given",
            f"{count - len(outcome.uncut)} of {count}, {len(outcome.twice)} twice",
        ),
        report.Compared(
            "largest true error",
            f"\N{PLUS-MINUS SIGN}{TOLERANCE:g} arcsec",
            f"{outcome.worst:.2f} arcsec",
            outcome.worst <= TOLERANCE,
        ),
        report.Compared("tries", "not given", f"{max(outcome.tries.values(), default=0)} at most"),
        report.Compared("answers of the operator", "not given", str(len(outcome.answers))),
    ]
    parts = [
        report.against_the_paper(compared, LEFT_OUT),
        errors_picture(outcome),
        displays(outcome),
        report.table(HEAD, rows(outcome), text_columns=1),
    ]
    if outcome.answers:
        parts.insert(
            1,
            report.table(
                ("after / s", "text on the panel", "key that the operator pressed"),
                [(f"{seconds:.1f}", why, key) for seconds, why, key in outcome.answers],
            ),
        )
    text = text_of(
        "S4: the unattended indexing machine",
        "The simulation of two nodes runs the same RTL and firmware as the FPGA. One node has the "
        "panel, the EEPROM and the keyboard of the wire-EDM machine; the other turns the table "
        "with an angle sensor as feedback. The true angle is the angle of the model at each cut.",
        parts,
        {
            "simulated time": f"{outcome.seconds:.0f} s",
            "worm": "random errors, backlash and sensor error, determined by the seed",
            "steps lost": str(lost),
            "sensor frames": f"{sensor.frames}, {sensor.wrong_crc + sensor.broken} damaged",
            "between the nodes": f"{peer.heard} received, {peer.garbage} invalid, "
            f"{peer.repeated} answered again",
            "again": f"build/venv/bin/python -m experiments.s4_job --seed {seed} "
            f"--stations {count} --peers {mode}" + (" --trouble" if trouble else ""),
        },
        claim=f"{count - len(outcome.uncut)} of {count} stations cut, {len(outcome.twice)} of them "
        f"twice, with a true error of {outcome.worst:.2f} arcsec at most; the paper allows "
        f"\N{PLUS-MINUS SIGN}{TOLERANCE:g} arcsec.",
        left_out=LEFT_OUT,
    )
    path = start_page.publish("s4_job", text, folder)
    console.print(f"{outcome.words}; ended {outcome.state.state}")
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return outcome, path


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the experiment from the command line and returns the exit code."""
    parser = command.parser_of(
        "s4_job", "S4 in the twin: it runs a whole job and checks its cuts.", "the trouble"
    )
    command.add_number(
        parser, "--stations", "equal parts of the turn", STATIONS, most=MOST_STATIONS
    )
    parser.add_argument(
        "--peers",
        choices=MODES,
        default=MODES[0],
        help=f"protocol between the nodes (default {MODES[0]})",
    )
    parser.add_argument(
        "--trouble",
        action="store_true",
        help="adds damaged sensor frames, garbage, an operator who types, and a power failure",
    )
    asked = parser.parse_args(arguments)
    return command.exit_code(
        "s4_job",
        lambda: run(asked.stations, asked.peers, asked.seed, asked.trouble, asked.report),
        failed=lambda made: made[0].failed,
    )


if __name__ == "__main__":
    sys.exit(main())

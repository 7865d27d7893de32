# SPDX-License-Identifier: Apache-2.0
"""S4: an indexing table and a wire-EDM machine cut all stations of a program, unattended.

    python -m experiments.s4_job

Two nodes with the firmware image `station`: the main node with EEPROM, key-pad, display, PS/2
keyboard and the EDM machine, the sub-node
with the worm table and its angle sensor. A person divides the turn on the panel and presses START;
then nobody touches it. Each cut is
judged by the EDM machine's log, which has the true angle of the table. Writes build/report/s4.html.

`--trouble` adds damaged sensor frames, garbage between the nodes, a person who types, and a power
cut, after which a person answers.

Times are shortened: a cut takes 0.3 s, the table goes 10 degrees a second.
"""

import argparse
import html
import math
import random
import sys
from dataclasses import dataclass, field

from rich.console import Console
from rich.table import Table as Rows

from experiments.report_page import ROOT, page, picture
from moire.analysis import report
from moire.client.bus import Bus
from moire.client.indexing_table import TURN, IndexingTable
from moire.client.job import Job, equal_parts
from moire.client.nonvolatile import SavedSettings
from moire.client.settings import Settings
from moire.errors import MoireError
from twin import START_S, Axis, BuildError, Devices, Node, Twin, TwinTransport, build
from twin.nodes.twin import drives

MAIN, SUB = 0, 1  # places of the nodes
ADDRESSES = (1, 2)
CLK_HZ = 1_840_000
PEER_BAUD = 115200
NODE = {**drives("HAS_STEPPER"), "FILTERS": 0, "HAS_SINE": 0}
AXIS = {
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
KEY_S = 0.06  # a key is down, and up again, so long
SHOWN_S = 0.6  # until the display tells it
ANSWER_S = 1.0  # a person looks before answering
DARK_S = 0.5  # a power cut
STATION_S, MORE_S = 12, 90  # a job takes no longer: a station, and all ways, trouble and answers
ABOUT = 5  # degrees: the table stands anywhere from 0 on to this before the job
NEAR = 60  # arcsec: a cut farther away from every station is a stray
TABLE = {"turn_settle": "40ms"}
TOLERANCE = 2.0  # arcsec, the paper's
MODES = ("frames", "printed")

PAD = """7 8 9 START PAUSE RESUME STOP
         4 5 6 AGAIN NEXT UP DOWN
         1 2 3 DIVIDE LIST LIMIT SPEED
         0 . ENTER CLEAR""".split()
LETTERS = (
    0x1C,
    0x32,
    0x21,
    0x23,
    0x24,
    0x2B,
    0x1D,
    0x14,
)  # scan codes of a person's keys, those of the start among them


@dataclass(frozen=True)
class Trouble:
    corrupt: float = 0.0  # of the sensor's frames
    garbage_hz: float = 0.0  # bursts of it, each way between the nodes
    typing: bool = False
    power_cut_s: float | None = None  # after the start
    dark: tuple = ()  # places of the nodes that lose their power


CALM = Trouble()


@dataclass(frozen=True)
class Cut:
    station: int | None  # from 0 on; None is none
    wanted: float  # arcsec, as the next two
    # true, the farther one of begin and end; at its begin if the table lost its power meanwhile
    angle: float
    error: float
    start_s: float
    whole: bool


@dataclass
class Outcome:
    """What the EDM machine's log says of a job, and how it went."""

    stations: list  # arcsec
    cuts: list
    state: object  # the last JobState
    seconds: float
    tries: dict = field(default_factory=dict)  # of each station
    answers: list = field(default_factory=list)  # (seconds, what the node asked for, key)
    displays: dict = field(default_factory=dict)  # what the panel showed last in each state

    @property
    def uncut(self):
        return sorted(
            set(range(len(self.stations))) - {cut.station for cut in self.cuts if cut.whole}
        )

    @property
    def twice(self):
        begun = [cut.station for cut in self.cuts]
        return sorted(
            {station for station in begun if station is not None and begun.count(station) > 1}
        )

    @property
    def outside_tolerance(self):
        return [cut for cut in self.cuts if cut.station is None]

    @property
    def whole(self):
        """Each station cut once, nothing else, and it ended."""
        return (
            not (self.uncut or self.twice or self.outside_tolerance)
            and self.state.state == "finished"
        )

    @property
    def worst(self):
        return max((abs(cut.error) for cut in self.cuts), default=math.inf)

    @property
    def failed(self):
        return not self.whole or self.worst > TOLERANCE

    @property
    def words(self):
        return (
            f"{len(self.cuts)} cuts for {len(self.stations)} stations, {len(self.uncut)} uncut, {len(self.twice)} cut twice, "
            f"{len(self.outside_tolerance)} elsewhere; worst {self.worst:.2f} arcsec; {self.seconds:.0f} s"
        )


def apart(angle, wanted):
    return (angle - wanted + TURN / 2) % TURN - TURN / 2


def random_worm(source):
    return {name: source.uniform(*limits) for name, limits in WORM.items()}


def random_stations(count, source, share=1.0):
    """One in each of so many equal parts of this share of a turn, in arcsec; so the worm stands
    differently at each.
    """
    part = share * TURN / count
    return [round((n + source.uniform(0.1, 0.9)) * part, 2) for n in range(count)]


def set_up_table(node, **settings):
    for name, value in {**TABLE, **settings}.items():
        Settings(node).set(name, value)
    for name, value in AXIS.items():
        node.bus.axis(node.address).set_parameter(name, value)


class IndexingMachine:
    """The simulated machine with its two nodes, the host on their line, and a person at the panel."""

    def __init__(self, seed=1, mode=MODES[0], worm=None):
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
        self.panel, self.mode, self.source, self.stations = (
            self.twin.devices(MAIN),
            mode,
            random.Random(seed),
            [],
        )
        self.table_dark_s = []
        self.twin.set_position(SUB, math.radians(self.source.uniform(0, ABOUT)))
        self.twin.run(START_S)
        for name, value in {
            "peer_mode": mode,
            "peer_role": "main",
            "job_cut_limit": "20s",
            "job_start_limit": "5s",
        }.items():
            Settings(self.nodes[MAIN]).set(
                name, value
            )  # the next program takes them into the EEPROM
        set_up_table(self.nodes[SUB], peer_mode=mode, peer_role="sub")
        SavedSettings(self.nodes[SUB]).save()  # from here on they are there after a power cut

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.twin.close()

    # a person

    def wait_for_panel(self):
        """As a person does, who looks at the display before typing."""
        while (
            not {"keypad", "display"} <= set((state := self.job.state()).flags)
            or state.state == "loading"
            or not self.shown
        ):
            self.twin.run(POLL_S)

    @property
    def shown(self):
        return "".join(self.panel.lines).strip()

    def press(self, *keys):
        for key in keys:
            self.panel.press(PAD.index(key))
            self.twin.run(KEY_S)
            self.panel.release(PAD.index(key))
            self.twin.run(KEY_S)

    def divide(self, count):
        """The program, by the panel."""
        self.wait_for_panel()
        self.press("DIVIDE", *str(count), "ENTER")
        self.twin.run(POLL_S)
        self.job.ready()
        self._load_stations(equal_parts(count))

    def enter(self, degrees):
        """The program, by the panel, angle by angle as they are written."""
        self.wait_for_panel()
        self.press("LIST")
        for angle in degrees:
            self.press(*angle, "ENTER")
        self.press("ENTER")
        self.twin.run(POLL_S)
        self.job.ready()
        self._load_stations([float(angle) * 3600 for angle in degrees])

    def load(self, angles):
        """The program, by the host."""
        self.job.load(angles)
        self._load_stations(angles)

    def _load_stations(self, angles):
        self.stations = [float(angle) for angle in angles]
        if self.mode == "printed":
            Job(self.nodes[SUB]).load(self.stations)

    def answer(self, state):
        """What a person does who sees the display and the work piece."""
        if state.state == "paused":
            return "RESUME" if "resume" in state.answers else "STOP"
        if self.panel.state.edm_cutting:
            return "RESUME"
        return (
            "NEXT"
            if any(cut.station == state.station and cut.whole for cut in self.cuts())
            else "AGAIN"
        )

    def type(self):
        """A word on the PC's keyboard."""
        after = 0.0
        for _ in range(self.source.randint(2, 6)):
            letter = self.source.choice(LETTERS)
            self.panel.type([letter], after)
            self.panel.type([0xF0, letter], after + 0.06)
            after += self.source.uniform(0.1, 0.2)

    # a job

    def cuts(self):
        """From the EDM machine's log."""
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
            wanted = self.stations[station]
            if any(
                0 <= dark - cut.start_s <= CUT_S for dark in self.table_dark_s
            ):  # what its springs hold back is let go
                angles = angles[:1]
            angle = max(angles, key=lambda angle: abs(apart(angle, wanted)))
            error = apart(angle, wanted)
            found.append(
                Cut(
                    station if abs(error) < NEAR else None,
                    wanted,
                    angle,
                    error,
                    cut.start_s,
                    cut.whole,
                )
            )
        return found

    def power_cut(self, dark):
        if SUB in dark:
            self.table_dark_s.append(self.twin.time())
        for node in dark:
            self.twin.power_cut(node)
        self.twin.run(DARK_S)
        for node in dark:
            self.twin.power_on(node)
        self.twin.run(START_S)

    def run(self, trouble=CALM, watch=None):
        """The job of the program, from START to its end."""
        self.twin.set_plant(SUB, sensor_corrupt=trouble.corrupt)
        for way in ((MAIN, SUB), (SUB, MAIN)):
            self.twin.peer_line(*way).garbage(trouble.garbage_hz)
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
            if state.state == outcome.state.state:  # then the display has had time to tell it
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
        self.twin.run(SHOWN_S)
        outcome.displays[outcome.state.state] = self.panel.lines
        outcome.cuts = self.cuts()
        return outcome


def some_trouble(seconds, source):
    """1 % of the sensor's frames damaged, garbage, a person who types, and a power cut at some
    moment of so many seconds.
    """
    return Trouble(
        0.01, 2.0, True, source.uniform(0, seconds), source.choice([(MAIN,), (SUB,), (MAIN, SUB)])
    )


# ------------------------------------------------------------------ the experiment

HEAD = (
    "station",
    "wanted / deg",
    "true angle at the cut / deg",
    "error / arcsec",
    "tries",
    "cut at / s",
)


def rows(outcome):
    return [
        (
            "-" if cut.station is None else str(cut.station + 1),
            f"{cut.wanted / 3600:.5f}",
            f"{cut.angle / 3600:.5f}",
            (f"{cut.error:+.2f}", "good" if abs(cut.error) <= TOLERANCE else "bad"),
            str(outcome.tries.get(cut.station, "-")),
            f"{cut.start_s:.1f}",
        )
        for cut in outcome.cuts
    ]


def errors_picture(outcome):
    figure, (errors, tries) = report.drawing(height=3.8, ncols=2)
    errors.axhspan(-TOLERANCE, TOLERANCE, color="#eef4ee")
    errors.plot(
        [cut.wanted / 3600 for cut in outcome.cuts],
        [cut.error for cut in outcome.cuts],
        "o",
        color=report.colour(0),
        markersize=4,
    )
    errors.set(
        xlabel="station / deg",
        ylabel="true angle - wanted / arcsec",
        title="error at the cut, and the tolerance",
        ylim=(-3, 3),
    )
    tries.bar(
        [station + 1 for station in outcome.tries],
        list(outcome.tries.values()),
        color=report.colour(1),
    )
    tries.set(
        xlabel="station", ylabel="tries", title="bisection: half of what is left, read, again"
    )
    return picture(
        "errors", "Error of each station by the model, and the tries it took", report.png(figure)
    )


def displays(outcome):
    blocks = [
        f"<figure><pre>{html.escape(chr(10).join(lines))}</pre><figcaption>{html.escape(state)}</figcaption></figure>"
        for state, lines in outcome.displays.items()
    ]
    return "<h2>What the panel showed</h2>" + "".join(blocks)


def run(
    count=36,
    mode=MODES[0],
    seed=1,
    trouble=False,
    path=ROOT / "build" / "report" / "s4.html",
    console=None,
):
    console, source = console or Console(), random.Random(seed)
    console.print(
        f"[bold]S4: a job of {count} stations, nobody touching it[/] (seed {seed}, {mode} between the nodes)"
    )
    with (
        console.status("building the twin") as status,
        IndexingMachine(seed, mode, random_worm(source)) as machine,
    ):
        machine.divide(count)
        outcome = machine.run(
            some_trouble(3.5 * count, source) if trouble else CALM,
            lambda state: status.update(f"station {state.station + 1} of {count}"),
        )
        lost = machine.twin.truth(SUB).lost_steps
        peer, sensor = machine.table.peer(), machine.table.sensor()
    shown = Rows(*HEAD, title="judged by the log of the EDM machine")
    for row in rows(outcome):
        shown.add_row(*(cell[0] if isinstance(cell, tuple) else cell for cell in row))
    console.print(shown)
    for line in outcome.displays[outcome.state.state]:
        console.print(f"    [reverse]{line}[/]", highlight=False)
    for seconds, why, key in outcome.answers:
        console.print(f"after {seconds:.1f} s the panel said '{why}'; a person pressed {key}")
    compared = [
        (
            "stations cut, each once",
            "unattended production",
            f"{count - len(outcome.uncut)} of {count}, {len(outcome.twice)} twice",
            report.verdict(not outcome.uncut and not outcome.twice),
        ),
        (
            "largest true error",
            "+-2 arcsec",
            f"{outcome.worst:.2f} arcsec",
            report.verdict(outcome.worst <= TOLERANCE),
        ),
        (
            "tries",
            "not given",
            f"{max(outcome.tries.values(), default=0)} at most",
            report.verdict(None),
        ),
        ("answers of a person", "not given", str(len(outcome.answers)), report.verdict(None)),
    ]
    parts = [
        report.table(("", "paper", "here", ""), compared),
        errors_picture(outcome),
        displays(outcome),
        report.table(HEAD, rows(outcome), text_columns=1),
    ]
    if outcome.answers:
        parts.insert(
            1,
            report.table(
                ("after / s", "what the panel said", "a person pressed"),
                [(f"{seconds:.1f}", why, key) for seconds, why, key in outcome.answers],
            ),
        )
    path = page(
        path,
        "S4: the unattended indexing machine",
        "Two nodes, simulated from the very RTL and firmware that go into the FPGA: one has the panel, the EEPROM and the keyboard "
        "of the wire-EDM machine, the other turns the table by its angle sensor. The true angle is that of the model at each cut.",
        parts,
        {
            "simulated time": f"{outcome.seconds:.0f} s",
            "worm": "errors, backlash and sensor error at random by the seed",
            "steps lost": str(lost),
            "sensor frames": f"{sensor.frames}, {sensor.wrong_crc + sensor.broken} damaged",
            "between the nodes": f"{peer.heard} heard, {peer.garbage} not understood, {peer.repeated} answered again",
            "again": f"build/venv/bin/python -m experiments.s4_job --seed {seed} --stations {count} --peers {mode}"
            + (" --trouble" if trouble else ""),
        },
    )
    console.print(f"{outcome.words}; ended {outcome.state.state}")
    console.print(f"report with pictures: {path}", soft_wrap=True)
    return outcome, path


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m experiments.s4_job",
        description="S4 in the twin: a whole job, judged by its cuts.",
    )
    parser.add_argument("--stations", type=int, default=36, help="parts of the turn (default 36)")
    parser.add_argument(
        "--peers",
        choices=MODES,
        default=MODES[0],
        help="what the nodes speak to each other (default frames)",
    )
    parser.add_argument(
        "--trouble",
        action="store_true",
        help="damaged sensor frames, garbage, a person who types, a power cut",
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="of the machine and of the trouble (default 1)"
    )
    options = parser.parse_args(arguments)
    try:
        outcome, _ = run(options.stations, options.peers, options.seed, options.trouble)
    except (MoireError, BuildError) as error:
        print(f"s4_job: {error}", file=sys.stderr)
        return getattr(error, "exit_code", 1)
    except KeyboardInterrupt:
        print("s4_job: interrupted", file=sys.stderr)
        return 130
    return int(outcome.failed)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Figure of a station's memory (S4): what is in the EEPROM after the power went at any moment.

The firmware runs on this computer around a model of the EEPROM, in which a page that is being
written when the power goes holds a
mixture of what was there, what was to be there, and noise.
"""

import random
from pathlib import Path

from figures.common import Figure, bar, console

ROOT = Path(__file__).resolve().parents[2]
CUTS = 1000
JOURNAL_SHARE, KEPT_SHARE = (
    0.2,
    0.3,
)  # of the cuts, into a line and into the keeping of values; the others fall into that of a program
SPARE = 1.1  # some cuts come when all has been written
STORE_STOPPED = 6  # a step of the journal that leaves no job open
VALUE_STATIONS = 4  # a kept value takes as long as so many stations: 16 bytes


def begin(station, angles):
    """Begins to write a program."""
    station.ask("job_begin")
    for n, angle in enumerate(angles):
        station.ask("job_add", station=n, angle=angle)
    station.ask("job_save")


def writing_ms(station):
    """A function of the count of stations: how long a program is written."""
    began = []
    for count in (1, 361 // 2):
        begin(station, range(count))
        start = station.clk
        station.saved()
        began.append((count, (station.clk - start) * 1000 / station.CLK_HZ))
    (low, short), (high, long) = began
    return lambda count: short + (long - short) * (count - low) / (high - low)


def torn(cuts=CUTS, seed=1):
    """Power cuts of so many after which program, journal or values were neither those of before nor
    the new ones, whole.
    """
    from twin.compiled.node import PARAMETER
    from twin.compiled.station import TURN, Station

    def values():
        return [
            station.ask("get_parameter", axis=0, parameter=number)["value"]
            for number in kept_numbers
        ]

    def state():
        return station.station_list(), station.ask("job_stations")["journal"], values()

    kept_numbers = [
        PARAMETER[f"filter_{n}_{name}"]["id"]
        for n in (1, 2)
        for name in ("b0", "b1", "b2", "a1", "a2")
    ]
    source, station = random.Random(seed), Station(seed=seed)
    station.ready()
    duration, invalid, found, pages = writing_ms(station), 0, {"old": 0, "new": 0}, 0
    station.save_settings()
    program, line, kept = state()
    with bar(f"{cuts} power cuts") as progress:
        for _ in progress.track(range(cuts)):
            new_program, new_line, new_kept = program, line, kept
            what = (
                source.random() if program else 1.0
            )  # without a program there is no line to write about one: a new one
            if what < JOURNAL_SHARE:
                new_line = line + 1
                assert (
                    station.firmware.journal_write(source.randrange(len(program)), STORE_STOPPED) == 0
                )
                span = duration(1) / 2
            elif what < JOURNAL_SHARE + KEPT_SHARE:
                for number in source.sample(kept_numbers, source.randrange(1, len(kept_numbers))):
                    station.ask(
                        "set_parameter", axis=0, parameter=number, value=source.randrange(2**30)
                    )
                new_kept = values()
                station.ask("save_settings", action=0)
                span = duration(len(kept_numbers) * VALUE_STATIONS)
            else:
                new_program = sorted(source.sample(range(TURN), source.randrange(1, 361)))
                begin(station, new_program)
                span = duration(len(new_program))
            station.run(source.uniform(0, SPARE * span))
            station.clk += source.randrange(station.POLL_CLK)
            pages += station.power_cut()
            station.ready()
            now, new = state(), (new_program, new_line, new_kept)
            whole = now in ((program, line, kept), new) and now[0] != []
            invalid += not whole
            found["new" if now == new else "old"] += whole
            program, line, kept = now
    console.print(
        f"{pages} pages torn; {found['old']} times as before, {found['new']} times the new one, {invalid} times neither"
    )
    return float(invalid)


FIGURES = {
    "eeprom_torn": Figure(
        torn,
        "programs",
        f"invalid program, journal or values after a power cut at each of {CUTS} random moments",
        "0",
        lambda value: value == 0,
        0,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Figure of a station's memory (S4): what is in the EEPROM after a power cut at any moment.

The firmware runs on this computer around a model of the EEPROM. A page that is being written when
the power goes holds a mixture of its old contents, its new contents and noise.
"""

import random
from collections.abc import Callable, Sequence
from typing import Any

from figures.common import Figure, Quick, bar, console
from twin.compiled.station import TURN, Station
from twin.compiled.tables import PARAMETER

CUTS = 1000
JOURNAL_SHARE, SETTINGS_SHARE = 0.2, 0.3  # of the cuts; the others come while a job is written
SPARE = 1.1  # some cuts come when all has been written
JOURNAL_STOPPED = 6  # a step of the journal that leaves no job open
VALUE_STATIONS = 4  # a saved value takes as long as so many stations: 16 bytes
SAVED_NUMBERS = [
    PARAMETER[f"filter_{n}_{name}"]["id"] for n in (1, 2) for name in ("b0", "b1", "b2", "a1", "a2")
]

State = tuple[list[int], int, list[Any]]  # job, length of its journal, settings


def begin(station: Station, angles: Sequence[int]) -> None:
    """Begins to write a job."""
    station.ask("job_begin")
    for n, angle in enumerate(angles):
        station.ask("job_add", station=n, angle=angle)
    station.ask("job_save")


def writing_ms(station: Station) -> Callable[[int], float]:
    """A function of the number of stations: how many ms it takes to write a job."""
    took = []
    for count in (1, 361 // 2):
        begin(station, range(count))
        start = station.clk
        station.saved()
        took.append((count, (station.clk - start) * 1000 / station.CLK_HZ))
    (low, short), (high, long) = took
    return lambda count: short + (long - short) * (count - low) / (high - low)


def values_of(station: Station) -> list[Any]:
    return [
        station.ask("get_parameter", axis=0, parameter=number)["value"] for number in SAVED_NUMBERS
    ]


def state_of(station: Station) -> State:
    """(job, length of its journal, settings)"""
    return station.station_list(), station.ask("job_stations")["journal"], values_of(station)


def begin_writing(
    station: Station, source: random.Random, old: State, duration: Callable[[int], float]
) -> tuple[State, float]:
    """Begins to write the journal, the settings or a job; (what is to be there then, ms that it
    takes).
    """
    job, journal, settings = old
    what = source.random() if job else 1.0  # without a job there is no journal to write
    if what < JOURNAL_SHARE:
        refused = station.firmware.journal_write(source.randrange(len(job)), JOURNAL_STOPPED)
        if refused:
            raise RuntimeError(f"the journal was refused with cause {refused}")
        return (job, journal + 1, settings), duration(1) / 2
    if what < JOURNAL_SHARE + SETTINGS_SHARE:
        for number in source.sample(SAVED_NUMBERS, source.randrange(1, len(SAVED_NUMBERS))):
            station.ask("set_parameter", axis=0, parameter=number, value=source.randrange(2**30))
        settings = values_of(station)
        station.ask("save_settings", action=0)
        return (job, journal, settings), duration(len(SAVED_NUMBERS) * VALUE_STATIONS)
    job = sorted(source.sample(range(TURN), source.randrange(1, 361)))
    begin(station, job)
    return (job, journal, settings), duration(len(job))


def torn(cuts: int = CUTS, seed: int = 1) -> float:
    """Power cuts, of so many, after which job, journal or settings were neither the old ones nor
    the new ones.
    """
    source, station = random.Random(seed), Station(seed=seed)
    station.ready()
    duration, invalid, found, pages = writing_ms(station), 0, {"old": 0, "new": 0}, 0
    station.save_settings()
    old = state_of(station)
    with bar(f"{cuts} power cuts") as progress:
        for _ in progress.track(range(cuts)):
            new, span = begin_writing(station, source, old, duration)
            station.run(source.uniform(0, SPARE * span))
            station.clk += source.randrange(station.POLL_CLK)
            pages += station.power_cut()
            station.ready()
            now = state_of(station)
            whole = now in (old, new) and now[0] != []
            invalid += not whole
            found["new" if now == new else "old"] += whole
            old = now
    console.print(
        f"{pages} pages partially written; {found['old']} times as before, {found['new']} times "
        f"the new one, {invalid} times neither"
    )
    return float(invalid)


FIGURES = {
    "eeprom_torn": Figure(
        torn,
        "states",
        f"invalid job, journal or settings after a power cut at each of {CUTS} random moments of "
        "writing, in a model of the EEPROM around the firmware",
        "0",
        Quick({"cuts": 40}, "40 power cuts"),
        0,
    ),
}

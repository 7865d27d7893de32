# SPDX-License-Identifier: Apache-2.0
"""Figure of the live page: how soon a browser shows it."""

import statistics

from figures import browser
from figures.common import Absent, Figure, Quick, console
from figures.serve import served
from moire.web import page as live_page

STARTS = 7
SHOWN = ".position [data-field=position]:not(:empty)"  # a position
FIRST_PAINT = 'performance.getEntriesByName("first-contentful-paint")[0].startTime'
NOW = "performance.now()"


def page_first_paint_ms(starts: int = STARTS) -> float:
    if not live_page.has_plots():
        raise Absent("uPlot is not fetched: make page")
    paints, shown = [], []
    with served() as ports:
        for _ in range(starts):
            with browser.opened() as chromium:
                page = chromium.new_page()
                page.goto(ports["http"])
                page.wait_for_selector(SHOWN)
                shown.append(float(page.evaluate(NOW)))
                paints.append(float(page.evaluate(FIRST_PAINT)))
    console.print(
        f"first paint after {min(paints):.0f} to {max(paints):.0f} ms; the first position of the "
        f"twin is shown after {min(shown):.0f} to {max(shown):.0f} ms"
    )
    return statistics.median(paints)


FIGURES = {
    "page_first_paint_ms": Figure(
        page_first_paint_ms,
        "ms",
        f"time from the request until Chromium first draws the live page of a served twin, over "
        f"loopback, median of {STARTS} starts of the browser with nothing cached",
        "<= 500",
        Quick({"starts": 1}, "one start, on a busy computer", ""),
        0,
    ),
}

# SPDX-License-Identifier: Apache-2.0
"""Sine against cosine of an axis for the clients of the doors: samples while it moves, the ellipse
through them, and their amplitude in words.
"""

from collections import deque
from http import HTTPStatus
from typing import Any

from moire.analysis.ellipse import Ellipse, Judged, Limits, NoEllipse, fit, judged
from moire.bus.arbiter import Place, request
from moire.client.axis import Axis
from moire.web.bridge import Bridge, Client, fields_of
from moire.web.refusals import BadRequest

KEPT = 512  # of a client and an axis
MOST, AT_FIRST = 128, 32  # of one request, and how many if it does not say

# (cosine, sine, amplitude) in ADC counts, and the position in nm
Samples = deque[tuple[int, int, int, float]]


def limits_of(axis: Axis) -> Limits | None:
    """The limits of the amplitude, None without a monitor; raises BadRequest without a sine."""
    built = axis.built()
    if not built.has("sine"):
        raise BadRequest(
            "not_built",
            f"axis {axis.node.address}.{axis.number} has no sine and cosine: its position is made "
            "of counts",
            "choose an axis with sine and cosine",
            HTTPStatus.CONFLICT,
        )
    if not built.has("monitor"):
        return None
    names = ("amplitude_low", "amplitude_high", "signal_clip_level")
    return Limits(*(axis.get_parameter(name).counts for name in names))


async def measured(
    bridge: Bridge, client: Client, place: Place, count: int, fresh: bool
) -> dict[str, Any]:
    """Takes so many samples, which this client keeps with its earlier ones, and fits an ellipse to
    all of them. A sample that is equal to the last one is not kept: the axis rests.
    """
    if not 1 <= count <= MOST:
        raise BadRequest(
            "out_of_range", f"{count} samples at once are not possible", f"ask for 1 to {MOST}"
        )
    limits = await bridge.command(client, place, limits_of)
    samples: Samples = client.samples.setdefault(place, deque(maxlen=KEPT))
    if fresh:
        samples.clear()
    for _ in range(count):
        fields = fields_of(await bridge.ask(place[0], request("encoder", axis=place[1])), place[0])
        newest = fields["cos"], fields["sin"]
        if not samples or samples[-1][:2] != newest:
            _, position_nm = await bridge.position(place, bridge.gateway.time)
            samples.append((*newest, fields["amplitude"], position_nm))
    return values_of(list(samples), limits)


def values_of(samples: list[tuple[int, int, int, float]], limits: Limits | None) -> dict[str, Any]:
    """The answer."""
    cos, sin = ([one[n] for one in samples] for n in (0, 1))
    curve: dict[str, list[float]] = {"cos": [], "sin": []}
    ellipse = None
    try:
        found = fit(cos, sin)
    except NoEllipse as error:
        verdict = Judged("unknown", f"No ellipse: {error}", "")
    else:
        verdict = judged(found, max(map(abs, cos + sin)), limits)
        curve["cos"], curve["sin"] = found.points()
        ellipse = ellipse_values(found)
    return {
        "cos": cos,
        "sin": sin,
        "amplitude": [one[2] for one in samples],
        "position_nm": [one[3] for one in samples],
        "limits": [] if limits is None else [limits.low, limits.high],
        "ellipse": ellipse,
        "curve": curve,
        "verdict": verdict.kind,
        "words": verdict.words,
        "to_do": verdict.to_do,
    }


def ellipse_values(found: Ellipse) -> dict[str, float]:
    """The ellipse by its fields."""
    return {**vars(found), "amplitude": found.amplitude}

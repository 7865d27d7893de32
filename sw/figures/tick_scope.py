# SPDX-License-Identifier: Apache-2.0
"""How fast a recording of ticks comes over the bus, which bounds `moire scope stream`."""

from figures.common import Figure, Quick, console
from moire.analysis.tick_scope import TickScope
from moire.client.bus import Bus
from twin import WITH_SCOPE, Twin, TwinTransport

BAUD = 115_200  # after power-up


def scope_words_per_s(words: int = 4000) -> float:
    """Words per second of the node while nothing else is on the bus."""
    twin = Twin(nodes=(1,), seed=1, node_parameters=WITH_SCOPE)
    twin.run_until_ready()
    axis = Bus(TwinTransport(twin)).axis(1)
    scope = TickScope(axis)
    scope.start(("error",), words)
    scope.wait()
    began, read = axis.transport.now(), 0
    while read < words:
        read += len(scope.some_words(read))
    per_s = words / (axis.transport.now() - began)
    tick_hz = axis.node.identity.tick_hz
    console.print(
        f"at {BAUD} baud: {per_s:.0f} words/s, such as 4 signals at {per_s / 4:.0f} Hz, or 1 in "
        f"every {-int(-tick_hz // per_s)} servo ticks"
    )
    return per_s


FIGURES = {
    "scope_words_per_s": Figure(
        scope_words_per_s,
        "/s",
        "words of a recording of ticks that one master reads over the bus at 115 200 baud, in the "
        "twin: samples times signals of `moire scope stream`",
        ">= 1000",
        Quick({"words": 300}, "300 words"),
    ),
}

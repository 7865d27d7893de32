# SPDX-License-Identifier: Apache-2.0
"""A jog: a motion that lasts as long as its client repeats that it shall. When the requests stay
away, since a finger has left a button, a page is hidden, or the network is gone, the axis is
stopped under control.

The times are those of the clock and not of the machine: it is a person who holds the button.
"""

import asyncio
from collections.abc import Awaitable, Callable

HOLD_S = 0.4  # so long a jog lasts after the last request; a page sends one each 0.1 s


class Jog:
    """The jog of an axis by a client, from the request that begins it. `stops` is the number of
    stops of this axis so far: the jog ends with the next one, whoever sends it. `stop` stops the
    axis if it still belongs to the client.
    """

    def __init__(self, stops: Callable[[], int], stop: Callable[[], Awaitable[None]]):
        self.stops, self.stop = stops, stop
        self.loop, self.first = asyncio.get_running_loop(), stops()
        self.ended = False
        self.moves = False  # the node has accepted the motion
        self.timer = self.loop.call_later(HOLD_S, self.lapse)
        self.stopping: asyncio.Future[None] | None = None

    @property
    def lasts(self) -> bool:
        """Whether nothing has ended the jog."""
        return not self.ended and self.stops() == self.first

    def hold(self) -> None:
        """The client has asked to go on."""
        self.timer.cancel()
        self.timer = self.loop.call_later(HOLD_S, self.lapse)

    async def begin(self) -> None:
        """The node has accepted the motion, which may have to end already."""
        self.moves = True
        if not self.lasts:
            await self.stop()

    def end(self) -> None:
        """The motion has not begun, or another one has."""
        self.ended = True
        self.timer.cancel()

    def lapse(self) -> None:
        """The requests have stayed away."""
        lasted, self.ended = self.lasts, True
        if lasted and self.moves:
            self.stopping = asyncio.ensure_future(self.stop())

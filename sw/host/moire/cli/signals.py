# SPDX-License-Identifier: Apache-2.0
"""SIGTERM and SIGHUP end a call as Ctrl-C does: what it moves is stopped under control."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP


class Ended(KeyboardInterrupt):
    """A signal has ended the call."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def end(number: int, frame: FrameType | None) -> None:
    """The handler of these signals."""
    raise Ended(number)


@contextmanager
def ending_by_signals() -> Iterator[None]:
    """Within it these signals raise Ended, unless they are handled or ignored already, as with
    nohup. Only the main thread of a process can do this; elsewhere nothing changes.
    """
    known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        known = []
    taken = [number for number in known if signal.getsignal(number) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)

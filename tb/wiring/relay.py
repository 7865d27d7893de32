# SPDX-License-Identifier: Apache-2.0
"""The relay in a bench."""

from mutation.library import Bench, library
from tb.system import test_relay

TOP = "relay"
PARAMETERS = {
    "K": test_relay.K,
    "BAUD": test_relay.BAUD,
    "FIRST": test_relay.FIRST,
    "SECOND": test_relay.SECOND,
}


class Relay(Bench):
    """The relay, before its reset."""

    def __init__(self, path=None, mutant=(0, 0, 0)):
        super().__init__(path or library(TOP, PARAMETERS), mutant)

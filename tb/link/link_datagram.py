# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/link/link_datagram.sv in integers: outputs(...) gives the outputs of a cycle,
step(...) advances it.
"""

from moire.made import link_tables as layout


class LinkDatagram:
    def __init__(self):
        self.host = self.master = None  # never seen yet
        self.ended = self.known = 0

    def outputs(self, reads, locked, rx_valid, rx_error, **_):
        """(rx_ready, receiver, length, valid, ends, broken, foreign); the receiver is None before
        the first request.
        """
        taken = int(rx_valid and not self.ended)
        foreign = int(locked and self.known and self.host != self.master)
        length = 4 * (reads + layout.REPLY_FRAME_WORDS)
        ready, broken = int(not self.ended), int(taken and rx_error)
        return ready, self.master, length, taken, self.ended, broken, foreign

    def step(self, enable, rx_valid, rx_last, sender, accepted, rst, **_):
        taken = rx_valid and not self.ended
        if accepted:
            self.master = self.host
        if taken:
            self.host = sender
        self.known = int(enable and (self.known or accepted) and not rst)
        self.ended = int(taken and rx_last and not rst)

# SPDX-License-Identifier: Apache-2.0
"""Model of rtl/sense/lissajous_monitor.sv for many signals side by side: sample() processes one
sample of each.
"""

import numpy as np

NEVER = 65535


class LissajousMonitor:
    def __init__(self, lanes=1):
        self.lengths = np.zeros((2, 4, lanes), np.int64)  # of the axes, of the diagonals
        self.known = np.zeros((2, 4, lanes), bool)
        self.sector, self.side, self.middle = (np.zeros((2, lanes), np.int64) for _ in range(3))
        self.met = np.zeros((2, lanes), bool)
        self.lane, self.started = np.arange(lanes), False
        # 0: the shape at the axes is judged, 1: at the diagonals
        self.shape_kind, self.drift = 0, np.zeros((2, lanes), bool)
        self.oval = np.zeros((2, lanes), bool)

    def sample(
        self, length, axis, quadrant, tilt, tolerance, offset_limit, balance_limit, quadrature_limit
    ):
        """Returns ready after this sample, then off_circle, offset_drift, unbalanced,
        not_in_quadrature, judged by the circle that was known before it.
        """
        ready = self.known.all(axis=(0, 1))
        at_axis, at_diagonal = (
            self.lengths[0, axis, self.lane],
            self.lengths[1, quadrant, self.lane],
        )
        expected = at_axis + ((at_diagonal - at_axis) * tilt >> 2)
        off_circle = ready & (tolerance != NEVER) & (abs(length - expected) > tolerance)
        east, north, west, south = self.lengths[self.shape_kind]
        offset = np.maximum(abs(east - west), abs(north - south))
        oval = abs(east + west - north - south)
        limit = (balance_limit, quadrature_limit)[self.shape_kind]
        self.drift[self.shape_kind] = ready & (offset_limit != NEVER) & (offset > 2 * offset_limit)
        self.oval[self.shape_kind] = ready & (limit != NEVER) & (oval > 2 * limit)
        self.shape_kind = 1 - self.shape_kind
        drift, (unbalanced, skewed) = self.drift.any(axis=0), self.oval.copy()
        for kind, sector, close in [(0, axis, tilt == 0), (1, quadrant, tilt == 4)]:
            onward = (sector - self.sector[kind]) % 4 if self.started else np.full(sector.shape, 2)
            (crossed,) = np.nonzero(
                (onward % 2 == 1) & (self.side[kind] == onward) & self.met[kind]
            )
            if crossed.size:
                entry = kind, self.sector[kind, crossed], crossed
                before, middle = self.lengths[entry], self.middle[kind, crossed]
                self.lengths[entry] = np.where(self.known[entry], before + middle + 1 >> 1, middle)
                self.known[entry] = True
            self.met[kind] = close | self.met[kind] & (onward == 0)
            self.middle[kind] = np.where(close, length, self.middle[kind])
            self.side[kind] = np.where(
                onward == 0, self.side[kind], np.where(onward == 2, 0, onward)
            )
            self.sector[kind] = sector
        self.started = True
        return self.known.all(axis=(0, 1)), off_circle, drift, unbalanced, skewed

# SPDX-License-Identifier: Apache-2.0
"""An axis with a scale of counts and its index, as far as a survey of the index needs one: passes
at a constant speed, in which every edge of A, B and Z is drawn again.
"""

import random
from fractions import Fraction
from types import SimpleNamespace

from moire.client.built import Built
from moire.client.capture import LONGEST_AGE
from moire.client.records import Capture
from moire.client.values import counts_of, one_count, parameter, value_of
from moire.errors import MotionFailed

CLK_HZ = 60_000_000
COUNT_NM = 1000
PERIOD_NM = Fraction(4 * COUNT_NM)
PARAMETERS = {
    "home_method": "s3",
    "home_distance": "1mm",
    "homing_search_speed": "20mm/s",
    "acceleration": "2m/s2",
    "jerk": "200m/s3",
    "velocity": "50mm/s",
    "travel_low": "-5mm",
    "travel_high": "5mm",
    "position_source": "counts",
    "decoder_mode": "every_edge",
}


class IndexAxis:
    """`indexes` are (position, width) in counts. `shifts` are those of the four edges of A and B in
    a period, `scatter` that of each edge of A and B, `index_scatter` and `hysteresis` those of Z.
    """

    def __init__(
        self,
        *indexes,
        shifts=(0, 0, 0, 0),
        scatter=0.0,
        index_scatter=0.0,
        hysteresis=0.0,
        slowness=1.0,
        missed=0.0,
        queue=True,
        seed=1,
        **parameters,
    ):
        self.indexes, self.shifts, self.scatter = indexes, shifts, scatter
        self.index_scatter, self.hysteresis = index_scatter, hysteresis
        self.slowness, self.missed = slowness, missed  # of the passes; share of lost captures
        self.queue = queue  # of captures, is built
        self.random = random.Random(seed)
        self.period_nm, self.number = PERIOD_NM, 0
        self.node = SimpleNamespace(identity=SimpleNamespace(clk_hz=CLK_HZ))
        self.counts = {}
        for name, text in {**PARAMETERS, **parameters}.items():
            self.write_parameter(name, counts_of(parameter(name), text, self.one(name)))
        self.registers = {
            "index": dict(active_low=0, gate_mask=0, gate=0, up=1, down=1, each=0),
            "capture_sources": {"value": 0},
        }
        self.origin, self.at, self.waiting, self.homings = 0, 0.0, [], 0

    def one(self, name):
        return one_count(parameter(name), PERIOD_NM)

    def get_parameter(self, name):
        known = parameter(name)
        return value_of(known, self.counts.get(name, known.default), self.one(name))

    def write_parameter(self, name, counts):
        self.counts[name] = counts
        if name == "index_gate":
            state = counts - 1
            gate = (3, state ^ state >> 1) if counts else (0, 0)
            self.registers["index"] |= dict(zip(("gate_mask", "gate"), gate))

    def built(self):
        return Built({"capture": int(self.queue)})

    def feedback(self, register):
        return dict(self.registers[register])

    def write_feedback(self, register, **fields):
        if register == "strobes":
            self.waiting = []
        else:
            self.registers[register] = fields

    def drawn(self, scatter):
        return self.random.uniform(-scatter, scatter)

    def passed(self, index, up, gate=None, ended=False):
        """(count, counts behind its edge) at which an index is met; None if its gate is not. With
        `ended`, it is where the index ends.
        """
        position, width = index
        low, high = (
            edge + self.drawn(self.index_scatter) - (0 if up else self.hysteresis)
            for edge in (position, position + width)
        )
        first = int(low) - 4
        edges = [
            first + n + self.shifts[(first + n) % 4] + self.drawn(self.scatter)
            for n in range(int(width) + 12)
        ]
        if ended:
            low, high = (high, edges[-1]) if up else (edges[0], low)
        states = range(len(edges) - 1)
        for n in states if up else reversed(states):
            begin, end = max(edges[n], low), min(edges[n + 1], high)
            if begin < end and gate in (None, (first + n) % 4):
                return first + n, begin - edges[n] if up else edges[n + 1] - end
        return None

    def move(self, nm):
        """Passes what is between here and there."""
        begin, end = self.at, float(nm) / COUNT_NM + self.origin
        self.at, up, index = end, end > begin, self.registers["index"]
        if not (self.registers["capture_sources"]["value"] and index["up" if up else "down"]):
            return
        gray = index["gate"]
        gate = gray ^ gray >> 1 if index["gate_mask"] else None
        speed = float(self.get_parameter("homing_search_speed").value) * 1e6 / COUNT_NM
        for position, width in sorted(self.indexes, reverse=not up):
            inside = min(begin, end) < position and position + width < max(begin, end)
            if not inside or self.random.random() < self.missed:
                continue
            met = self.passed((position, width), up, gate, bool(index["active_low"]))
            if met:
                self.waiting.append(
                    Capture(
                        ("index",),
                        (met[0] - self.origin) * COUNT_NM,
                        0,
                        min(met[1] / speed * self.slowness, LONGEST_AGE / CLK_HZ),
                    )
                )

    def captures(self):
        return self.waiting, False

    def home(self):
        """Takes the first index, with its gate, as the zero."""
        self.homings += 1
        self.registers["index"] |= dict(up=1, down=1)
        up = self.counts["home_method"] not in (2, 33)
        gate = self.counts.get("index_gate", 0)
        met = self.indexes and self.passed(min(self.indexes), up, gate - 1 if gate else None)
        if not met:
            raise MotionFailed("no_index", 21, "no index was found within the home distance")
        self.at = self.origin = met[0]

    def zeros(self, homings):
        """The counts that so many searches find."""
        found = set()
        for _ in range(homings):
            self.home()
            found.add(self.origin)
        return found

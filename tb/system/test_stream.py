# SPDX-License-Identifier: Apache-2.0
"""A stream on the simulated S0 node: its firmware and RTL play a path, and every target that is
seen on the way is one of the cubic's.
"""

import math
import random
from fractions import Fraction

from moire.client.bus import Bus
from moire.client.stream import Cubic, Point, set_points
from tb.bench import seed
from tb.firmware.stream_model import pieces_to, targets
from twin import Twin, TwinTransport, build
from twin.nodes.twin import CLK_HZ

TICK_HZ = 4000
TAIL = 150_000 * TICK_HZ // CLK_HZ + 4
PERIOD, PERIOD_NM = 65536, 800
NEAR_NM = 3000  # of the axis to its target on the way


def path(step_ms=20, count=16, nm=250_000):
    """Half a cosine from 0 to `nm`, at rest at both ends."""
    w = math.pi / count
    points = []
    for n in range(count + 1):
        position = nm * (1 - math.cos(w * n)) / 2
        velocity = nm * w * math.sin(w * n) / 2 / step_ms / 1000 if 0 < n < count else 0
        points.append(
            Point(Fraction(n * step_ms, 1000), Fraction(round(position)), Fraction(velocity))
        )
    return points


def test_a_streamed_path_is_the_cubic_through_its_points_in_every_tick():
    points = path()
    pieces, state, tick = [], (0, 0), 0
    sent = set_points(points, Fraction(PERIOD_NM), TICK_HZ)
    for n, one in enumerate(sent):
        more, state = pieces_to(
            state, one.tick - tick, one.position, one.velocity, TAIL, n == len(sent) - 1
        )
        pieces, tick = pieces + more, one.tick
    expected = [0] + [target >> 24 for target in targets(pieces)]
    expected[-1] = sent[-1].position
    for n, cubic in enumerate(Cubic(a, b) for a, b in zip(points, points[1:])):
        for within in range(80):
            true = cubic.position_nm(Fraction(within, TICK_HZ)) * PERIOD / PERIOD_NM
            assert abs(expected[80 * n + within] - true) < 2  # 24 pm

    with Twin(nodes=(1,), seed=seed() % 1000, firmware=build.firmware("stream")) as twin:
        axis = Bus(TwinTransport(twin), random_source=random.Random(seed()), poll_s=0.004).axis(1)
        twin.run_until_ready()
        axis.set_parameter("home_method", 35)
        axis.enable()
        axis.home()
        seen = []
        status = axis.stream(points, progress=seen.append)
        assert status.ended == "ok" and round(status.target_nm) == 250_000 and not status.faults
        place = 0
        for one in seen:
            counts = round(one.target_nm * PERIOD / PERIOD_NM)
            place = expected.index(counts, place)
            assert abs(one.position_nm - one.target_nm) < NEAR_NM
        between = {one.target_nm for one in seen if 0 < one.target_nm < 250_000}
        assert len(between) > 5
        stream = axis.request("stream")
        assert (stream["accepted"], stream["late"], stream["extrapolated"]) == (len(sent), 0, 0)

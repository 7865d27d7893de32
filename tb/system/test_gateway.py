# SPDX-License-Identifier: Apache-2.0
"""`moire twin` runs as a separate program, and the clients in this one. A client can do here what
it can do on hardware, with the same bytes.
"""

import io
import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy
import pytest

from moire.analysis.scope import Scope, excite, lsb
from moire.analysis.tune import identify_samples
from moire.bus.transport import open_bus
from moire.cli import command_line
from moire.client.bus import Bus
from moire.errors import BusGarbled, NoAnswer
from twin import Twin, TwinTransport

PATIENCE = "60s"  # of the clock: the twin is slow on a busy computer, and loses no answer
ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.filterwarnings(
    "ignore:set(Daemon|Name).. is deprecated:DeprecationWarning"
)  # in pyserial


@contextmanager
def served(*arguments):
    """Run `moire twin` as a program; the value is its ports."""
    command = [
        sys.executable,
        "-m",
        "moire",
        "twin",
        *arguments,
        "--http",
        "0",
        "--rfc2217",
        "0",
        "--tcp",
        "0",
        "--json",
    ]
    path = os.pathsep.join(map(str, (ROOT / "sw", ROOT / "sw" / "host")))
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": path}
    ) as process:
        yield json.loads(process.stdout.readline())
        process.terminate()


@pytest.fixture(scope="module")
def ports():
    with served("--nodes", "1") as ports:
        yield ports


def moire(*arguments, code=0):
    out, err = io.StringIO(), io.StringIO()
    words = [*arguments, "--patience", PATIENCE, "--json"]
    assert command_line.main(words, None, out, err) == code, out.getvalue()
    return [json.loads(row) for row in out.getvalue().splitlines()]


@pytest.mark.parametrize(
    "entrance, parity",
    [("rfc2217", "mark"), ("rfc2217", "none"), ("tcp", "auto"), ("terminal", "auto")],
)
def test_every_entrance_leads_to_the_node(ports, entrance, parity):
    results = moire("--port", ports[entrance], "--parity", parity, "selftest", "--", "status")
    assert results[0]["passed"] and results[1]["state"] == "off"


def test_homes_and_moves_over_the_network_and_another_client_sees_it(ports):
    results = moire("--port", ports["tcp"], "home", "--", "move", "150um")
    assert results[-1]["command"] == "move" and abs(results[-1]["error_nm"]) < 50
    seen = moire("--port", ports["rfc2217"], "status")[0]
    assert (
        seen["homed"] and abs(seen["position_nm"] - 150_000) < 50_000
    )  # the drive is off, so the springs have relaxed


def test_a_client_at_another_rate_receives_nothing_and_disturbs_nothing(ports):
    with open_bus(ports["rfc2217"], baud=19200, parity="mark") as port:
        with pytest.raises(NoAnswer, match="check power, wiring, baud rate and address"):
            Bus(port, tries=2).node()
    assert moire("--port", ports["tcp"], "status")[0]["command"] == "status"


@pytest.mark.parametrize("apart_s", [0.0053, 0.01, 0.0177])
def test_two_nodes_with_one_address_are_distinguished_from_silence(apart_s):
    with TwinTransport(Twin(nodes=(1, 1))) as line:
        line.twin.power_cut(1)
        line.wait(apart_s)
        line.twin.power_on(1)
        line.twin.run_until_ready()
        with pytest.raises(BusGarbled, match="two nodes with the address 1"):
            Bus(line).find()


def test_a_recorded_session_replays_on_the_twin_to_the_last_bit(tmp_path):
    file = str(tmp_path / "session.jsonl")
    moire(
        "--port",
        "twin",
        "--record",
        file,
        "baud",
        "300000",
        "1",
        "2",
        "--",
        "enable",
        "--",
        "wait",
        "50ms",
        "--",
        "status",
    )
    result = moire("--port", "twin", "replay", file)[0]
    assert result["same"] > 10 and result["other_values"] == result["different"] == 0
    rows = moire("replay", file, "--show")[0]["said"]
    assert [row.split("s  ")[1] for row in rows if "break" in row or "baud from" in row] == [
        "300000 baud from here on",
        "break",
        "115200 baud from here on",
    ]


def test_the_scope_sees_what_the_machine_does_and_the_plant_is_found():
    with TwinTransport(Twin(nodes=(1,))) as line:
        axis, twin = Bus(line).axis(), line.twin
        line.wait(0.05)
        axis.enable()
        axis.home()
        scope = Scope(axis)
        scope.arm("motion", before=10)
        line.wait(0.1)
        twin.trace(0, 10_000)
        axis.move("100um")
        record, trace = scope.wait(), twin.take_trace(0)
        seen, times = numpy.array(record.position_nm), numpy.array(record.time_s)
        assert record.before == 10 and seen[-1] - seen[0] == pytest.approx(100_000, abs=50)
        # the record has no absolute time: it equals the true motion with a shift in time
        after = times >= 0
        worst = min(
            abs(
                numpy.interp(times[after] + shift, trace["time_s"], trace["position_m"] * 1e9)
                - seen[after]
            ).max()
            for shift in trace["time_s"][0] + numpy.arange(0, 0.1, 1e-5)
        )
        assert worst < 0.1e-3 * 4.8e6  # a time is right to 0.1 ms, here at the top speed
        assert max(record.command) > 0.05

        plant = identify_samples(*lsb(excite(axis, "40%")), 1 / axis.node.identity.tick_hz)
        assert plant.unexplained < 0.1
        by_hand = (
            axis.get_parameter("kv").value,
            axis.get_parameter("ka").value,
        )  # feed-forward that fits this stage
        assert 1 / plant.gain == pytest.approx(
            float(by_hand[0]), rel=0.2
        ) and 1 / plant.b == pytest.approx(float(by_hand[1]), rel=0.2)
        assert axis.status().state == "holding"

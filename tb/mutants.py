# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of a simulation once for each mutant of a block: in processes that fork off before
the first cycle.

cocotb imports this module after the tests of a simulation, when everything is loaded and no time
has passed. A copy of the process is made for each mutant, which selects it and goes on to the tests
until one fails. So a mutant costs the cycles of its tests, and neither the start of Python nor of
the simulator. The first copy has no mutant: it must pass, and it writes the results of the
simulation. The parent ends when all are done.

MUTANT_VERDICTS=file MUTANT_NUMBERS='1 2 3' in the environment; a line of the file is `number test`,
without a test for a survivor.
"""

import math
import os
import resource
import xml.etree.ElementTree
from pathlib import Path

import cocotb
from cocotb.handle import Immediate

PATIENCE, LEAST_S = 3, 5  # a test has no end if it takes so many times as without a mutant, and 5 s
ENDLESS, CRASHED = "(no end)", "(the simulation ends by itself)"


def quiet():
    """Nobody reads what the tests of a mutant print."""
    null = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(null, stream)


def forked(number, results, seconds):
    """(exit status, computing time in s) of a copy with this mutant; None in the copy itself."""
    pid = os.fork()
    if pid:
        _, status, used = os.wait4(pid, 0)
        return status, used.ru_utime + used.ru_stime
    os.environ["COCOTB_RESULTS_FILE"] = str(results)
    if number:
        quiet()
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
    if hasattr(cocotb.top, "mutant"):  # a netlist without a cell has none
        cocotb.top.mutant.value = Immediate(number)
    return None


def verdict(results, status):
    """The test that has found a mutant, empty if none has."""
    if os.WIFSIGNALED(status):
        return ENDLESS if os.WTERMSIG(status) == 24 else CRASHED
    if not results.exists():
        return CRASHED
    for case in xml.etree.ElementTree.parse(results).getroot().iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            return case.get("name")
    return ""


def serve(path, numbers):
    """Run the tests without a mutant, and with each of these; returns in the copies only."""
    results = Path(os.environ["COCOTB_RESULTS_FILE"])
    own = results.with_name("mutant.xml")
    done = forked(0, results, 0)
    if done is None:
        return
    seconds = math.ceil(PATIENCE * done[1] + LEAST_S)
    with open(path, "w", buffering=1) as file:
        for number in numbers if verdict(results, done[0]) == "" else ():
            own.unlink(missing_ok=True)
            done = forked(number, own, seconds)
            if done is None:
                return
            file.write(f"{number} {verdict(own, done[0])}\n")
    os._exit(0)


if "MUTANT_VERDICTS" in os.environ and cocotb.is_simulation:
    serve(os.environ["MUTANT_VERDICTS"], map(int, os.environ["MUTANT_NUMBERS"].split()))

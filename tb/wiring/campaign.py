# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the wiring against mutants of a design: each mutant in a process of its own,
until a test fails.

python -m tb.wiring.campaign TOP LIBRARY JOBS < mutants > verdicts

A line of the input is `name;connection;kind;swap;group`, one of the output `name;test`, with an
empty test for a survivor. The tests that found mutants of the same group come first, slow ones
last. A mutant that crashes the simulation or does not end counts as found.
"""

import itertools
import os
import resource
import select
import sys
import time
from collections import Counter, defaultdict
from importlib import import_module
from pathlib import Path

SECONDS = 120  # of computing time that a mutant may take
CRASHED = "the simulation ends by itself"


def cases(function):
    """(name, arguments) of each case of a test, as pytest makes them of its marks."""
    lists = []
    for mark in getattr(function, "pytestmark", ()):
        names, values = mark.args[:2]
        names = [name.strip() for name in names.split(",")]
        lists.append(
            [dict(zip(names, value if len(names) > 1 else [value])) for value in values]
        )
    for chosen in itertools.product(*lists):
        arguments = {name: value for part in chosen for name, value in part.items()}
        label = "-".join(str(value) for value in arguments.values())
        yield function.__name__ + (f"[{label}]" if label else ""), function, arguments


def collect(top):
    """The tests of a design, which take it as an argument of its name."""
    found = {}
    for file in sorted(Path(__file__).parent.glob("test_*.py")):
        module = import_module(f"tb.wiring.{file.stem}")
        for name, function in vars(module).items():
            if name.startswith("test_") and top in function.__code__.co_varnames[:1]:
                for label, test, arguments in cases(function):
                    found[f"{file.stem}::{label}"] = test, arguments
    return found


def child(work):
    """The pid of a process that writes what work() returns, and the pipe."""
    reader, writer = os.pipe()
    pid = os.fork()
    if pid:
        os.close(writer)
        return pid, reader
    os.close(reader)
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    os.write(writer, work().encode())
    os._exit(0)


class Campaign:
    """The mutants of a design."""

    def __init__(self, top, path):
        bench = getattr(import_module(f"tb.wiring.{top}"), top.capitalize())
        self.make = lambda mutant: bench(path, mutant)
        self.make((0, 0, 0)).close()
        self.tests = collect(top)
        self.seconds = dict.fromkeys(self.tests, 0.0)
        self.found = defaultdict(Counter)  # group: tests
        self.all_found = Counter()

    def fails(self, name, mutant):
        """Whether a test fails with this mutant."""
        test, arguments = self.tests[name]
        try:
            design = self.make(mutant)
            test(design, **arguments)
            design.close()
        except Exception:  # whatever it is: the test has seen something
            return True
        return False

    def order(self, group):
        """The tests, likely ones first."""
        found = self.found[group]
        worth = {
            name: (found[name] * 50 + self.all_found[name] + 1) / (self.seconds[name] + 0.05)
            for name in self.tests
        }
        return sorted(self.tests, key=lambda name: -worth[name])

    def unchanged(self):
        """The tests that fail without a mutant, and how long each takes."""
        def work():
            said = []
            for name in self.tests:
                began = time.process_time()
                bad = self.fails(name, (0, 0, 0))
                said.append(f"{name};{int(bad)};{time.process_time() - began}")
            return "\n".join(said)

        pid, reader = child(work)
        with os.fdopen(reader) as pipe:
            lines = pipe.read().splitlines()
        os.waitpid(pid, 0)
        rows = [line.rsplit(";", 2) for line in lines]
        self.seconds |= {name: float(seconds) for name, _, seconds in rows}
        return [name for name, bad, _ in rows if bad == "1"] + sorted(
            set(self.tests) - {name for name, *_ in rows}
        )

    def first_failure(self, order, mutant):
        """The test that finds a mutant."""
        return next((name for name in order if self.fails(name, mutant)), "")

    def run(self, mutants, jobs):
        """(name, test) of each mutant."""
        waiting, running = list(reversed(mutants)), {}
        while waiting or running:
            while waiting and len(running) < jobs:
                name, selected, group = waiting.pop()
                order = self.order(group)
                pid, reader = child(lambda: self.first_failure(order, selected) or "-")
                running[reader] = pid, name, group
            for reader in select.select(list(running), [], [])[0]:
                said = os.read(reader, 1000).decode()
                os.close(reader)
                pid, name, group = running.pop(reader)
                os.waitpid(pid, 0)
                test = {"": CRASHED, "-": ""}.get(said, said)
                if test and said:
                    self.found[group][test] += 1
                    self.all_found[test] += 1
                yield name, test


def main(top, path, jobs):
    campaign = Campaign(top, Path(path))
    if wrong := campaign.unchanged():
        sys.exit(f"these tests fail without a mutant: {', '.join(wrong)}")
    mutants = []
    for line in sys.stdin:
        name, connection, kind, swap, group = line.rstrip("\n").rsplit(";", 4)
        mutants.append((name, (int(connection), int(kind), int(swap)), group))
    for name, test in campaign.run(mutants, int(jobs)):
        print(f"{name};{test}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the wiring against mutants of a design: each mutant in a process of its own,
until a test fails.

python -m tb.wiring.campaign TOP LIBRARY JOBS < mutants > verdicts

A line of the input is `name;connection;kind;swap;group`, one of the output `name;test`, with an
empty test for a survivor. Tests that have rare words in common with the name of the mutant, or
found others of its group, come first. A mutant that crashes the simulation or does not end counts
as found.
"""

import inspect
import itertools
import os
import re
import resource
import select
import sys
from collections import Counter, defaultdict
from functools import partial
from importlib import import_module
from pathlib import Path

SECONDS = 60  # of computing time that a test may take
SLOW = ("test_the_heartbeat_of_the_soft_core_keeps_the_drives_on",)  # seconds each
CRASHED = "the simulation ends by itself"


def cases(function):
    """(name, arguments) of each case of a test, as pytest makes them of its marks."""
    lists = []
    for mark in getattr(function, "pytestmark", ()):
        names, values = mark.args[:2]
        names = [name.strip() for name in names.split(",")]
        lists.append([dict(zip(names, value if len(names) > 1 else [value])) for value in values])
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
            if not (name.startswith("test_") and inspect.isfunction(function)):
                continue
            if top in function.__code__.co_varnames[:1]:
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
    os.write(writer, work().encode())
    os._exit(0)


def words_of(text):
    """The words of names and texts."""
    return set(re.findall(r"[a-z]{3,}|[abz]\b", text.lower()))


class Campaign:
    """The mutants of a design."""

    def __init__(self, top, path):
        name = "".join(word.capitalize() for word in top.split("_"))
        bench = getattr(import_module(f"tb.wiring.{top}"), name)
        self.make = lambda mutant: bench(path, mutant)
        self.make((0, 0, 0)).close()
        self.tests = collect(top)
        self.slow = {name for name, (test, _) in self.tests.items() if test.__name__ in SLOW}
        self.words = {
            name: words_of(inspect.getsource(test)) for name, (test, _) in self.tests.items()
        }
        self.rare = Counter(word for words in self.words.values() for word in words)
        self.found = defaultdict(Counter)  # group: tests
        self.all_found = Counter()
        self.good = {}  # test: whether it passes without a mutant

    def fails(self, name, mutant):
        """Whether a test fails with this mutant."""
        test, arguments = self.tests[name]
        used = resource.getrusage(resource.RUSAGE_SELF)
        end = int(used.ru_utime + used.ru_stime) + SECONDS
        resource.setrlimit(resource.RLIMIT_CPU, (end, resource.RLIM_INFINITY))
        try:
            design = self.make(mutant)
            test(design, **arguments)
            design.close()
        except Exception:  # whatever it is: the test has seen something
            return True
        return False

    def order(self, name, group):
        """The tests, likely ones first: those that share rare words with the name of the mutant,
        and those that found others of its group.
        """
        words, found = words_of(name), self.found[group]

        def worth(test):
            shared = sum(3 / self.rare[word] for word in words & self.words[test])
            likely = shared + found[test] + 0.01 * self.all_found[test]
            return likely / 10 if test in self.slow else likely

        return sorted(self.tests, key=worth, reverse=True)

    def first_failure(self, order, mutant):
        """The test that finds a mutant, or `-`."""
        return next((name for name in order if self.fails(name, mutant)), "-")

    def passes(self, test):
        """Whether a test passes without a mutant, so that its failure says something."""
        if test not in self.good:
            pid, reader = child(lambda: "bad" if self.fails(test, (0, 0, 0)) else "good")
            with os.fdopen(reader) as pipe:
                self.good[test] = pipe.read() == "good"
            os.waitpid(pid, 0)
        return self.good[test]

    def run(self, mutants, jobs):
        """(name, test) of each mutant."""
        waiting, running = list(reversed(mutants)), {}
        while waiting or running:
            while waiting and len(running) < jobs:
                name, selected, group = waiting.pop()
                order = self.order(name, group)
                pid, reader = child(partial(self.first_failure, order, selected))
                running[reader] = pid, name, group
            for reader in select.select(list(running), [], [])[0]:
                said = os.read(reader, 1000).decode()
                os.close(reader)
                pid, name, group = running.pop(reader)
                os.waitpid(pid, 0)
                test = {"": CRASHED, "-": ""}.get(said, said)
                if test in self.tests:
                    if not self.passes(test):
                        sys.exit(f"{test} fails without a mutant")
                    self.found[group][test] += 1
                    self.all_found[test] += 1
                yield name, test


def main(top, path, jobs):
    campaign = Campaign(top, Path(path))
    mutants = []
    for line in sys.stdin:
        name, connection, kind, swap, group = line.rstrip("\n").rsplit(";", 4)
        mutants.append((name, (int(connection), int(kind), int(swap)), group))
    for name, test in campaign.run(mutants, int(jobs)):
        print(f"{name};{test}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

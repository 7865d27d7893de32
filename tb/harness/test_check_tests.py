# SPDX-License-Identifier: Apache-2.0
"""tools/check_tests.py: each way in which a test cannot fail is found, what can fail is left alone,
and our own tests are clean.
"""

import pytest

from tb.bench import needs
from tb.simulator import results
from tools import check_tests

HEAD = """
import cocotb
import pytest
from probe_helper import compared

async def clk(dut):
    assert dut.out.value == 1

async def begin(dut):
    return 5

class Bench:
    async def go(self):
        await clk(self.dut)
"""


def faults(tmp_path, body, decorator="@cocotb.test()\nasync "):
    helper, test = tmp_path / "probe_helper.py", tmp_path / "test_probe.py"
    helper.write_text(
        "def compared(got, want):\n    assert got == want\n\ndef looked(dut):\n    return dut\n"
    )
    test.write_text(
        f"{HEAD}\n\n{decorator}def test_it(dut):\n"
        + "".join(f"    {line}\n" for line in body.splitlines())
    )
    return [what.split(":")[0] for _, _, what in check_tests.faults(test, {"probe_helper": helper})]


@pytest.mark.parametrize(
    "body, found",
    [
        ("if dut.W.value != 8:\n    return\nassert dut.out.value == 1", ["returns early"]),
        ("for n in range(3):\n    if n:\n        return\nassert n == 2", ["returns early"]),
        ("dut.a.value = 1\nawait begin(dut)", ["compares nothing, or only under a condition"]),
        (
            "if await begin(dut) == 8:\n    assert dut.out.value == 1",
            ["compares nothing, or only under a condition"],
        ),
        (
            "if await begin(dut) == 8:\n    await clk(dut)\nelse:\n    dut.a.value = 1",
            ["compares nothing, or only under a condition"],
        ),
        ("assert True", ["asserts a constant", "compares nothing, or only under a condition"]),
        (
            "try:\n    await begin(dut)\nexcept ValueError as why:\n    assert why",
            ["compares nothing, or only under a condition"],
        ),
        ("def inner():\n    assert dut", ["compares nothing, or only under a condition"]),
        ("assert await begin(dut) == 5", []),
        ("await clk(dut)", []),
        ("await Bench().go()", []),
        ("compared(dut.out.value, 1)", []),
        ("for n in range(3):\n    await clk(dut)", []),
        ("if await begin(dut):\n    await clk(dut)\nelse:\n    assert dut.out.value == 0", []),
        ("with pytest.raises(ValueError):\n    await begin(dut)", []),
        ("def inner():\n    return 5\nassert inner() == 5", []),
    ],
)
def test_what_cannot_fail_is_found(tmp_path, body, found):
    assert faults(tmp_path, body) == found


def test_a_test_that_runs_a_simulation_compares_there(tmp_path):
    assert faults(tmp_path, 'run("thing", __file__)', decorator="") == []
    assert faults(tmp_path, "begin(dut)", decorator="") == [
        "compares nothing, or only under a condition"
    ]


def test_the_tests_of_this_project_can_fail(capsys):
    assert check_tests.main([]) == 0, capsys.readouterr().out


def test_a_fault_is_reported_with_its_line_and_exit_code_1(tmp_path, capsys):
    faults(tmp_path, "if dut:\n    return\nassert dut")
    path = tmp_path / "test_probe.py"
    assert check_tests.main([str(path)]) == 1
    line = path.read_text().splitlines().index("        return") + 1
    assert capsys.readouterr().out.startswith(f"{path}:{line}: test_it returns early")


def test_needs_skips_with_its_reason():
    with pytest.raises(pytest.skip.Exception, match="built without filters"):
        needs(0, "built without filters")
    assert needs(1, "") is None


@pytest.mark.parametrize(
    "counts, found",
    [
        ('tests="3" skipped="1" failures="0" errors="0"', (2, 1, 0)),
        ('tests="3" skipped="3" failures="0"', (0, 3, 0)),
        ('tests="3" skipped="0" failures="1" errors="1"', (3, 0, 2)),
        ("", (0, 0, 0)),
    ],
)
def test_what_was_skipped_did_not_run(tmp_path, counts, found):
    path = tmp_path / "results.xml"
    path.write_text(f"<testsuites><testsuite {counts}></testsuite></testsuites>")
    assert results(path) == found

# SPDX-License-Identifier: Apache-2.0
"""The record of the tests that have passed on a netlist decides which ones run again."""

import pytest

from tb.common.test_axis_memory import test_axis_memory as axis_memory
from twin import netlist_tests


@pytest.fixture(autouse=True)
def record(tmp_path, monkeypatch):
    """The file of a record and the folder of what has passed, of this test alone."""
    monkeypatch.setattr(netlist_tests, "PASSED", tmp_path / "passed")
    monkeypatch.setattr(netlist_tests, "RECORD", tmp_path / "netlists.toml")
    return netlist_tests.RECORD


@pytest.mark.parametrize(
    "choice, never, changed, same",
    [("", True, True, True), ("new", True, True, False), ("changed", False, True, False)],
)
def test_the_choice_says_what_is_due(record, monkeypatch, choice, never, changed, same):
    record.write_text('[ecp5]\n"a[1]" = "new"\n"b[1]" = "old"\n')
    monkeypatch.setenv(netlist_tests.CHOICE, choice)
    due = [netlist_tests.due("ecp5", test, "new") for test in ("c[1]", "b[1]", "a[1]")]
    assert due == [never, changed, same]
    assert netlist_tests.due("ice40", "a[1]", "new") == never, "each family has its own"


def test_what_has_passed_is_kept_in_the_place_of_what_was_before(record, monkeypatch):
    record.write_text('[ecp5]\n"b[1]" = "old"\n"d" = "other"\n')
    netlist_tests.passed("ecp5", "nothing", "is collected without a choice")
    monkeypatch.setenv(netlist_tests.CHOICE, "new")
    for family, test in (("ecp5", "b[1]"), ("ecp5", "a"), ("ice40", "b[1]")):
        netlist_tests.passed(family, test, "new")
    assert netlist_tests.keep() == 3 and netlist_tests.keep() == 0
    ecp5 = {"a": "new", "b[1]": "new", "d": "other"}
    assert netlist_tests.read() == {"ecp5": ecp5, "ice40": {"b[1]": "new"}}
    assert record.read_text().startswith("# SPDX") and record.read_text().index('"a"') > 0


def test_a_test_on_a_netlist_is_kept_when_it_passes_and_not_run_again(monkeypatch):
    monkeypatch.setenv("NETLIST", "ecp5")
    monkeypatch.setenv(netlist_tests.CHOICE, "new")
    axis_memory(axes=1)
    assert netlist_tests.keep() == 1
    (test,) = netlist_tests.read()["ecp5"]
    assert test.startswith("common/test_axis_memory.py::") and test.endswith(
        " axis_memory-AXES1-WIDTH8"
    )
    with pytest.raises(pytest.skip.Exception, match="not to be tested again"):
        axis_memory(axes=1)

# SPDX-License-Identifier: Apache-2.0
"""The figures of the netlists count what fails, and refuse to count nothing."""

import pytest

from figures import netlist as figures_netlist
from figures.synthesis import SynthesisError
from twin import netlist_tests

PROBE = """
import os
import pytest

def test_right():
    assert os.environ["PROBE"] == "set"

def test_wrong():
    assert os.environ["PROBE"] != "set"

"""
SKIPPED = """
import pytest

def test_left_out():
    pytest.skip("for a reason")
"""


def test_failures_are_counted_and_a_run_without_tests_is_an_error(tmp_path):
    probe, skipped = tmp_path / "test_probe.py", tmp_path / "test_skipped.py"
    probe.write_text(PROBE)
    skipped.write_text(SKIPPED)
    assert figures_netlist.failed([str(tmp_path)], {"PROBE": "set"}) == (2, 1)
    chosen = {netlist_tests.CHOICE: "new"}
    assert figures_netlist.failed([str(skipped)], chosen) == (0, 0), "all may have passed before"
    with pytest.raises(SynthesisError, match="no test of .* ran"):
        figures_netlist.failed([str(skipped)], {})
    with pytest.raises(SynthesisError, match="no test of .* ran"):
        figures_netlist.failed([str(tmp_path)], chosen, [str(probe), str(skipped)])


def test_two_builds_are_compared_with_the_reference(tmp_path, monkeypatch):
    assert figures_netlist.builds_differing() == 0
    reference = tmp_path / "reference"
    reference.write_text(f"{'0' * 64}  uart_tx\n")
    monkeypatch.setattr(figures_netlist, "REFERENCE", reference)
    monkeypatch.setattr(figures_netlist, "built", lambda folder, **_: "0" * 63 + folder.name)
    assert figures_netlist.builds_differing() == 2

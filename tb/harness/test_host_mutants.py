# SPDX-License-Identifier: Apache-2.0
"""The mutation test of the host: a fault that tests see is found, one that they do not see is
reported with its place, and reasons are kept for existing lines only. Without Cosmic Ray
(`make cosmicray`) the tests that make mutants are skipped.
"""

import ast

import pytest

from mutation import host
from mutation.block import MutationError
from tb.bench import seed

MODULE = "moire.bus.cobs"


def texts(*changes):
    """The text of the module with one change each: (old, new)."""
    source = host.path_of(MODULE).read_text()
    for old, new in changes:
        assert old in source
        yield source.replace(old, new, 1)


def types(source):
    """The types that stand in a source."""
    nodes = [node for node in ast.walk(ast.parse(source)) if getattr(node, "annotation", None)]
    return [ast.unparse(node.annotation) for node in nodes]


def verdicts(*changes, longest_s=60):
    """{number of the change: the test that failed}"""
    found = host.runs(MODULE, list(texts(*changes)), seed(), longest_s)
    return {number: failed for number, failed, _ in found}


def test_the_module_itself_passes_and_a_fault_names_the_test_that_sees_it():
    found = verdicts(("", ""), ("self.dropped += 1", "self.dropped += 2"))
    assert found[0] == ""
    assert found[1].startswith("tb/host/test_host_cobs.py::test_")


def test_a_run_without_an_end_and_a_process_that_ends_are_found():
    found = verdicts(
        ("import ", "while True:\n    pass\nimport "),
        ("import ", "import os\nos._exit(3)\nimport "),
        longest_s=1,
    )
    assert list(found.values()) == ["(no end)", "(the process ends by itself)"]


def test_mutants_differ_in_one_line_and_none_in_a_type():
    try:
        mutants = host.mutants_of(MODULE, 40, seed())
    except host.NotInstalled as error:
        pytest.skip(str(error))
    assert len({mutant.text for mutant in mutants}) == 40
    source = host.path_of(MODULE).read_text()
    for mutant in mutants:
        assert source.splitlines()[mutant.line - 1].strip() == mutant.old != mutant.new
        assert types(mutant.text) == types(source)


def test_a_survivor_is_reported_unless_a_reason_explains_it(monkeypatch):
    mutant = host.HostMutant(MODULE, 7, "a = 1", "a = 2", "text")
    monkeypatch.setattr(host, "mutants_of", lambda *_: [mutant])
    monkeypatch.setattr(host, "runs", lambda *_: [(0, "", 1.0)])
    monkeypatch.setattr(host, "reasons", list)
    found = host.measured(MODULE, 1)
    assert found.survivors == [mutant] and "cobs.py:7: a = 1 -> a = 2" in mutant.words
    reason = host.Reason(MODULE, "a = 1", "a = *", "nobody reads it")
    monkeypatch.setattr(host, "reasons", lambda: [reason])
    assert host.measured(MODULE, 1).explained == [(mutant, reason)]


def test_a_reason_whose_mutants_are_found_is_stale_and_tests_must_pass_without_a_mutant(
    monkeypatch,
):
    mutant = host.HostMutant(MODULE, 7, "a = 1", "a = 2", "text")
    monkeypatch.setattr(host, "mutants_of", lambda *_: [mutant])
    monkeypatch.setattr(host, "reasons", lambda: [host.Reason(MODULE, "a = 1", "a = 2", "why")])
    monkeypatch.setattr(
        host, "runs", lambda _, texts, *__: [(0, "a test" if texts == ["text"] else "", 1.0)]
    )
    found = host.measured(MODULE, 1)
    assert found.killed == 1 and found.stale == [f"{MODULE}: a = 1: a = 2"]
    monkeypatch.setattr(host, "runs", lambda *_: [(0, "a test", 1.0)])
    with pytest.raises(MutationError, match="without a mutant a test fails"):
        host.measured(MODULE, 1)


def test_a_reason_for_a_line_that_does_not_exist_is_refused(monkeypatch):
    entry = {"module": MODULE, "line": "no such line", "mutant": "*", "why": "x"}
    monkeypatch.setattr(host, "table", lambda: {"reason": [entry]})
    with pytest.raises(MutationError, match="has no line 'no such line'"):
        host.reasons()


def test_every_module_and_test_of_the_table_exists():
    for module, files in host.tests().items():
        assert host.path_of(module).exists()
        assert all((host.ROOT / file).exists() for file in files)
    assert host.reasons() is not None


def test_without_cosmic_ray_one_line_says_what_to_do(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(host, "COSMIC_RAY", tmp_path)
    assert host.main([MODULE]) == 1
    assert capsys.readouterr().err == "Cosmic Ray is not installed: make cosmicray\n"


def test_an_unknown_module_is_refused(capsys):
    with pytest.raises(SystemExit):
        host.main(["moire.nothing"])
    assert "moire.nothing has no tests in sw/mutation/host.toml" in capsys.readouterr().err

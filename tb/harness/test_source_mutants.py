# SPDX-License-Identifier: Apache-2.0
"""The mutation test of host and firmware: a fault that tests see is found, one that they do not see
is reported with its place, and reasons are kept for existing lines only. Without what makes the
mutants (`make mutators`) the tests that need it are skipped.
"""

import ast
import dataclasses
import difflib

import pytest

from mutation import firmware, host, sources
from mutation.block import MutationError
from mutation.firmware import C
from mutation.host import PYTHON
from mutation.sources import Reason, SourceMutant
from tb.bench import seed
from twin.build import ROOT

MODULE, SOURCE = "moire.bus.cobs", "core/crc32.c"


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
    found = PYTHON.runs(MODULE, list(texts(*changes)), seed(), longest_s)
    return {number: failed for number, failed, _ in found}


def made(language, source, count):
    """So many mutants of a source; the test is skipped where nothing makes them."""
    try:
        return language.mutants_of(source, count, seed())
    except sources.NotInstalled as error:
        pytest.skip(str(error))


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
    mutants = made(PYTHON, MODULE, 40)
    assert len({mutant.text for mutant in mutants}) == 40
    source = host.path_of(MODULE).read_text()
    for mutant in mutants:
        assert source.splitlines()[mutant.line - 1].strip() == mutant.old != mutant.new
        assert types(mutant.text) == types(source)


def test_mutants_of_the_firmware_differ_in_one_place_of_a_function():
    mutants = made(C, "planner/plan.c", 40)
    assert len({mutant.text for mutant in mutants}) == 40
    source = firmware.path_of("planner/plan.c").read_text()
    body = source.index("{")
    for mutant in mutants:
        changes = [
            operation
            for operation in difflib.SequenceMatcher(None, source, mutant.text).get_opcodes()
            if operation[0] != "equal"
        ]
        assert changes and all(begin > body for _, begin, *_ in changes)


def test_tests_of_the_firmware_see_a_fault_of_a_source_and_its_code_is_another():
    path = firmware.path_of(SOURCE)
    text = path.read_text()
    assert "crc >> 4" in text
    faulty = text.replace("crc >> 4", "crc >> 5", 1)
    longest_s = 60
    found = [failed for _, failed, _ in C.runs(SOURCE, [text, faulty], seed(), longest_s)]
    assert found[0] == "" and found[1].startswith("tb/firmware/")
    assert not firmware.same_code(sources.difference(path, faulty))


def test_a_fault_without_a_consequence_makes_the_same_code():
    path = firmware.path_of(SOURCE)
    text = path.read_text().replace("{", "{ if (0) return 1;", 1)
    assert firmware.same_code(sources.difference(path, text))


def canned(monkeypatch, failed="", reasons=(), equivalent=sources.never):
    """A language whose only mutant has this verdict; the source itself passes."""
    mutant = SourceMutant(host.path_of(MODULE), 7, "a = 1", "a = 2", "text")
    language = dataclasses.replace(PYTHON, equivalent=equivalent)
    monkeypatch.setattr(sources.Language, "mutants_of", lambda *_: [mutant])
    monkeypatch.setattr(sources.Language, "reasons", lambda _: list(reasons))
    monkeypatch.setattr(
        sources.Language,
        "runs",
        lambda _, source, texts, *__: [(0, failed if texts == ["text"] else "", 1.0)],
    )
    return language, mutant


def test_a_survivor_is_reported_unless_a_reason_explains_it(monkeypatch):
    language, mutant = canned(monkeypatch)
    assert language.measured(MODULE, 1).survivors == [mutant]
    assert "cobs.py:7: a = 1 -> a = 2" in mutant.words
    reason = Reason(MODULE, "a = 1", "a = *", "nobody reads it")
    language, _ = canned(monkeypatch, reasons=[reason])
    assert language.measured(MODULE, 1).explained == [(mutant, reason)]


def test_an_equivalent_mutant_does_not_count(monkeypatch):
    language, _ = canned(monkeypatch, equivalent=lambda _: True)
    found = language.measured(MODULE, 1)
    assert (found.tried, found.equivalent, found.survivors) == (0, 1, [])
    assert "1 equivalent" in found.words


def test_a_reason_whose_mutants_are_found_is_stale(monkeypatch):
    reason = Reason(MODULE, "a = 1", "a = 2", "why")
    language, _ = canned(monkeypatch, "a test", [reason])
    found = language.measured(MODULE, 1)
    assert found.killed == 1 and found.stale == [f"{MODULE}: a = 1: a = 2"]


def test_tests_must_pass_without_a_mutant(monkeypatch):
    language, _ = canned(monkeypatch)
    monkeypatch.setattr(sources.Language, "runs", lambda *_: [(0, "a test", 1.0)])
    with pytest.raises(MutationError, match="without a mutant a test fails"):
        language.measured(MODULE, 1)


@pytest.mark.parametrize("language, source", [(PYTHON, MODULE), (C, SOURCE)])
def test_a_reason_for_a_line_that_does_not_exist_is_refused(language, source, tmp_path):
    table = tmp_path / "reasons.toml"
    table.write_text(
        f'[[reason]]\nsources = ["{source}"]\nline = "no such line"\nmutant = "*"\nwhy = "x"\n'
    )
    with pytest.raises(MutationError, match="reasons.toml: .* has no line 'no such line'"):
        dataclasses.replace(language, table=table).reasons()


@pytest.mark.parametrize("language", [PYTHON, C], ids=lambda language: language.name)
def test_every_source_and_test_of_the_table_exists(language):
    for source, files in language.tests().items():
        assert language.path_of(source).exists()
        assert all((ROOT / file).exists() for file in files)
    assert language.reasons() is not None


@pytest.mark.parametrize(
    "main, source, package", [(PYTHON.main, MODULE, "cosmic_ray"), (C.main, SOURCE, "clang")]
)
def test_without_the_package_one_line_says_what_to_do(
    main, source, package, monkeypatch, capsys, tmp_path
):
    monkeypatch.setattr(sources, "MUTATORS", tmp_path)
    assert main([source]) == 1
    assert capsys.readouterr().err == f"{package} is not installed: make mutators\n"


@pytest.mark.parametrize("main, table", [(PYTHON.main, "host"), (C.main, "firmware")])
def test_an_unknown_source_is_refused(main, table, capsys):
    with pytest.raises(SystemExit):
        main(["nothing"])
    assert f"nothing has no tests in sw/mutation/{table}.toml" in capsys.readouterr().err

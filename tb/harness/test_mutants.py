# SPDX-License-Identifier: Apache-2.0
"""The mutation test of blocks: names and places of mutants, verdicts of the comparison with the
block, and reasons that are kept for existing lines only.
"""

import dataclasses
import fcntl
import json
import threading
from pathlib import Path

import pytest

from campaigns import record
from mutation import block, blocks, command, equivalence
from mutation.block import Run, mutant_of, mutants_of
from tb.bench import ROOT
from tb.simulator import of_mutants, source_of
from twin.build import rtl_path

LINE = (
    r"mutate -ctrl mutant 4 9 -mode cnot1 -module permission -cell $procdff$24 -port Q -portbit 3 "
    r"-ctrlbit 2 -wire elapsed -wirebit 3 -src rtl/common/tick_divider.sv:24.19-24.26 "
    r"-src rtl/common/tick_divider.sv:29.5-36.8"
)


def test_a_mutant_has_the_place_and_the_name_of_its_fault():
    mutant = mutant_of(LINE)
    assert (mutant.number, mutant.place) == (9, "rtl/common/tick_divider.sv:24")
    assert mutant.name == "procdff.Q bit 3 (elapsed) inverted while bit 2 is 1"
    assert mutant.text.startswith("logic [W-1:0] elapsed;")
    adder = mutant_of(LINE.replace("$procdff$24", "$add$rtl/x.sv:31$7"))
    assert adder.place == "rtl/common/tick_divider.sv:29" and adder.kind == "add"


@pytest.fixture(scope="module")
def divider():
    """The folder of the mutants of a small block."""
    return block.prepared(source_of("tick_divider"), {"W": 8}, rtl_path(), 20, 1)


def test_the_netlist_has_the_parameters_of_the_block_and_a_register_that_selects(divider):
    text = (divider / block.NETLIST).read_text()
    assert "  parameter W = 8;\n" in text and "  reg [4:0] mutant;\n" in text
    assert {mutant.number for mutant in mutants_of(divider)} <= set(range(1, 21))


def test_a_mutant_of_no_consequence_is_equivalent_and_another_one_is_not(divider):
    """Bit 7 of the constant 1 that a reset writes is 0 already. The first mutant inverts a bit of
    the count.
    """
    ports = equivalence.pair(divider, source_of("tick_divider"), {"W": 8}, rtl_path())
    mutants = {mutant.number: mutant for mutant in mutants_of(divider)}
    idle = next(n for n, m in mutants.items() if m.name == "procmux.B bit 7 tied to 0")
    active = next(n for n, m in mutants.items() if m.name == "procdff.Q bit 0 (elapsed) inverted")
    verdicts = equivalence.compared(divider, ports, [idle, active])
    assert verdicts[idle][0] == equivalence.EQUIVALENT
    assert verdicts[active][0] == equivalence.DIFFERENT


def test_what_abc_says_is_understood():
    assert equivalence.judged("Property proved.")[0] == equivalence.EQUIVALENT
    assert equivalence.judged("UNSATISFIABLE")[0] == equivalence.EQUIVALENT
    assert equivalence.judged("SATISFIABLE")[0] == equivalence.DIFFERENT
    said = "Output 0 of miter was asserted in frame 5."
    assert equivalence.judged(said) == (equivalence.DIFFERENT, "seen at the outputs after 5 cycles")
    verdict, words = equivalence.judged("No output asserted in 40 frames.")
    assert verdict == equivalence.UNDECIDED and "40 cycles" in words
    assert equivalence.judged("")[0] == equivalence.UNDECIDED, "no answer is not equivalence"


def runs_of(path, divider, tests):
    """What the tests of one simulation leave, read back."""
    Run(str(divider), {"W": 8}, list(tests)).write(path / "a.json")
    (path / "a.verdicts").write_text("".join(f"{n} {t}\n" for n, t in tests.items()))
    return Run.all(path)


def test_a_planted_survivor_is_reported_with_its_place_and_its_reason_explains_it(
    tmp_path, divider, monkeypatch
):
    number = next(m.number for m in mutants_of(divider) if m.kind == "procdff")
    mutant = next(m for m in mutants_of(divider) if m.number == number)
    runs = runs_of(tmp_path, divider, {number: "", number + 1: "a_test"})
    verdicts = blocks.judge("tick_divider", runs)
    assert [s.mutant for s in verdicts.survivors] == [mutant] and verdicts.killed == 1
    assert verdicts.survivors[0].text.startswith(f"{mutant.place}: tick_divider W=8: {mutant.name}")
    assert verdicts.percent == 50
    reason = blocks.Reason("tick_divider", mutant.text, "procdff.*", "because")
    monkeypatch.setattr(blocks, "reasons", lambda: (reason,))
    verdicts = blocks.judge("tick_divider", runs)
    assert not verdicts.survivors and len(verdicts.explained) == 1 and not verdicts.stale
    runs = runs_of(tmp_path, divider, {number: "a_test"})
    assert blocks.judge("tick_divider", runs).stale, "its mutant is found"


def test_a_mutant_that_was_not_run_is_an_error(tmp_path, divider):
    Run(str(divider), {"W": 8}, [1]).write(tmp_path / "a.json")
    with pytest.raises(block.MutationError, match="1 mutants were not run"):
        blocks.judge("tick_divider", Run.all(tmp_path))


def test_a_mutant_is_found_if_another_build_finds_those_of_other_bits_at_its_place():
    mutant = mutant_of(LINE)
    other = mutant_of(LINE.replace("-portbit 3", "-portbit 1"))
    elsewhere = mutant_of(LINE.replace("24.19", "25.19"))
    assert blocks.found_elsewhere(mutant, [{other: True, elsewhere: False}])
    assert not blocks.found_elsewhere(mutant, [{other: False}, {elsewhere: True}])


def test_a_fault_that_a_build_leaves_is_looked_for_in_the_builds_with_other_parameters(
    tmp_path, divider
):
    mutant = next(m for m in mutants_of(divider) if m.kind == "procdff")
    left = [mutant.fault, {"W": 8}]
    asked = {"block": "tick_divider", "count": 30, "seed": 1, "tests": "", "labels": []}
    (tmp_path / "request").write_text(json.dumps({**asked, "faults": [left]}))
    with pytest.raises(pytest.skip.Exception, match="left by this build"):
        of_mutants(tmp_path / "request", source_of("tick_divider"), {"W": 8}, "x")
    of_mutants(tmp_path / "request", source_of("tick_divider"), {"W": 4}, "narrow")
    folder = Path(json.loads((tmp_path / "narrow.json").read_text())["folder"])
    same = [m for m in mutants_of(folder) if m.fault == mutant.fault]
    assert len(same) > 1 and {(m.source, m.mode) for m in mutants_of(folder)} == {
        (mutant.source, mutant.mode)
    }
    (tmp_path / "runs").mkdir()
    runs = runs_of(tmp_path / "runs", divider, {mutant.number: ""})
    assert blocks.Builds("tick_divider", runs).left() == [(mutant.fault, {"W": 8})]
    for missed in (None, same[-1].number):
        verdicts = "".join(
            f"{m.number} {'' if m.number == missed else 'a_test'}\n" for m in mutants_of(folder)
        )
        (tmp_path / "narrow.verdicts").write_text(verdicts)
        builds = blocks.Builds("tick_divider", runs, Run.all(tmp_path))
        assert builds.seen(str(divider), mutant) == (missed is None)


def test_only_the_mutants_that_are_asked_for_by_their_labels_are_run(tmp_path, divider):
    mutant = next(m for m in mutants_of(divider) if m.kind == "procdff")
    asked = {"block": "tick_divider", "count": 20, "seed": 1, "tests": "", "faults": []}
    label = block.label("tick_divider", "W=8", mutant)
    (tmp_path / "request").write_text(json.dumps({**asked, "labels": [label]}))
    request = tmp_path / "request", source_of("tick_divider")
    _, environment = of_mutants(*request, {"W": 8}, "x")
    assert environment["MUTANT_NUMBERS"] == str(mutant.number)
    with pytest.raises(pytest.skip.Exception, match="none of the mutants"):
        of_mutants(*request, {"W": 4}, "narrow")


def test_every_reason_is_about_a_line_that_exists():
    for reason in blocks.reasons():
        lines = [line.strip() for line in source_of(reason.block).read_text().splitlines()]
        assert reason.line in lines, reason
        assert len(reason.why) > 20


def test_a_block_with_a_test_of_its_own_is_found():
    files = blocks.tests()
    assert files["tick_divider"] == [ROOT / "tb" / "common" / "test_tick_divider.py"]
    assert "recorded_encoder" not in files, "it is a bench"


def test_mutants_wait_while_others_of_the_block_run(tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "BUILD", tmp_path)
    waits, over, begun_after = threading.Event(), threading.Event(), []
    monkeypatch.setattr(blocks, "print", lambda *_, **__: waits.set(), raising=False)
    monkeypatch.setattr(blocks, "pytest", lambda *_: begun_after.append(over.is_set()))
    with open(tmp_path / "tick_divider.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        asked = {"count": 1, "seed": 1, "faults": []}
        run = threading.Thread(
            target=blocks.simulated, args=(tmp_path / "runs", "tick_divider"), kwargs=asked
        )
        run.start()
        assert waits.wait(60), "it did not say that it waits"
        over.set()
    run.join()
    assert begun_after == [True]


def test_the_request_of_another_block_is_refused(tmp_path):
    (tmp_path / "request").write_text(json.dumps({"block": "tick_divider"}))
    with pytest.raises(pytest.skip.Exception, match="mutants of tick_divider only"):
        of_mutants(tmp_path / "request", source_of("time_stamp"), {"W": 4}, "x")


@pytest.fixture
def subjects(tmp_path, monkeypatch):
    """Two blocks and a record of their own, and what was measured since."""
    path, ran = tmp_path / "mutants.toml", []
    monkeypatch.setattr(record, "MUTANTS", path)
    monkeypatch.setitem(record.HEADS, path, "# a record\n")
    for name in ("one", "two"):
        (tmp_path / f"{name}.sv").write_text(name)

    def measured(name, count, seed, survivors):
        ran.append((name, count, seed, *survivors))
        return name

    def entry_of(verdicts, count, seed):
        numbers = dict(mutants=count, asked=count, found=count - 3, equivalent=1, seed=seed)
        return {**numbers, "survivors": [f"{verdicts}.sv:7: a fault"], "explained": []}

    made = command.Subjects(
        lambda: ("one", "two"), "?", lambda n: tmp_path / f"{n}.sv", measured, entry_of
    )
    return made, ran


def test_what_the_record_has_is_not_run_again_until_the_source_changes(subjects, tmp_path):
    made, ran = subjects
    assert [name for name, _ in made.recorded(made.names(), 10)] == ["one", "two"]
    assert ran == [("one", 10, 1), ("two", 10, 1)]
    ran.clear()
    entries = dict(made.recorded(made.names(), 8))
    assert not ran and entries["two"]["found"] == 7, "it has more than these"
    assert command.words_of("two", entries["two"]).splitlines() == [
        "two: 7 of 9 found",
        "  two.sv:7: a fault",
    ]
    dict(made.recorded(made.names(), 20))
    assert ran == [("one", 20, 1), ("two", 20, 1)], "and here fewer"
    ran.clear()
    (tmp_path / "two.sv").write_text("another text")
    dict(made.recorded(made.names(), 20))
    assert ran == [("two", 20, 1)]


def test_an_interrupted_run_of_mutants_goes_on_and_another_seed_is_not_recorded(subjects):
    made, ran = subjects
    next(made.recorded(made.names(), 10))
    dict(made.recorded(made.names(), 10))
    assert ran == [("one", 10, 1), ("two", 10, 1)]
    ran.clear()
    assert dict(made.recorded(["one"], 10, seed=2))["one"]["seed"] == 2
    assert ran == [("one", 10, 2)] and made.known("one", 10)["seed"] == 1


def test_the_survivors_of_the_record_run_again_and_their_verdicts_are_added(subjects, tmp_path):
    made, ran = subjects
    dict(made.recorded(["one"], 10))
    ran.clear()
    results = dict(mutants=1, found=0, equivalent=0, survivors=[], explained=["one.sv:7: why"])
    made = dataclasses.replace(made, entry_of=lambda *_: results)
    entry = made.again("one")
    assert ran == [("one", 10, 1, "one.sv:7: a fault")]
    numbers = entry["mutants"], entry["found"], entry["equivalent"]
    assert numbers == (10, 7, 1) and entry["explained"] == ["one.sv:7: why"]
    assert not entry["survivors"]
    results["mutants"] = 2
    with pytest.raises(block.MutationError, match="2 mutants have the names of 1 survivors"):
        made.again("one")
    (tmp_path / "one.sv").write_text("another text")
    with pytest.raises(block.MutationError, match="no mutants of the source as it is"):
        made.again("one")


def test_the_summary_of_the_record_adds_up_and_names_what_is_missing(tmp_path, monkeypatch):
    path = tmp_path / "mutants.toml"
    monkeypatch.setattr(record, "MUTANTS", path)
    monkeypatch.setitem(record.HEADS, path, "# a record\n")
    numbers = {
        "good": (60, 58, 2, [], []),
        "weak": (50, 36, 10, ["one", "two"], ["three: why", "x"]),
    }
    for name, values in numbers.items():
        entry = dict(zip(("mutants", "found", "equivalent", "survivors", "explained"), values))
        record.add(name, entry, path)
    assert command.summary(["good", "weak", "new"]).splitlines() == [
        "2 of 3 have been run: 94 of 98 mutants found (95.9 %), 2 with a reason, 2 survivors",
        "under 95 %: weak",
        "not run: new",
    ]

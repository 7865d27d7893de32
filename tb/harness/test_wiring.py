# SPDX-License-Identifier: Apache-2.0
"""The mutation test of the wiring: it finds all diagrams and connections, each mutant is the fault
of its name, and reasons are kept for existing faults only.
"""

import fnmatch
import re

import pytest

from campaigns import record
from mutation import wiring, wiring_record
from mutation.connections import RTL, diagrams, of_diagram
from mutation.library import Bench, library
from mutation.mutants import KINDS, Design, pairs, same_faults, unheard

DISPLAY = RTL / "peripheral" / "display_port.sv"


@pytest.fixture(scope="module")
def display():
    """The display port with its mutants, {name after the port: mutant}, and its library."""
    design = Design.of([DISPLAY])
    return {m.name.split(".sv: ")[1]: m for m in design.mutants()}, library(
        "display_port", mutants=design
    )


def test_the_block_diagrams_are_found():
    names = {file.name for file in diagrams()}
    assert {"node.sv", "axis.sv", "feedback_channel.sv", "actuator.sv"} <= names
    assert {"rs485_port.sv", "peripherals.sv", "relay.sv"} <= names
    assert "drive_interlock.sv" not in names, "it has logic of its own"


def without_parameters(text):
    """A diagram without the lists of parameters of its instances and of itself."""
    kept, depth = "", 0
    for part in re.split(r"(#\(|[()])", text):
        if depth or part == "#(":
            depth += {"#(": 1, "(": 1, ")": -1}.get(part, 0)
        else:
            kept += part
    return kept


@pytest.mark.parametrize("file", diagrams(), ids=lambda file: file.stem)
def test_every_named_connection_of_a_diagram_is_found_unless_it_is_left_open(file):
    text = without_parameters(re.sub(r"//.*", "", file.read_text()))
    written = re.findall(r"^\s*\.\w+\b(?!\s*\(\))", text, re.MULTILINE)
    assert len(of_diagram(file)) == len(written)


def test_the_connection_of_the_example_is_mutated_in_each_way():
    found = {m.name: m for m in Design.of([RTL / "node.sv"]).mutants()}
    name = "node.sv: g_axis.u_axis.cpu_stopped"
    assert {f"{name} {kind}" for kind in KINDS} <= set(found)
    line = int(found[f"{name} tied to 0"].place.split(":")[1])
    assert ".cpu_stopped" in (RTL / "node.sv").read_text().splitlines()[line - 1]


def test_only_connections_of_the_same_direction_and_width_are_swapped():
    for one, other in pairs(of_diagram(RTL / "node.sv")):
        assert (one.instance, one.output, one.width) == (other.instance, other.output, other.width)


def test_a_net_with_one_listener_has_the_faults_of_the_listener_only():
    connections = of_diagram(RTL / "axis.sv")
    same = {c.name: other.name for c, other in same_faults(connections).items()}
    assert same["axis.sv: u_inputs.z"] == "axis.sv: u_feedback.z"
    assert "axis.sv: u_inputs.limit_low" not in same, "interlock and registers listen"


def test_an_output_that_the_diagram_calls_unused_has_no_fault():
    found = {c.name for c in unheard(of_diagram(DISPLAY))}
    assert found == {
        "peripheral/display_port.sv: g_built.u_words.overrun",
        "peripheral/display_port.sv: g_built.u_sender.sent",
    }


def level(path, mutant, pin="cs_n", **inputs):
    bench = Bench(path, mutant)
    bench.set(rst=1)
    bench.run(4)
    bench.set(rst=0, **inputs)
    bench.run(60)
    found = bench.get(pin)
    bench.close()
    return found


def test_each_mutant_is_the_fault_of_its_name(display):
    mutants, path = display
    name = next(name for name in mutants if re.search(r"\.cs_n tied to 0", name))
    instance = name.split(".cs_n")[0]
    assert level(path, (0, 0, 0)) == 1, "without a mutant the design is the original"
    assert level(path, mutants[f"{instance}.cs_n tied to 0"].selected) == 0
    assert level(path, mutants[f"{instance}.cs_n tied to 1"].selected) == 1
    assert level(path, mutants[f"{instance}.cs_n inverted"].selected) == 0
    swapped = mutants[f"{instance}.cs_n swapped with sclk"].selected
    assert level(path, swapped) == 0 and level(path, swapped, "sclk") == 1


def test_a_design_without_mutants_refuses_to_select_one():
    with pytest.raises(AssertionError, match="no mutants"):
        Bench(library("display_port"), (1, 0, 0))


def test_a_survivor_with_a_reason_is_explained_and_one_that_is_found_is_stale(monkeypatch):
    mutants = Design.of([DISPLAY]).mutants()[:3]
    monkeypatch.setattr(wiring, "reasons", lambda: {mutants[0].name: "x", mutants[1].name: "y"})
    verdicts = wiring.Verdicts()
    wiring.judge(verdicts, mutants[0], "")
    assert verdicts.failures == 0
    wiring.judge(verdicts, mutants[1], "a_test")
    wiring.judge(verdicts, mutants[2], "")
    assert (len(verdicts.stale), verdicts.survivors, verdicts.failures) == (1, [mutants[2]], 2)


def test_every_reason_is_about_a_fault_that_exists():
    design = Design.of(diagrams())
    alone = [f"{c.name} {kind}" for c in design.same for kind in KINDS]  # without their listeners
    names = [m.name for m in design.mutants()] + alone
    for pattern, reason in wiring.reasons().items():
        assert fnmatch.filter(names, pattern), pattern
        assert len(reason) > 20


def test_a_constant_is_not_tied_to_its_own_value():
    found = {m.name: wiring.constant(m) for m in Design.of([RTL / "node.sv"]).mutants()}
    assert found["node.sv: u_sample_tick.restart tied to 0"]
    assert not found["node.sv: u_sample_tick.restart tied to 1"]


def test_only_connections_that_differ_from_the_base_are_new(monkeypatch):
    old = DISPLAY.read_bytes().replace(b".sdi,", b".sdi(cs_n),")
    assert old != DISPLAY.read_bytes()
    monkeypatch.setattr(wiring, "base", lambda: "a commit")
    monkeypatch.setattr(wiring, "diagrams", lambda: (DISPLAY,))
    monkeypatch.setattr(wiring, "git", lambda word, *_: None if word == "diff" else old)
    assert [c.port for c in wiring.changed()] == ["sdi"]
    monkeypatch.setattr(wiring, "git", lambda *words: b"")  # git sees no difference
    assert not wiring.changed()


def test_faults_of_an_instance_that_the_design_does_not_have_need_a_reason_and_are_not_run():
    verdicts = wiring.run([RTL / "node.sv"], lambda c: "serial_core" in c.instance)
    assert verdicts.explained and not verdicts.killed and not verdicts.failures


def test_small_diagrams_of_a_design_share_a_build(monkeypatch):
    sizes = {"node.sv": 300, "relay.sv": 9, "axis.sv": 100, "motion.sv": 1, "relay_bridge.sv": 50}
    monkeypatch.setattr(wiring, "of_diagram", lambda file: [None] * sizes[file.name])
    groups = wiring.together(RTL / name for name in sizes)
    shared = [["node.sv", "axis.sv"], ["motion.sv"], ["relay.sv", "relay_bridge.sv"]]
    assert [[file.name for file in group] for group in groups] == shared


@pytest.fixture
def runs(tmp_path, monkeypatch):
    """A record of its own, and the mutants that were run since; `blind` are those no test sees."""
    ran, blind = [], set()

    def campaign(design, mutants, top, jobs):
        for mutant in mutants:
            ran.append(mutant.name)
            yield mutant, "" if mutant.name in blind else "a_test"

    path = tmp_path / "wiring.toml"
    monkeypatch.setattr(record, "WIRING", path)
    monkeypatch.setitem(record.HEADS, path, "# a record\n")
    monkeypatch.setattr(wiring, "campaign", campaign)
    monkeypatch.setattr(wiring_record, "diagrams", lambda: (DISPLAY,))
    forget = wiring_record.instances.cache_clear
    forget()
    yield ran, blind
    forget()


def test_an_instance_in_the_record_runs_again_only_if_its_connections_have_changed(
    runs, monkeypatch
):
    ran, _ = runs
    assert len(dict(wiring_record.recorded([DISPLAY]))) == len(wiring_record.instances()) == 2
    assert len(ran) == sum(entry["found"] for entry in wiring_record.known().values()) > 20
    ran.clear()
    assert not dict(wiring_record.recorded([DISPLAY])) and not ran
    changed = dict(wiring_record.instances())
    (_, instance) = place = min(changed)
    changed[place] = "other"
    monkeypatch.setattr(wiring_record, "instances", lambda: changed)
    assert [place for place, _ in wiring_record.recorded([DISPLAY])] == [place]
    assert ran and all(f": {instance}." in name for name in ran)


def test_an_interrupted_run_goes_on_after_the_last_complete_instance(runs):
    ran, _ = runs
    running = wiring_record.recorded([DISPLAY])
    first, _ = next(running)
    running.close()
    ran.clear()
    assert first not in dict(wiring_record.recorded([DISPLAY]))
    assert ran and not wiring_record.due()


def test_a_survivor_in_the_record_runs_again_until_it_has_a_reason(runs, monkeypatch):
    ran, blind = runs
    survivor = next(m for m in Design.of([DISPLAY]).mutants() if not wiring.constant(m))
    blind.add(survivor.name)
    dict(wiring_record.recorded([DISPLAY]))
    assert list(wiring_record.survivors().values()) == [[survivor.name]]
    assert wiring_record.summary().splitlines()[1].split()[-1] == "1"
    faults = len(ran)
    ran.clear()
    dict(wiring_record.recorded([DISPLAY]))
    assert ran == [survivor.name], "what has been found does not run again"
    assert sum(entry["found"] for entry in wiring_record.known().values()) == faults - 1
    monkeypatch.setattr(wiring, "reasons", lambda: {survivor.name: "a reason"})
    assert not wiring_record.due() and not wiring_record.survivors()
    assert wiring_record.summary().splitlines()[1].split()[-2:] == ["1", "0"]


def test_a_survivor_that_a_new_test_finds_counts_as_found(runs, monkeypatch):
    ran, blind = runs
    first, second = [m for m in Design.of([DISPLAY]).mutants() if not wiring.constant(m)][:2]
    blind |= {first.name, second.name}
    dict(wiring_record.recorded([DISPLAY]))
    faults = len(ran)
    blind.remove(first.name)
    monkeypatch.setattr(wiring, "reasons", lambda: {second.name: "a reason"})
    dict(wiring_record.recorded([DISPLAY]))
    entries = wiring_record.known().values()
    assert sum(entry["found"] for entry in entries) == faults - 1
    assert sum(entry["explained"] for entry in entries) == 1 and not wiring_record.due()


def test_an_instance_with_a_stale_reason_does_not_come_into_the_record(runs, monkeypatch):
    found = Design.of([DISPLAY]).mutants()[0]
    monkeypatch.setattr(wiring, "reasons", lambda: {found.name: "a reason"})
    dict(wiring_record.recorded([DISPLAY]))
    assert wiring_record.due() == {wiring.place_of(found.connection)}

# SPDX-License-Identifier: Apache-2.0
"""The functions that evaluate a node at a rising edge: what they leave out, and the whole against
Verilator's own evaluation.
"""

import os
import random
import re
from pathlib import Path

import pytest

from experiments import s2_stage
from tb.twin.test_statements import parsed, text_of
from twin import build, rising_edge, statements
from twin.nodes.twin import ALL_AXES, NODE


def design(logic, *lines):
    names = (frozenset(logic), frozenset("i"))
    return rising_edge.Design({}, {"f"}, {"i"}, {}, *names, parsed(*lines))


def test_logic_goes_first_and_flip_flops_do_not():
    program = design("x", "a = b;", "b = x;", "x = a;")
    assert [text_of(part) for part in rising_edge.logic_first(program)] == [
        ["x = a;"],
        ["a = b;", "b = x;"],
    ]


def test_logic_of_an_output_stays_behind_its_flip_flop():
    program = design("f", "a = b;", "f = a;")
    assert [text_of(part) for part in rising_edge.logic_first(program)] == [
        [],
        ["a = b;", "f = a;"],
    ]


def test_logic_of_a_variable_that_is_computed_behind_stays_behind():
    lines = parsed("a = b;", "b = x;", "v = a;", "f = v;", "x = v;")
    program = rising_edge.Design({}, {"f"}, set(), {"v": BIT}, frozenset("fvx"), frozenset(), lines)
    assert text_of(rising_edge.logic_first(program)[1])[-3:] == ["v = a;", "f = v;", "x = v;"]


def test_logic_of_inputs_that_stays_behind_is_refused():
    with pytest.raises(statements.FormError, match="logic of inputs stays behind: i"):
        rising_edge.function(design("i", "a = i;", "f = a;"))


BIT, WORD = "CData/*0:0*/", "IData/*31:0*/"


def rest(*lines, logic=0, **types):
    """Of a program in which the signal `now` works, and which begins with logic."""
    program = rising_edge.Design(types, set(), set(), {}, frozenset(), frozenset(), parsed(*lines))
    return rising_edge.Rest(program, program.program, logic, re.compile("now"))


def test_what_has_to_do_with_a_signal_that_works_works():
    assert rest("b = now;", "now = a;", "c = a;").works == {0, 1}


def test_a_bit_of_the_working_part_may_be_an_input_of_the_resting_part():
    split = rest("x = now;", "c = x;", logic=1, x=BIT)
    assert split.works == {0} and split.logic_inputs == {"x"} and split.registers == set()


def test_what_needs_logic_of_several_bits_that_works_works():
    assert rest("x = now;", "c = x;", logic=1, x=WORD).works == {0, 1}


def test_what_changes_the_same_signal_is_one_part():
    assert rest("x = now;", "x = a;", "c = b;").works == {0, 1}


def test_what_sees_a_flip_flop_after_its_change_works():
    split = rest("c = b;", "b = now;", "d = b;", b=WORD)
    assert split.works == {1, 2} and split.registers == {"b"}


def test_results_and_registers_of_the_resting_part():
    split = rest("x = a;", "a = b;", "now = x;", "c = a;", logic=1, a=WORD, x=WORD)
    assert split.works == {2} and split.results == {"x"} and split.registers == {"a"}


def edges(*lines, logic, active, parents=None, has_calm=None, **types):
    program = rising_edge.Design(types, set(), set(), {}, frozenset(), frozenset(), parsed(*lines))
    tree = zip(parents or range(len(active)), map(re.compile, active))
    return rising_edge.Edges(program, program.program, logic, list(tree), has_calm)


def test_each_edge_leaves_out_more():
    split = edges("now = a;", "b = c;", "d = e;", logic=0, active=["now|b", "now"])
    assert [text_of(program) for program in split.programs] == [
        ["now = a;", "b = c;", "d = e;"],
        ["now = a;", "b = c;"],
        ["now = a;"],
    ]


def test_two_edges_of_one_parent_leave_out_different_parts():
    lines = ("now = a;", "b = b;", "d = d;", "f = f;")
    active, parents = ["now|b|d", "now|b", "now|d"], [0, 1, 1]
    split = edges(*lines, logic=0, active=active, parents=parents)
    assert [text_of(program) for program in split.programs[1:]] == [
        ["now = a;", "b = b;", "d = d;"],
        ["now = a;", "b = b;"],
        ["now = a;", "d = d;"],
    ]
    assert [split.known(number) for number in (2, 3)] == [
        "rest.known_0 & rest.known_1",
        "rest.known_0 & rest.known_2",
    ]
    assert split.rests_of(1) == [1, 2]


def test_an_edge_refuses_if_an_input_of_what_it_leaves_out_has_changed():
    lines = ("x = now;", "now = a;", "b = x;")
    whole, part = (
        "\n".join(edges(*lines, logic=1, active=["now"], now=WORD, b=WORD, x=BIT).text(number))
        for number in (0, 1)
    )
    assert "rest.input_0_x = x;" in whole and "return false" not in whole
    assert "if ((x != rest.input_0_x)) return false;" in part and "b = x" not in part


def test_a_memory_that_rests_or_is_read_by_what_rests_sets_the_flag():
    lines = ("c = m[b];", "e[b] = e[a];", "m[now] = a;", "now = a;")
    split = edges(*lines, logic=0, active=["now"], now=WORD, b=WORD, c=WORD)
    assert split.rests[0].works == {2, 3} and split.arrays == {"e", "m"}
    whole = list(split.text(0))[-3].splitlines()
    for line in ("e[b] = e[a];", "m[now] = a;"):
        assert whole[whole.index(line) + 1] == "rest.written_0 = true;"


def test_what_only_an_input_woke_may_rest_again_with_the_input_as_before():
    """The copies stay while it is held, and so do the inputs that are logic."""
    lines = ("x = now;", "now = a;", "b = (x ^ b);")
    split = edges(*lines, logic=1, active=["now"], now=WORD, b=WORD, x=BIT)
    observed = list(split.observed(0))
    copies = observed.index("rest.before_0_b = vlSelfRef.b;")
    assert observed[copies - 1 : copies + 2 : 2] == ["if (!rest.held_0) {", "}"]
    assert "rest.known_0 = as_before && (rest.held_0 || !(0));" in observed
    whole = "\n".join(split.text(0))
    assert "if (!rest.held_0) {\nrest.input_0_x = x;\n}" in whole


def test_a_calm_form_refuses_at_events_of_registers_at_once_and_of_logic_behind_it():
    lines = ("arrived = a;", "b = arrived;", "c = tick;")
    types = {name: BIT for name in ("arrived", "tick", "b", "c")}
    split = edges(*lines, logic=1, active=[], has_calm=0, **types)
    assert list(split.functions(0)) == ["calm_0", "edge_0"]
    calm, whole = "\n".join(split.text(0)).split("static bool edge_0")
    refused = [line for line in calm.splitlines() if line.startswith("if (")]
    assert refused == [f"if ({event}) return false;" for event in ("vlSelfRef.tick", "arrived")]
    assert calm.index(refused[0]) < calm.index("arrived = a;") < calm.index(refused[1])
    assert "return false" not in whole


def test_an_edge_without_events_has_no_calm_form():
    assert list(edges("b = a;", logic=0, active=[], has_calm=0, b=BIT).functions(0)) == ["edge_0"]


def test_what_is_left_out_and_used_is_named_where_it_is_kept():
    """x is an input of what the first edge leaves out; the second one leaves out its logic."""
    lines = ("x = b;", "now = x;", "c = x;", "b = a;")
    split = edges(*lines, logic=1, active=["now|b", "now"], now=WORD, b=WORD, c=WORD, x=BIT)
    assert split.results == {"x"} and "rest.input_0_x = vlSelfRef.x;" in "\n".join(split.text(0))


def test_an_assignment_to_a_memory_sets_the_flag():
    text = "m[a] = b;\nc = m[a];\nVL_ASSIGN_W(m[a]);"
    assert rising_edge.flagged(text, {"m"}, "f") == "m[a] = b;\nf\nc = m[a];\nVL_ASSIGN_W(m[a]);\nf"


def test_code_without_the_function_is_refused(tmp_path):
    (tmp_path / f"{rising_edge.ROOT}__0.cpp").write_text("void nothing() {\n}\n")
    (tmp_path / f"{rising_edge.ROOT}.h").write_text("")
    with pytest.raises(statements.FormError, match="there is no function eval_nba"):
        rising_edge.Design.read(tmp_path)


FUNCTION = """void {root}___{name}({root}* vlSelf) {{
{lines}
}}

"""


def test_a_variable_of_two_types_is_refused(tmp_path):
    lines = [
        "CData/*0:0*/ x;",
        "IData/*31:0*/ x;",
        "if ((1ULL & vlSelfRef.__VnbaTriggered[0U])) {",
        "}",
    ]
    text = FUNCTION.format(root=rising_edge.ROOT, name="eval_nba", lines="\n".join(lines))
    (tmp_path / f"{rising_edge.ROOT}__0.cpp").write_text(text)
    (tmp_path / f"{rising_edge.ROOT}.h").write_text("")
    with pytest.raises(statements.FormError, match="x has two types"):
        rising_edge.Design.read(tmp_path)


def test_variables_of_two_functions_may_have_one_name():
    code = "".join(
        FUNCTION.format(root=rising_edge.ROOT, name=name, lines="\n".join(lines))
        for name, lines in {
            "f": ["CData/*0:0*/ x;", "x = a;", f"{rising_edge.ROOT}___g(vlSelf);", "b = x;"],
            "g": ["IData/*31:0*/ x;", "x = c;"],
        }.items()
    )
    assert rising_edge.body(code, "f") == [
        "CData/*0:0*/ x;",
        "x = a;",
        "IData/*31:0*/ x_of_g;",
        "x_of_g = c;",
        "b = x;",
    ]


def signals(folder: Path) -> str:
    """The lists of signals of rising_edge_run.cpp: the inputs, and what an edge leaves behind."""
    header = (folder / f"{rising_edge.ROOT}.h").read_text()
    inputs = re.findall(r"VL_IN\w*\(&?(?!clk\b|rst\b)(\w+),(\d+),0", header)
    memories = set(re.findall(r"^VlUnpacked<.*> (\w+);$", header, re.M))
    design = rising_edge.Design.read(folder)
    logic, flip_flops = rising_edge.logic_first(design)
    whole = statements.effect_of([*logic, *flip_flops])
    needs = {statements.array(name) for name in whole.needs}
    lists = {
        "INPUTS": [f"{name}, {2 ** (int(top) + 1) - 1:#x}" for name, top in inputs],
        "REGISTERS": sorted(needs & set(design.types) | design.outputs),
        "MEMORIES": sorted(needs & memories),
    }
    return "".join(
        f"#define {name}(X) {' '.join(f'X({item})' for item in items)}\n"
        for name, items in lists.items()
    )


WAITS_FROM = 900_000  # cycles for each axis; then the soft core waits most of the time


STREAM = {**s2_stage.NODE, "HAS_BACKLASH": ALL_AXES, "HAS_SET_POINTS": ALL_AXES, "HAS_LINK": 1}


@pytest.mark.parametrize(
    "node, image, axes, clk_hz, cycles",
    [
        (NODE, "axis", 1, 2_400_000, 1_600_000),
        (STREAM, "steps_stream", 2, 12_000_000, 2_600_000),
    ],
)
def test_a_node_does_the_same_as_by_verilator_in_each_cycle(
    tmp_path, node, image, axes, clk_hz, cycles
):
    tool, verilator = build.compiler(), build.package("verilator", "it makes C++ of the RTL")
    build.verilate_node(tmp_path, verilator, clk_hz, axes, node)
    assert "static bool calm_3(" in (tmp_path / "verilated_node.h").read_text()
    (tmp_path / "signals.h").write_text(signals(tmp_path))
    (tmp_path / "firmware").write_text("\n".join(f"{w:x}" for w in build.firmware(image, axes)))
    flags = [*build.compile_flags(), *build.VERILATED]
    include = [f"-I{tmp_path}", f"-I{build.HERE}", f"-I{verilator / 'include'}"]
    driver = Path(__file__).with_name("rising_edge_run.cpp")
    program = tmp_path / "run"
    command = [tool, *flags, *include, driver, build.runtime(tool, verilator), "-o", program]
    build.run(command, f"g++ of {driver.name}")
    seed = os.environ.get("SEED", random.getrandbits(31))
    print(f"SEED={seed}")
    output = build.run([program, tmp_path / "firmware", cycles, seed], "run of both")
    assert output.startswith(f"the same for {cycles} cycles, with ")
    assert int(re.search(r"(\d+) flips", output)[1]) > 50
    # how much it rests is a matter of the seed's requests
    assert int(output.split()[-1]) > (cycles - axes * WAITS_FROM) / 5, "it rested too seldom"

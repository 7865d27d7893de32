# SPDX-License-Identifier: Apache-2.0
"""The checks of tools/: each finds a planted problem, and none in the project."""

import ast

import pytest

from tables import modules
from tools import check_casts, check_columns, check_imports, check_latency, check_ports

MODULE = """// SPDX-License-Identifier: Apache-2.0
// thing -- adds.
//
// latency  2 cycles from valid to done, and 3 cycles to the sum
// model    tb/block/thing.py
`default_nettype none

module thing #(
    parameter int W = 8,  // bits of a number
    parameter int N = 1
) (
    input  wire          clk,
    input  wire          rst,
    input  wire  [W-1:0] level,
    // counts
    input  wire  [W-1:0] sum,
    output logic         done   // strobe: the sum is valid
);
endmodule
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module with bare ports and latencies to be tested, in a project of its own."""
    for part in (modules, check_casts, check_columns, check_latency, check_ports):
        monkeypatch.setattr(part, "ROOT", tmp_path)
    path = tmp_path / "rtl" / "block" / "thing.sv"
    (tmp_path / "tb" / "block").mkdir(parents=True)
    path.parent.mkdir(parents=True)
    path.write_text(MODULE)
    return path


def test_a_line_of_more_than_100_columns_is_found_and_one_of_100_is_not(module):
    module.write_text(f"// {'π' * 97}\n// {'a' * 98}\n")
    assert check_columns.problems() == ["rtl/block/thing.sv:2: 101"]


def test_a_port_and_a_parameter_without_a_comment_are_found(module):
    assert check_ports.problems() == ["rtl/block/thing.sv:10: N", "rtl/block/thing.sv:14: level"]


@pytest.mark.parametrize(
    "names, missing",
    [
        ([], ["rtl/block/thing.sv: no test latency_is_…"]),
        (["latency_is_2_to_done"], ["rtl/block/thing.sv: no test latency_is_3"]),
        (["latency_is_2_to_done", "latency_is_3_to_the_sum"], []),
        (["latency_is_2_to_done_and_3_to_the_sum"], []),
        (["latency_is_23"], ["no test latency_is_2", "no test latency_is_3"]),
    ],
)
def test_a_latency_without_a_test_of_its_name_is_found(module, names, missing):
    test = module.parents[2] / "tb" / "block" / "test_thing.py"
    test.write_text("".join(f"async def {name}(dut):\n    pass\n" for name in names))
    found = check_latency.problems()
    assert len(found) == len(missing) and all(m in f for m, f in zip(missing, found, strict=True))


@pytest.mark.parametrize(
    "expression, found",
    [
        ("(8'(word) + step) >> 1", True),
        ("{step[0], 8'(word) ^ step}", True),
        ("8'(word) + step < step", True),
        ("-(step - 8'(word)) >>> 1", True),
        ("step[8'(word) + 8'd1]", True),
        ("8'(word) + step", False),
        ("flag ? 8'(word) - step : step", False),
        ("{step[0], 8'(word)}", False),
        ("8'(word) < step", False),
        ("(8'(W + 1) + step) >> 1", False),
        ("(20'(word) + step) >> 1", False),
    ],
)
def test_a_size_cast_that_yosys_reads_otherwise_is_found(module, expression, found):
    head = MODULE.split("module")[0]
    ports = "input wire flag, input wire [15:0] word, input wire [7:0] step, output wire [31:0] sum"
    module.write_text(
        f"{head}module thing #(parameter int W = 8) ({ports});\n"
        f"    assign sum = 32'({expression});\nendmodule\n"
    )
    assert check_casts.problems() == (["rtl/block/thing.sv:9"] if found else [])


def test_a_cycle_is_found_with_its_modules():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}
    (found,) = check_imports.cycles(graph)
    assert found.startswith("cycle: ") and {"a", "b", "c"} <= set(found.split())
    assert check_imports.cycles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_an_import_in_the_wrong_direction_is_found():
    graph = {"figures.s0": {"tb.bench", "moire"}, "moire.cli": {"twin"}, "tb.bench": {"tb.x"}}
    assert check_imports.wrong_ways(graph) == [
        "figures.s0 must not import tb.bench",
        "moire.cli must not import twin",
    ]


def test_an_include_of_a_higher_layer_and_a_cycle_of_directories_are_found():
    station = "sw/firmware/station/"
    graph = {
        "sw/firmware/axis/homing": {"sw/firmware/axis/motion", "sw/firmware/core/clock"},
        "sw/firmware/core/clock": {"sw/firmware/axis/motion"},
        "sw/firmware/calibration/run": {station + "job/job"},
        station + "job/job": {station + "panel/panel"},
        station + "panel/panel": {station + "job/states", station + "panel/keys"},
    }
    assert check_imports.wrong_layers(graph) == [
        "sw/firmware/calibration/run must not include station/job/job",
        "sw/firmware/core/clock must not include axis/motion",
        "cycle: station/job <- station/panel <- station/job",
    ]


def test_relative_deferred_and_typed_imports_are_distinguished():
    tree = ast.parse(
        "from . import x\nimport a.b\nif TYPE_CHECKING:\n    import hidden\n"
        "def f():\n    from late import y\n"
    )
    found = check_imports.imports_of(tree, "p.q", is_package=False)
    assert {"p.x", "a.b", "late", "late.y"} <= found and "hidden" not in found


@pytest.mark.parametrize("check", [check_casts, check_imports, check_latency, check_ports])
def test_the_project_has_none(check):
    assert check.problems() == []

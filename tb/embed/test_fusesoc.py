# SPDX-License-Identifier: Apache-2.0
"""The FuseSoC cores: each has all files of its module and no other, and whatever goes wrong in a
run is reported. Figure embed_failed runs them.
"""

import subprocess
import sys

import pytest
import yaml

from embed import design, fusesoc
from embed.design import DesignError
from embed.fusesoc import Core

FAILED = """<testsuites><testsuite><testcase name="a"/><testcase name="b"><failure/></testcase>
<testcase name="c"><skipped/></testcase></testsuite></testsuites>"""


def content(file):
    head, _, text = file.read_text().partition("\n")
    assert head == "CAPI=2:"
    return yaml.safe_load(text)


CORES = {core.module: content(core.file) for core in fusesoc.cores()}


def below(module):
    """The modules that the core of a module brings with it, by its core file and those it needs."""
    core = CORES[module]
    found = {module}
    for package in core.get("generate", {}).values():
        found |= {name.rpartition("/")[2][:-2] for name in package["parameters"]["files"]}
    for name in core["filesets"]["rtl"].get("depend", ()):
        if (one := name.split(":")[2]) != fusesoc.PACKAGES:
            found |= below(one)
    return found


def test_each_core_brings_the_files_that_its_module_needs():
    assert len(CORES) > 100
    for module in CORES:
        assert below(module) == set(design.below(module)), module


def test_each_core_has_the_parameters_of_its_module():
    for module, core in CORES.items():
        parameters = core.get("parameters", {})
        assert set(parameters) == set(design.parameters(module))
        assert all(one["description"] for one in parameters.values()), module
    assert CORES["node"]["parameters"]["FIRMWARE"]["datatype"] == "str"
    assert CORES["node"]["parameters"]["AXES"]["datatype"] == "int"


def test_a_core_is_simulated_by_the_tests_of_its_own_module():
    tests = Core("sync_fifo").tests
    assert tests.module == "tb.serial.test_sync_fifo"
    assert tests.parameters == {"W": 3, "DEPTH": 4}, "those of the first build"
    assert CORES["sync_fifo"]["targets"]["sim"]["parameters"] == ["W=3", "DEPTH=4", "STYLE"]
    assert CORES["sync_fifo"]["targets"]["lint"]["parameters"] == ["W", "DEPTH", "STYLE"]
    assert not Core("axis_registers").tests, "their top is a bench"
    assert not Core("soft_core").tests, "they need a program that is compiled first"
    assert sum("sim" in core["targets"] for core in CORES.values()) > 70


def test_a_core_that_does_not_exist_any_more_is_removed(monkeypatch):
    monkeypatch.setattr(fusesoc, "cores", lambda: [Core("uart_tx")])
    made = fusesoc.made()
    assert made[Core("uart_rx").file] is None and made[Core("uart_tx").file]


@pytest.mark.parametrize(
    "step, script, why",
    [
        ("lint", "exit 1", "lint failed"),
        ("lint", "echo '%Warning-WIDTH: x'", "lint failed"),
        ("sim", "exit 0", "no test ran"),
        ("sim", f"cat > ../sync_fifo/results.xml <<'END'\n{FAILED}\nEND", "1 of 2 tests failed"),
        ("lint", "sleep 100", "lint has not ended after 0.1 s"),
    ],
)
def test_what_goes_wrong_in_a_run_is_reported(tmp_path, monkeypatch, step, script, why):
    monkeypatch.setattr(fusesoc, "BUILD", fusesoc.BUILD / tmp_path.name)
    monkeypatch.setattr(fusesoc, "command", lambda core, step: ["sh", "-c", f"exec 2>&1; {script}"])
    if why.endswith("0.1 s"):
        monkeypatch.setattr(fusesoc, "LONGEST_S", 0.1)
    (wrong,) = fusesoc.wrong([Core("sync_fifo")], steps=(step,))
    assert wrong.startswith("sync_fifo: ") and why in wrong


def test_a_module_that_does_not_exist_is_refused():
    with pytest.raises(DesignError, match="there is no module uart under rtl/"):
        fusesoc.named(["uart_tx", "uart"])


@pytest.mark.parametrize(
    "package, file, why",
    [
        ("no_such_package", "a.v", "no_such_package is not installed: pip install"),
        ("yaml", "a.v", "there is no a.v in the Python package yaml"),
    ],
)
def test_a_package_without_the_sources_is_named(tmp_path, package, file, why):
    request = tmp_path / "request.yml"
    parameters = {"package": package, "files": [file]}
    request.write_text(yaml.safe_dump({"vlnv": "a:b:c:1", "parameters": parameters}))
    generator = fusesoc.RTL / "cpu" / f"{fusesoc.PACKAGES}.py"
    done = subprocess.run(
        [sys.executable, generator, request], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 1 and why in done.stderr

# SPDX-License-Identifier: Apache-2.0
"""The command line of the experiments: what it refuses, and how a run ends."""

import importlib

import pytest

from experiments import command, start_page
from moire.errors import MoireError, OutOfRange
from twin import BuildError

EXPERIMENTS = [name for name in start_page.REPORTS if name != "figures"]
NUMBERS = [  # option of an experiment, its least and its largest number
    ("s0_stage", "--moves", 1, 10_000),
    ("s0_fine", "--moves", 2, 10_000),
    ("s1_ring", "--places", 8, 10_000),
    ("s3_zero", "--searches", 1, 10_000),
    ("s4_job", "--stations", 1, 360),
]


def main_of(experiment, monkeypatch, run):
    """The main function of an experiment, which runs this in place of its machine."""
    module = importlib.import_module(f"experiments.{experiment}")
    monkeypatch.setattr(module, "run", run)
    return module.main


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_seed_and_folder_of_the_report_are_those_of_the_command_line(
    experiment, monkeypatch, tmp_path
):
    asked = []
    main = main_of(experiment, monkeypatch, lambda *words: asked.extend(words) or [command])
    monkeypatch.setattr(command, "exit_code", lambda name, run, **_: (run(), name)[1])
    assert main(["--seed", "7", "--report", str(tmp_path)]) == experiment
    assert 7 in asked and tmp_path in asked


@pytest.mark.parametrize("experiment, option, least, most", NUMBERS)
def test_a_number_out_of_its_range_is_refused_with_the_range(
    experiment, option, least, most, monkeypatch, capsys
):
    asked = []
    main = main_of(experiment, monkeypatch, lambda *words: asked.append(words))
    monkeypatch.setattr(command, "exit_code", lambda name, run, **_: run())
    for wrong in (least - 1, most + 1, -1, "many", "1.5"):
        with pytest.raises(SystemExit):
            main([option, str(wrong)])
        said = capsys.readouterr().err
        assert f"argument {option}: takes {least} to {most}, not {wrong}" in said
    for right in (least, most):
        main([option, str(right)])
        assert right in asked.pop()


def ends_with(error):
    def run():
        raise error

    return run


def test_an_error_is_one_line_and_has_the_exit_code_of_its_kind(capsys):
    for error, code in (
        (OutOfRange("too far"), OutOfRange.exit_code),
        (MoireError("it failed"), MoireError.exit_code),
        (BuildError("g++ is missing"), 1),
        (KeyboardInterrupt(), 130),
    ):
        assert command.exit_code("s0_stage", ends_with(error)) == code
        words = str(error) or "interrupted"
        assert capsys.readouterr().err == f"s0_stage: {words}\n"


def test_a_result_that_failed_has_exit_code_1():
    assert command.exit_code("s4_job", lambda: 3, failed=lambda result: result == 3) == 1
    assert command.exit_code("s4_job", lambda: 3, failed=lambda result: result == 4) == 0
    assert command.exit_code("s0_stage", lambda: 3) == 0

# SPDX-License-Identifier: Apache-2.0
"""The figures of the gates and of the mill's size judge what they are given: machines that do not
home, move or count are found, and the share of the LUT is that of the report.
"""

from types import SimpleNamespace

import pytest

from boards import board, build, machine
from boards.fit import fit
from figures import boards, gates
from figures.synthesis import SynthesisError
from moire.errors import MoireError

DESIGN = fit(board.named("colorlight_i5"), machine.named("s3"))


def motor(zero=0, position_um=500.0, homed=True, faults=()):
    """A motor that ends like this."""
    status = SimpleNamespace(homed=homed, faults=faults, fault_words="drive fault" * bool(faults))
    axis = SimpleNamespace(enable=lambda: None, move=lambda mm: None, status=lambda: status)
    search = lambda: SimpleNamespace(zero_counts=zero)
    return SimpleNamespace(search=search, axis=axis, position_um=position_um)


@pytest.mark.parametrize(
    "ended, why",
    [
        ({}, ""),
        ({"zero": 1, "position_um": 501.0}, "zero at count 1, no fault"),
        ({"homed": False}, "zero at count 0, no fault"),
        ({"faults": ("drive",)}, "zero at count 0, drive fault"),
        ({"position_um": 497.0}, "-3.00 um beside the target"),
    ],
)
def test_a_motor_that_does_not_home_or_move_is_found(ended, why, monkeypatch):
    monkeypatch.setattr(gates, "GateMotor", lambda *_: motor(**ended))
    assert gates.homes_and_moves(DESIGN, 1) == why


def stage(true_nm, position_nm=20_003.0, **status):
    """An axis of S0 that ends like this."""
    shown = SimpleNamespace(
        **{"position_nm": position_nm, "faults": (), "encoder_events": (), **status}
    )
    nothing = lambda **_: None
    axis = SimpleNamespace(enable=nothing, home=nothing, move=nothing, status=lambda: shown)
    return SimpleNamespace(axis=axis, true_nm=true_nm)


@pytest.mark.parametrize(
    "ended, why",
    [
        ({"true_nm": 20_003.0 - 27 * 800}, ""),
        ({"true_nm": 20_003.0 - 27 * 800 + 60}, "60.0 nm wrong in what is shown"),
        ({"position_nm": 19_900.0, "true_nm": 19_900.0}, "-100.0 nm wrong in what is reached"),
        ({"true_nm": 20_003.0, "faults": ("encoder",)}, "encoder"),
        ({"true_nm": 20_003.0, "encoder_events": ("overspeed",)}, "overspeed"),
    ],
)
def test_a_stage_that_does_not_interpolate_is_found(ended, why, monkeypatch):
    monkeypatch.setattr(gates, "GateStage", lambda *_: stage(**ended))
    assert gates.interpolates(DESIGN, 1) == why


def box(shown_um=470, sources=("index",), events=()):
    """A counter box whose mover is at 470 um, and its index at 0."""
    captured = [SimpleNamespace(sources=sources, position_nm=1000)] if sources else []
    axis = SimpleNamespace(
        capture_from=lambda source: None,
        captures=lambda: (captured, False),
        status=lambda: SimpleNamespace(position_nm=1000 * (shown_um + 1), encoder_events=events),
    )
    return SimpleNamespace(axis=axis, push_to=lambda um: None, true_um=470.4)


@pytest.mark.parametrize(
    "ended, why",
    [
        ({}, ""),
        ({"sources": ()}, "the index was not captured"),
        ({"sources": ("tick",)}, "the index was not captured"),
        ({"shown_um": 480}, "9.60 um wrong"),
        ({"events": ("illegal_edge",)}, "illegal_edge"),
    ],
)
def test_a_box_that_does_not_count_is_found(ended, why, monkeypatch):
    monkeypatch.setattr(gates, "Box", lambda *_: box(**ended))
    assert gates.counts_and_captures(DESIGN, 1) == why


def test_a_mover_that_stays_where_it_is_ends_the_push(monkeypatch):
    stuck, clock = gates.Box.__new__(gates.Box), iter(range(9))
    state = SimpleNamespace(position_m=0.0, velocity_m_s=0.0)
    hand = SimpleNamespace(state=state, push=lambda force: None)
    stuck.twin = SimpleNamespace(machines=[hand], time=lambda: next(clock), run=lambda s: None)
    with pytest.raises(MoireError, match="the mover stays 500 um beside 500 um"):
        stuck.push_to(500)


def unread(*_):
    raise SynthesisError("not read")


def test_machines_that_fail_are_counted(monkeypatch):
    good, bad = (lambda *_: ""), (lambda *_: "it does not move")
    whole = gates.MACHINES
    checks = (good, bad, good, unread)
    rows = [(*names, check) for (*names, _), check in zip(whole, checks, strict=True)]
    monkeypatch.setattr(gates, "MACHINES", rows)
    assert gates.gates_home_move() == 2
    monkeypatch.setattr(gates, "MACHINES", whole)
    monkeypatch.setattr(gates, "yosys", lambda *_: None)
    assert gates.gates_home_move(simulates=False) == 0
    monkeypatch.setattr(gates, "yosys", unread)
    assert gates.gates_home_move(simulates=False) == len(whole)


def test_the_share_of_the_mill_is_that_of_the_report_after_packing(monkeypatch):
    used = {"used": 600, "available": 2400}
    for name in ("check_tools", "write", "make_firmware", "synthesise", "used"):
        monkeypatch.setattr(build, name, lambda *_: "")
    monkeypatch.setattr(build, "counted", lambda *_: {"TRELLIS_COMB": used, "LUT4": used})
    assert boards.board_mill_i5_pct() == boards.board_mill_tang_pct() == 25
    estimate = fit(board.named("tang_nano_20k"), machine.named("mill")).estimate.lut
    assert boards.board_mill_tang_pct(packs=False) == 100 * estimate / 20736

# SPDX-License-Identifier: Apache-2.0
"""The figure of the PS/2 pass-through needs sigrok, but no recording; and what sigrok refuses is
said.
"""

import pytest

from figures import ps2
from figures.common import Absent
from tools import sigrok

needs_sigrok = pytest.mark.skipif(not sigrok.installed(), reason="no sigrok-cli: make sigrok")


@needs_sigrok
def test_all_bytes_are_read_without_a_recorded_keyboard(monkeypatch, tmp_path):
    monkeypatch.setattr(ps2, "KEYBOARD", tmp_path / "none.csv")
    assert ps2.wrong_by_sigrok(5, seed=1) == 0


@needs_sigrok
def test_a_byte_that_sigrok_does_not_read_is_counted(monkeypatch):
    read = sigrok.ps2
    monkeypatch.setattr(sigrok, "ps2", lambda *of: (read(*of)[0][:-1], 2))
    assert ps2.wrong_by_sigrok(5, seed=1) == 1 + 2


def test_without_sigrok_the_figure_is_not_measured(monkeypatch):
    monkeypatch.setattr(sigrok, "PROGRAM", "no-such-program")
    with pytest.raises(Absent, match="make sigrok"):
        ps2.wrong_by_sigrok(5, seed=1)


@needs_sigrok
def test_a_decoder_that_there_is_not_is_said():
    with pytest.raises(sigrok.SigrokError, match="sigrok-cli of none failed"):
        sigrok.decoded(b"\1\0", 1, 1000, "none", "none")

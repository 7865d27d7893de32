# SPDX-License-Identifier: Apache-2.0
"""twin.build says what takes long before it begins it."""

import pytest

from twin import build


def test_a_new_library_is_announced_before_it_is_compiled(tmp_path, monkeypatch, capsys):
    def stop(*_):
        raise build.BuildError("stopped here")

    monkeypatch.setattr(build, "BUILD", tmp_path)
    monkeypatch.setattr(build, "ROOT", tmp_path)
    for step in ("own_sources", "rtl_sources"):
        monkeypatch.setattr(build, step, lambda: [])
    monkeypatch.setattr(build, "verilate_node", stop)
    with pytest.raises(build.BuildError, match="stopped here"):
        build.twin_library(clk_hz=4_000_000, axes=2)
    shown = capsys.readouterr().err
    assert shown.startswith("twin: building twin-") and "(clk 4000000 Hz, 2 axes a node)" in shown

# SPDX-License-Identifier: Apache-2.0
"""What is read of a module: its ports, its parameters, the files that it needs."""

import pytest

from embed import design
from embed.design import DesignError


def test_a_module_has_its_ports_and_its_files():
    assert [path.stem for path in design.files("position_counter")] == [
        "quadrature_decoder",
        "synchroniser",
        "position_counter",
    ]
    widths = design.widths("node", {"AXES": 3})
    assert widths["probe"] == 6 and widths["encoder_a"] == 3 and widths["address"] == 4
    assert design.parameters("node")["FIRMWARE"].is_string
    assert "picorv32" in design.below("node") and "serv_rf_top" in design.below("node")


def test_every_port_of_every_module_has_a_width():
    for module in design.modules():
        assert all(width > 0 for width in design.widths(module).values()), module


def test_what_a_module_does_not_have_is_named():
    with pytest.raises(DesignError, match="there is no module encoder"):
        design.files("encoder")
    with pytest.raises(DesignError, match="quadrature_decoder has no parameter WIDTH; it has W"):
        design.widths("quadrature_decoder", {"WIDTH": 8})

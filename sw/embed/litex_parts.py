# SPDX-License-Identifier: Apache-2.0
"""What is known of LiteX without LiteX: where `make litex` puts it, the name of the example."""

from twin.build import ROOT

FOLDER = ROOT / "build" / "litex"
NAME = "motion_soc"  # of the example and of its files


def is_there() -> bool:
    """Whether LiteX is set up."""
    return (FOLDER / "stamp").exists()


def has_ethernet() -> bool:
    """Whether LiteEth is set up with it."""
    return is_there() and (FOLDER / "liteeth").exists()

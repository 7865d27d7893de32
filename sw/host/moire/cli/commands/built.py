# SPDX-License-Identifier: Apache-2.0
"""The command built."""

from moire.cli.commands.axis import table
from moire.cli.parser import moire
from moire.cli.session import Call
from moire.client.built import FEATURES, SIZES, parameter_of


@moire.command(
    "built",
    help="Show what an axis was built with, and the parameters of rtl/node.sv that build it.",
    example="moire --port /dev/ttyUSB0 built",
)
def show_built(call: Call) -> None:
    """One read-back of the register axis.built."""
    built = call.axis.built()
    rows = []
    for name in FEATURES:
        size = f"up to {built.sizes[name]}" if name in SIZES else "built"
        rows.append((parameter_of(name), size if built.has(name) else "not built"))
    call.say_of_axis(dict(built.sizes), table(f"{call.where}:", rows, 15))

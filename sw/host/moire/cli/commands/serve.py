# SPDX-License-Identifier: Apache-2.0
"""The command serve: shares one bus among any number of clients."""

from fractions import Fraction
from typing import Any

from moire.cli import ports
from moire.cli.doors import Doors, serve_doors, with_doors
from moire.cli.options import FOR
from moire.cli.parser import moire
from moire.cli.session import Call


@moire.command(
    "serve",
    help="Share the bus of --port among any number of clients until Ctrl-C.",
    example="moire --port /dev/ttyUSB0 serve",
)
@with_doors
@FOR
def serve(call: Call, duration: Fraction | None, **doors: Any) -> None:
    """An axis in motion belongs to the client that moves it; all others may look and stop it."""
    port = ports.name_of(call.options)
    serve_doors(
        call,
        call.session.open(),
        Doors(**doors),
        f"the bus at {port}",
        {"port": port},
        duration,
        call.session.description,
    )

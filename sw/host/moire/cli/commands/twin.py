# SPDX-License-Identifier: Apache-2.0
"""The command twin: serves a simulated machine over RFC 2217, TCP and a pseudo terminal."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import click

from moire.bus.twin_port import MACHINES, open_twin
from moire.cli.doors import Doors, serve_doors, with_doors
from moire.cli.options import FOR
from moire.cli.parser import Several, moire
from moire.cli.session import Call
from moire.cli.values import ADDRESS, WHOLE, Name
from moire.description import axes_of_twin
from moire.errors import OutOfRange


@moire.command(
    "twin",
    help="Serve a simulated machine to any client until Ctrl-C.",
    example="moire twin --machine s2 --link moire.tty",
)
@click.option(
    "--machine",
    type=Name("machine", MACHINES),
    default="s0",
    metavar=",".join(MACHINES),
    help="; ".join(f"{name}: {words}" for name, words in MACHINES.items()) + ". The default is s0.",
)
@click.option(
    "--nodes",
    cls=Several,
    type=ADDRESS,
    metavar="N",
    help="The addresses of the nodes of the machine s0. The default is 1 2.",
)
@with_doors
@click.option(
    "--seed",
    type=WHOLE,
    default=1,
    metavar="N",
    help="The seed of all that is random in the simulation. The default is 1.",
)
@FOR
def twin(
    call: Call,
    machine: str,
    nodes: tuple[int, ...],
    seed: int,
    duration: Fraction | None,
    **doors: Any,
) -> None:
    """Several clients may connect at the same time."""
    if nodes and machine != "s0":
        raise OutOfRange(f"--nodes is for s0: the nodes of {machine} have their addresses")
    settings: dict[str, Any] = {"nodes": tuple(dict.fromkeys(nodes))} if nodes else {}
    transport: Any = open_twin(call.options.baud, machine, seed, **settings)
    addresses = list(transport.addresses)
    described = call.session.description
    words = f"{'nodes' if len(addresses) > 1 else 'node'} {', '.join(map(str, addresses))}"
    serve_doors(
        call,
        transport,
        Doors(**doors),
        f"simulated {MACHINES[machine]}; {words}",
        {"machine": machine, "nodes": addresses},
        duration,
        described if described.axes else replace(described, axes=axes_of_twin(machine)),
    )

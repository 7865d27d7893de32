# SPDX-License-Identifier: Apache-2.0
"""The command twin: serves a simulated machine over RFC 2217, TCP and a pseudo terminal."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import click

from moire.bus.gateway import Gateway
from moire.bus.twin_port import MACHINES, open_twin
from moire.cli.options import FOR
from moire.cli.parser import Several, moire
from moire.cli.session import Call
from moire.cli.values import ADDRESS, FILE, TEXT, WHOLE, Name
from moire.errors import OutOfRange, PortError

RFC2217_PORT, TCP_PORT = 2217, 2218


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
@click.option(
    "--bind",
    type=TEXT,
    default="127.0.0.1",
    metavar="HOST",
    help="The address at which clients may connect. The default is 127.0.0.1: only this computer.",
)
@click.option(
    "--rfc2217",
    type=WHOLE,
    default=RFC2217_PORT,
    metavar="PORT",
    help="The port of the 9-bit bus by mark and space parity, or COBS packets by 8N1. The default "
    f"is {RFC2217_PORT}; 0 takes any free port.",
)
@click.option(
    "--tcp",
    type=WHOLE,
    default=TCP_PORT,
    metavar="PORT",
    help=f"The port of COBS packets. The default is {TCP_PORT}; 0 takes any free port.",
)
@click.option(
    "--link", type=FILE, metavar="FILE", help="Make a symbolic link to the pseudo terminal."
)
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
    bind: str,
    rfc2217: int,
    tcp: int,
    link: str | None,
    seed: int,
    duration: Fraction | None,
) -> None:
    """Several clients may connect at the same time."""
    if nodes and machine != "s0":
        raise OutOfRange(f"--nodes is for s0: the nodes of {machine} have their addresses")
    settings: dict[str, Any] = {"nodes": tuple(dict.fromkeys(nodes))} if nodes else {}
    transport: Any = open_twin(call.options.baud, machine, seed, **settings)
    gateway, addresses = Gateway(transport), list(transport.addresses)
    try:
        by_rfc2217 = f"rfc2217://{bind}:{gateway.open_rfc2217(bind, rfc2217)}"
        by_tcp = f"socket://{bind}:{gateway.open_tcp(bind, tcp)}"
        terminal = gateway.open_pty()
        with linked(terminal, link):
            words = f"{'nodes' if len(addresses) > 1 else 'node'} {', '.join(map(str, addresses))}"
            rows = (
                f"simulated {MACHINES[machine]}; {words}; Ctrl-C ends it",
                f"  {by_rfc2217:<28} 9-bit bus by mark and space parity; COBS packets by 8N1",
                f"  {by_tcp:<28} COBS packets",
                f"  {link or terminal:<28} COBS packets",
            )
            values = {
                "machine": machine,
                "nodes": addresses,
                "rfc2217": by_rfc2217,
                "tcp": by_tcp,
                "terminal": terminal,
            }
            call.say(values, "\n".join(rows))
            gateway.serve(None if duration is None else float(duration))
    except KeyboardInterrupt:
        pass  # the normal end
    finally:
        gateway.close()


@contextmanager
def linked(terminal: str, link: str | None) -> Iterator[None]:
    """A symbolic link to the terminal, for as long as it is served."""
    if link is None:
        yield
        return
    try:
        if os.path.islink(link):
            os.unlink(link)  # of a twin that was killed
        os.symlink(terminal, link)
    except OSError as error:
        raise PortError(f"the link {link} cannot be made: {error.strerror}") from None
    try:
        yield
    finally:
        os.unlink(link)

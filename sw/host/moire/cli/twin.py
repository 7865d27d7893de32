# SPDX-License-Identifier: Apache-2.0
"""The command `moire twin`: serves a simulated machine to any client, over RFC 2217, TCP and a
pseudo terminal; and the port `twin`.
"""

import os
from contextlib import contextmanager

from moire.bus.gateway import Gateway
from moire.bus.twin_port import MACHINES, open_twin
from moire.errors import OutOfRange, PortError

RFC2217_PORT, TCP_PORT = 2217, 2218


def add_to(command, address_number, waiting_time):
    """command(name, handler, text, example): makes the parser."""
    twin = command(
        "twin",
        do_twin,
        "serve a simulated machine to any client, until Ctrl-C",
        "moire twin --machine s2 --link moire.tty",
    )
    twin.add_argument(
        "--machine",
        choices=MACHINES,
        default="s0",
        help="; ".join(f"{name}: {words}" for name, words in MACHINES.items())
        + "; s0 unless given",
    )
    twin.add_argument(
        "--nodes",
        nargs="+",
        type=address_number,
        metavar="N",
        help="of s0, their addresses; 1 2 unless given",
    )
    twin.add_argument(
        "--bind",
        default="127.0.0.1",
        metavar="HOST",
        help="who may come in: 127.0.0.1, this computer only, unless given",
    )
    twin.add_argument(
        "--rfc2217",
        type=int,
        default=RFC2217_PORT,
        metavar="PORT",
        help=f"9-bit line by mark and space parity, or COBS packets by 8N1; {RFC2217_PORT} unless given, 0: any that is free",
    )
    twin.add_argument(
        "--tcp",
        type=int,
        default=TCP_PORT,
        metavar="PORT",
        help=f"COBS packets; {TCP_PORT} unless given, 0: any that is free",
    )
    twin.add_argument("--link", metavar="FILE", help="a symbolic link to the pseudo terminal")
    twin.add_argument(
        "--seed",
        type=int,
        default=1,
        metavar="N",
        help="of all that is random in it; 1 unless given",
    )
    twin.add_argument(
        "--for", dest="time", type=waiting_time, metavar="TIME", help="end after this, with a unit"
    )


def do_twin(session, command):
    if command.nodes and command.machine != "s0":
        raise OutOfRange(f"--nodes is for s0: the nodes of {command.machine} have their addresses")
    settings = {"nodes": tuple(dict.fromkeys(command.nodes))} if command.nodes else {}
    transport = open_twin(command.baud, command.machine, command.seed, **settings)
    gateway, nodes = Gateway(transport), list(transport.addresses)
    try:
        rfc2217 = f"rfc2217://{command.bind}:{gateway.open_rfc2217(command.bind, command.rfc2217)}"
        tcp = f"socket://{command.bind}:{gateway.open_tcp(command.bind, command.tcp)}"
        terminal = gateway.open_pty()
        with linked(terminal, command.link):
            rows = [
                f"simulated {MACHINES[command.machine]}; {'nodes' if len(nodes) > 1 else 'node'} {', '.join(map(str, nodes))}; "
                "Ctrl-C ends it",
                f"  {rfc2217:<28} 9-bit line by mark and space parity; COBS packets by 8N1",
                f"  {tcp:<28} COBS packets",
                f"  {command.link or terminal:<28} COBS packets",
            ]
            session.say(
                {
                    "command": "twin",
                    "machine": command.machine,
                    "nodes": nodes,
                    "rfc2217": rfc2217,
                    "tcp": tcp,
                    "terminal": terminal,
                },
                "\n".join(rows),
            )
            gateway.serve(None if command.time is None else float(command.time))
    except KeyboardInterrupt:
        pass  # how it is meant to end
    finally:
        gateway.close()


@contextmanager
def linked(terminal: str, link: str | None):
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

# SPDX-License-Identifier: Apache-2.0
"""The command `moire twin`: serves the simulated stage to any client, over RFC 2217, TCP and a pseudo terminal."""
import os
import sys
from contextlib import contextmanager
from pathlib import Path

from .door import Door
from .errors import PortError, TwinNotBuilt

RFC2217_PORT, TCP_PORT = 2217, 2218


def add_to(command, address_number, waiting_time):
    """command(name, handler, text, example): makes the parser."""
    twin = command("twin", do_twin, "serve the simulated stage to any client, until Ctrl-C", "moire twin --nodes 1 2 --link moire.tty")
    twin.add_argument("--nodes", nargs="+", type=address_number, default=[1, 2], metavar="N", help="their addresses; 1 2 unless given")
    twin.add_argument("--bind", default="127.0.0.1", metavar="HOST", help="who may come in: 127.0.0.1, this computer only, unless given")
    twin.add_argument("--rfc2217", type=int, default=RFC2217_PORT, metavar="PORT",
                      help=f"9-bit line by mark and space parity, or COBS packets by 8N1; {RFC2217_PORT} unless given, 0: any that is free")
    twin.add_argument("--tcp", type=int, default=TCP_PORT, metavar="PORT",
                      help=f"COBS packets; {TCP_PORT} unless given, 0: any that is free")
    twin.add_argument("--link", metavar="FILE", help="a symbolic link to the pseudo terminal")
    twin.add_argument("--seed", type=int, default=1, metavar="N", help="of all that is random in it; 1 unless given")
    twin.add_argument("--for", dest="time", type=waiting_time, metavar="TIME", help="end after this, with a unit")


def make_twin(baud: int, **settings):
    """The transport of a simulated S0 stage, from the search path or from the checkout that this file lies in."""
    software = str(Path(__file__).resolve().parents[2])
    if software not in sys.path:
        sys.path.append(software)
    try:
        import twin
    except ImportError as error:
        raise TwinNotBuilt(f"the simulated stage is not here: use the checkout of Moire and its build/venv ({error})") from None
    try:
        return twin.TwinTransport(twin.Twin(baud=baud, **{"node_parameters": twin.WITH_SEGMENTS, **settings}))
    except (twin.BuildError, OSError) as error:
        raise TwinNotBuilt(f"the simulated stage cannot be built: {str(error).strip().splitlines()[-1]}") from None


def do_twin(session, command):
    door = Door(make_twin(command.baud, nodes=tuple(dict.fromkeys(command.nodes)), seed=command.seed))
    try:
        rfc2217 = f"rfc2217://{command.bind}:{door.open_rfc2217(command.bind, command.rfc2217)}"
        tcp = f"socket://{command.bind}:{door.open_tcp(command.bind, command.tcp)}"
        terminal = door.open_pty()
        with linked(terminal, command.link):
            rows = [f"simulated stage, nodes {', '.join(map(str, command.nodes))}; Ctrl-C ends it",
                    f"  {rfc2217:<28} 9-bit line by mark and space parity; COBS packets by 8N1", f"  {tcp:<28} COBS packets",
                    f"  {command.link or terminal:<28} COBS packets"]
            session.say({"command": "twin", "nodes": command.nodes, "rfc2217": rfc2217, "tcp": tcp, "terminal": terminal}, "\n".join(rows))
            door.serve(None if command.time is None else float(command.time))
    except KeyboardInterrupt:
        pass                           # how it is meant to end
    finally:
        door.close()


@contextmanager
def linked(terminal: str, link: str | None):
    if link is None:
        yield
        return
    try:
        if os.path.islink(link):
            os.unlink(link)            # of a twin that was killed
        os.symlink(terminal, link)
    except OSError as error:
        raise PortError(f"the link {link} cannot be made: {error.strerror}") from None
    try:
        yield
    finally:
        os.unlink(link)

# SPDX-License-Identifier: Apache-2.0
"""The doors that `serve` and `twin` open for clients: HTTP with WebSocket, RFC 2217, TCP and a
pseudo terminal.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from moire.bus.transport import Transport
from moire.cli.session import Call
from moire.cli.values import FILE, TEXT, WHOLE
from moire.description import Description
from moire.errors import PortError

if TYPE_CHECKING:
    from moire.bus.gateway import Gateway
    from moire.web.door import WebDoor

RFC2217_PORT, TCP_PORT, HTTP_PORT = 2217, 2218, 2280
OPTIONS = (
    click.option(
        "--bind",
        type=TEXT,
        default="127.0.0.1",
        metavar="HOST",
        help="The address at which clients of HTTP and WebSocket may connect. The default is "
        "127.0.0.1: only this computer. At any other address they need a token.",
    ),
    click.option(
        "--http",
        type=WHOLE,
        default=HTTP_PORT,
        metavar="PORT",
        help="The port of HTTP and WebSocket, with the live page at / and help at /api/help. The "
        f"default is {HTTP_PORT}; 0 takes any free port.",
    ),
    click.option(
        "--token",
        type=FILE,
        metavar="FILE",
        help="The file with the token of HTTP and WebSocket. A new token is made and shown if "
        "there is no file. The default is ~/.config/moire/token with another --bind, and no "
        "token without it.",
    ),
    click.option(
        "--read-token",
        type=FILE,
        metavar="FILE",
        help="The file with a second token, which may only read.",
    ),
    click.option(
        "--certificate", type=FILE, metavar="FILE", help="The certificate for TLS, as PEM."
    ),
    click.option("--key", type=FILE, metavar="FILE", help="The key of the certificate, as PEM."),
    click.option(
        "--bind-packets",
        type=TEXT,
        default="127.0.0.1",
        metavar="HOST",
        help="The address at which clients of --rfc2217 and --tcp may connect. They need no token, "
        "so leave it at 127.0.0.1 unless you trust everybody in the network.",
    ),
    click.option(
        "--rfc2217",
        type=WHOLE,
        default=RFC2217_PORT,
        metavar="PORT",
        help="The port of the 9-bit bus by mark and space parity, or COBS packets by 8N1. The "
        f"default is {RFC2217_PORT}; 0 takes any free port.",
    ),
    click.option(
        "--tcp",
        type=WHOLE,
        default=TCP_PORT,
        metavar="PORT",
        help=f"The port of COBS packets. The default is {TCP_PORT}; 0 takes any free port.",
    ),
    click.option(
        "--link", type=FILE, metavar="FILE", help="Make a symbolic link to the pseudo terminal."
    ),
)


@dataclass(frozen=True)
class Doors:
    """What the options of with_doors say."""

    bind: str
    http: int
    token: str | None
    read_token: str | None
    certificate: str | None
    key: str | None
    bind_packets: str
    rfc2217: int
    tcp: int
    link: str | None


def with_doors(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of a command that opens the doors; its function gets the fields of Doors."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def serve_doors(
    call: Call,
    transport: Transport,
    doors: Doors,
    words: str,
    values: dict[str, Any],
    duration: Fraction | None,
    description: Description,
) -> None:
    """Serves a transport, which it closes in the end, until Ctrl-C or for a duration in seconds.

    `words` say what is served, `values` say it as JSON.
    """
    from moire.bus.gateway import Gateway  # only here: no other command needs it

    gateway, bind, web = Gateway(transport), doors.bind_packets, None
    try:
        web = web_door(gateway, doors, description)
        by_rfc2217 = f"rfc2217://{bind}:{gateway.open_rfc2217(bind, doors.rfc2217)}"
        by_tcp = f"socket://{bind}:{gateway.open_tcp(bind, doors.tcp)}"
        terminal = gateway.open_pty()
        with linked(terminal, doors.link):
            rows = (
                f"{words}; Ctrl-C ends it",
                f"  {web.url:<28} live page, HTTP and WebSocket, for any number of clients",
                f"  {by_tcp:<28} COBS packets, for any number of clients",
                f"  {doors.link or terminal:<28} COBS packets, for one client",
                f"  {by_rfc2217:<28} COBS packets by 8N1; the 9-bit bus itself by mark and space "
                "parity",
                *(f"  new token, kept in {file}: {token}" for file, token in web.made.items()),
            )
            entrances = {
                "http": web.url,
                "rfc2217": by_rfc2217,
                "tcp": by_tcp,
                "terminal": terminal,
            }
            call.say({**values, **entrances}, "\n".join(rows))
            web.open()
            gateway.serve(None if duration is None else float(duration))
    except KeyboardInterrupt:
        pass  # the normal end
    finally:
        try:
            gateway.close()
        finally:
            if web is not None:
                web.close()


def web_door(gateway: "Gateway", doors: Doors, description: Description) -> "WebDoor":
    """The door of HTTP and WebSocket. Its packages are loaded only here: they take a while."""
    try:
        from moire.web.door import Settings, WebDoor
    except ImportError as error:
        raise PortError(f"the package {error.name} is missing: pip install {error.name}") from None

    def path(name: str | None) -> Path | None:
        return None if name is None else Path(name)

    settings = Settings(
        doors.bind,
        doors.http,
        path(doors.token),
        path(doors.read_token),
        path(doors.certificate),
        path(doors.key),
        description,
    )
    return WebDoor(gateway, settings)


@contextmanager
def linked(terminal: str, link: str | None) -> Iterator[None]:
    """A symbolic link to the terminal, for as long as it is served."""
    if link is None:
        yield
        return
    try:
        if os.path.islink(link):
            os.unlink(link)  # of a server that was killed
        os.symlink(terminal, link)
    except OSError as error:
        raise PortError(f"the link {link} cannot be made: {error.strerror}") from None
    try:
        yield
    finally:
        os.unlink(link)

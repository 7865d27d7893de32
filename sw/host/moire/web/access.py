# SPDX-License-Identifier: Apache-2.0
"""Who may ask: tokens, the origin of pages in browsers, and how often.

On the loopback address everybody on this computer may ask, but no page of another site. On any
other address only those may who have the token.
"""

import hmac
import ipaddress
import os
import secrets
import stat
import time
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from urllib.parse import urlsplit

from moire.errors import PortError
from moire.web.refusals import BadRequest

OWN_NAMES = ("localhost", "127.0.0.1", "::1")
TOKEN_BYTES = 24
REQUESTS_PER_S, BURST = 2000.0, 500.0  # of one connection


def is_loopback(host: str) -> bool:
    """Whether only this computer can connect to this address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True)
class Access:
    """Who may ask. Without a token: everybody who can connect."""

    token: str | None = None
    read_token: str | None = None

    def check(self, headers: Mapping[str, str], token: str | None, changes: bool) -> bool:
        """Whether who asks may do more than read. Raises BadRequest unless the request with these
        headers is allowed. `token` is one that came in another way, and `changes` says that the
        request does more than read.
        """
        self.check_origin(headers)
        if self.token is None:
            return True
        scheme, _, given = headers.get("authorization", "").partition(" ")
        given = given.strip() if scheme.lower() == "bearer" else token or ""
        if same(given, self.token):
            return True
        if self.read_token is None or not same(given, self.read_token):
            raise BadRequest(
                "wrong_token" if given else "no_token",
                "the token is wrong" if given else "this server needs a token",
                "send the header 'Authorization: Bearer TOKEN' with the token that the server "
                "keeps in its file",
                HTTPStatus.UNAUTHORIZED,
            )
        if changes:
            raise BadRequest(
                "read_only",
                "this token only reads",
                "use the other token of the server",
                HTTPStatus.FORBIDDEN,
            )
        return False

    def check_origin(self, headers: Mapping[str, str]) -> None:
        """A browser says from which site a page comes: only from this server."""
        host, origin = headers.get("host", ""), headers.get("origin")
        if self.token is None and name_of(f"//{host}") not in OWN_NAMES:
            raise BadRequest(
                "wrong_host",
                f"'{host[:60]}' is no name of this server",
                f"use one of the names {', '.join(OWN_NAMES)}",
                HTTPStatus.FORBIDDEN,
            )
        if origin is not None and (not host or place_of(origin) != host.lower()):
            raise BadRequest(
                "wrong_origin",
                f"the page of the site '{origin[:60]}' may not ask this server",
                "open the page of the server itself",
                HTTPStatus.FORBIDDEN,
            )


def same(given: str, token: str) -> bool:
    """Whether a token is right; the time that this takes does not depend on where it is wrong."""
    return hmac.compare_digest(given.encode(), token.encode())


def name_of(url: str) -> str | None:
    """The host of a URL in lower case, without its port."""
    try:
        return urlsplit(url).hostname
    except ValueError:
        return None


def place_of(url: str) -> str | None:
    """Host and port of a URL, in lower case."""
    try:
        return urlsplit(url).netloc.lower() or None
    except ValueError:
        return None


def kept_token(path: Path) -> tuple[str, bool]:
    """(the token in a file, whether it has just been made). Only the owner may read the file;
    raises PortError.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            opened = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            mode = stat.S_IMODE(path.stat().st_mode)
            if mode & 0o077:
                raise PortError(
                    f"others may read the token in {path}: make another one, or chmod 600 {path}"
                ) from None
            token = path.read_text(encoding="ascii").strip()
            if len(token) < TOKEN_BYTES:
                raise PortError(
                    f"the file {path} holds no token: delete it, and a new one is made"
                ) from None
            return token, False
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with os.fdopen(opened, "w", encoding="ascii") as file:
            file.write(token + "\n")
        return token, True
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise PortError(f"the token in {path} cannot be kept: {reason}") from None


class Meter:
    """How many requests one connection may still make."""

    def __init__(self) -> None:
        self.left, self.since = BURST, time.monotonic()

    def count(self) -> None:
        """One more request; raises BadRequest if there are too many."""
        now = time.monotonic()
        self.left = min(BURST, self.left + REQUESTS_PER_S * (now - self.since)) - 1
        self.since = now
        if self.left < 0:
            self.left = 0.0
            raise too_many(f"more than {REQUESTS_PER_S:g} requests a second")


def too_many(what: str) -> BadRequest:
    """The client asks too often, or too much at once."""
    return BadRequest(
        "too_many_requests",
        f"too many requests: {what}",
        "wait for the answers, or use a stream of the WebSocket",
        HTTPStatus.TOO_MANY_REQUESTS,
    )

# SPDX-License-Identifier: Apache-2.0
"""The live page: files of this package, which are the same for everybody and name no other site.

They need no token, since they hold no secret; what the page then asks for does.
"""

from collections.abc import Mapping
from importlib.resources import files

from starlette.responses import Response

TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-cache",
}


def responses() -> Mapping[str, Response]:
    """The files by their paths on the server; the page itself is "/"."""
    found = {}
    for file in files("moire.web").joinpath("static").iterdir():
        media_type = TYPES.get(file.name[file.name.rfind(".") :])
        if media_type is not None:
            path = "/" if file.name == "index.html" else f"/page/{file.name}"
            found[path] = Response(file.read_bytes(), 200, HEADERS, media_type)
    return found

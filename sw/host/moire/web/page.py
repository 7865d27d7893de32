# SPDX-License-Identifier: Apache-2.0
"""The live page: files of this package, which are the same for everybody and load nothing from any
other site. They need no token, since they hold no secret; what the page then asks for does.

The folder uplot holds uPlot, which draws the plots, where `make page` has fetched it. Without it
the page has no plots, and says so.
"""

from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable

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
    for path, file in sources():
        media_type = TYPES.get(file.name[file.name.rfind(".") :])
        if media_type is not None:
            found[path] = Response(file.read_bytes(), 200, HEADERS, media_type)
    return found


def sources() -> Iterator[tuple[str, Traversable]]:
    """The files of the page, and of uPlot if it is there: (path on the server, file)."""
    for file in files("moire.web").joinpath("static").iterdir():
        yield "/" if file.name == "index.html" else f"/page/{file.name}", file
    if has_plots():
        for file in uplot().iterdir():
            yield f"/page/uplot/{file.name}", file


def has_plots() -> bool:
    """Whether uPlot is there."""
    return uplot().is_dir()


def uplot() -> Traversable:
    """The folder of uPlot."""
    return files("moire.web").joinpath("uplot")

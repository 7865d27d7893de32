# SPDX-License-Identifier: Apache-2.0
"""tools.page: uPlot comes from a registry of npm, whole and as pinned, or not at all."""

import base64
import hashlib
import io
import json
import sys
import tarfile
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from tools import page

PATH = "/uplot/-/uplot-1.0.0.tgz"
CONTENTS = {name: f"the file {name}".encode() for name in page.FILES}


def package_of(contents):
    """A package of npm."""
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w:gz") as archive:
        for name, content in contents.items():
            entry = tarfile.TarInfo(f"package/{name}")
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return made.getvalue()


class Registry:
    """A registry with one package, and a folder with the lock that pins it."""

    def __init__(self, folder, monkeypatch):
        self.package, self.asked = package_of(CONTENTS), []
        self.lock, self.folder = folder / "package-lock.json", folder / "uplot"
        registry = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                registry.asked.append(self.path)
                self.send_response(200 if self.path == PATH else 404)
                self.end_headers()
                self.wfile.write(registry.package)

            def log_message(self, *_):
                pass

        self.server = HTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        monkeypatch.setenv("npm_config_registry", f"http://127.0.0.1:{self.server.server_port}/")
        for name, value in (("ROOT", folder), ("WEB", folder), ("LOCK", self.lock)):
            monkeypatch.setattr(page, name, value)
        self.pin(self.package)

    def pin(self, package, path=PATH):
        digest = base64.b64encode(hashlib.sha512(package).digest()).decode()
        entry = {"resolved": page.REGISTRY + path, "integrity": f"sha512-{digest}"}
        self.lock.write_text(json.dumps({"packages": {"node_modules/uplot": entry}}))

    def fetched(self):
        """The files in the folder, without the mark."""
        return {
            one.name: one.read_bytes() for one in self.folder.iterdir() if one.name != page.MARK
        }

    def close(self):
        self.server.shutdown()
        self.server.server_close()


@pytest.fixture
def registry(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["page"])
    made = Registry(tmp_path, monkeypatch)
    yield made
    made.close()


def test_the_lock_pins_what_the_page_depends_on_and_its_licence():
    entries = json.loads(page.LOCK.read_text())["packages"]
    (package,) = json.loads((page.WEB / "package.json").read_text())["dependencies"].items()
    assert {package[0]: package[1]} == entries[""]["dependencies"] == {"uplot": package[1]}
    entry = entries["node_modules/uplot"]
    assert entry["version"] == package[1] and entry["license"] == "MIT"
    assert entry["resolved"] == f"{page.REGISTRY}/uplot/-/uplot-{package[1]}.tgz"


def test_the_files_are_fetched_once_and_again_when_the_lock_has_changed(registry, capsys):
    assert page.main() == 0 and registry.asked == [PATH]
    assert registry.fetched() == {
        name.rpartition("/")[2]: content for name, content in CONTENTS.items()
    }
    assert capsys.readouterr() == ("page: uPlot is in uplot\n", "")
    assert page.main() == 0 and registry.asked == [PATH]
    assert capsys.readouterr() == ("", "")
    registry.package = package_of({**CONTENTS, "LICENSE": b"another one"})
    registry.pin(registry.package)
    assert page.main() == 0 and registry.fetched()["LICENSE"] == b"another one"
    assert {one.name for one in registry.folder.parent.iterdir()} == {"uplot", registry.lock.name}


def wrong_hash(registry):
    registry.pin(b"another package")
    return "is not what the lock pins"


def missing_file(registry):
    registry.package = package_of({"LICENSE": b""})
    registry.pin(registry.package)
    return "has no file dist/uPlot.esm.js"


def missing_package(registry):
    registry.pin(b"", "/uplot/-/uplot-9.9.9.tgz")
    return "uplot-9.9.9.tgz cannot be fetched: HTTP Error 404"


def no_registry(registry):
    registry.pin(b"another package")
    registry.close()
    return "cannot be fetched: <urlopen error"


@pytest.mark.parametrize("spoil", [wrong_hash, missing_file, missing_package, no_registry])
def test_what_cannot_be_had_is_said_and_leaves_what_is_there(registry, capsys, monkeypatch, spoil):
    assert page.main() == 0
    before = registry.fetched()
    reason = spoil(registry)
    capsys.readouterr()
    assert page.main() == 1 and reason in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", ["page", "--try"])
    assert page.main() == 0
    said = capsys.readouterr().err
    assert reason in said and said.endswith("until `make page` has fetched uPlot.\n")
    assert said.count("\n") == 1 and registry.fetched() == before

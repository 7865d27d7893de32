# SPDX-License-Identifier: Apache-2.0
"""Results of parts in Parquet files, in a folder or an object store (any URL that fsspec knows).

    RESULTS/CAMPAIGN/VERSION/seed-1/part-000017.parquet      one file for each part
    RESULTS/CAMPAIGN/VERSION/seed-1/page.html                the page of the campaign

A file gets its name when it is complete: it is written under another name and then renamed. So a
file is whole or not there, and a part that runs twice leaves one file. All files have the same
columns, one row for each count, so that one query reads all campaigns.
"""

import io
import re
import uuid
from collections.abc import Iterable
from pathlib import Path

import fsspec
import pyarrow
from fsspec.implementations.local import LocalFileSystem
from pyarrow import parquet

from campaigns.campaign import Result, Task
from moire.errors import MoireError

COLUMNS = pyarrow.schema(
    [
        ("campaign", pyarrow.string()),
        ("version", pyarrow.string()),
        ("seed", pyarrow.int64()),
        ("part", pyarrow.int64()),
        ("part_seed", pyarrow.int64()),
        ("host", pyarrow.string()),
        ("began", pyarrow.string()),
        ("seconds", pyarrow.float64()),
        ("name", pyarrow.string()),
        ("value", pyarrow.float64()),  # of a count
        ("words", pyarrow.string()),  # of a finding
    ]
)
PART = re.compile(r"part-(\d+)\.parquet")
PAGE = "page.html"


class NoStore(MoireError):
    """Results cannot be kept at this place."""


def bytes_of(result: Result) -> bytes:
    """The Parquet file of a result."""
    task = result.task
    common = {
        "campaign": task.campaign,
        "version": task.version,
        "seed": task.seed,
        "part": task.part,
        "part_seed": task.part_seed,
        "host": result.host,
        "began": result.began,
        "seconds": result.seconds,
    }
    rows = [
        {
            **common,
            "name": name,
            "value": None if isinstance(value, str) else float(value),
            "words": value if isinstance(value, str) else None,
        }
        for name, value in result.counts.items()
    ]
    file = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(rows, COLUMNS), file)
    return file.getvalue()


def result_of(data: bytes) -> Result | None:
    """The result in a file; None if the file is damaged."""
    try:
        rows = parquet.read_table(io.BytesIO(data), schema=COLUMNS).to_pylist()
    except (pyarrow.ArrowException, OSError):
        return None
    if not rows:
        return None
    first = rows[0]
    counts = {row["name"]: row["value"] if row["words"] is None else row["words"] for row in rows}
    task = Task(first["campaign"], first["version"], first["seed"], first["part"])
    return Result(task, counts, first["host"], first["began"], first["seconds"])


class Store:
    """A folder or object store with results."""

    def __init__(self, url: str) -> None:
        try:
            self.files, self.root = fsspec.core.url_to_fs(url)
        except (ValueError, ImportError) as error:
            raise NoStore(f"results cannot be kept at {url}: {error}") from None
        # Workers have other working directories: a local folder becomes an absolute one.
        self.is_local = isinstance(self.files, LocalFileSystem)
        self.url = str(Path(self.root).resolve()) if self.is_local else url
        self.root = self.url if self.is_local else self.root

    def folder(self, campaign: str, version: str, seed: int) -> str:
        return f"{self.root}/{campaign}/{version}/seed-{seed}"

    def path(self, task: Task) -> str:
        return f"{self.folder(task.campaign, task.version, task.seed)}/part-{task.part:06}.parquet"

    def check(self) -> None:
        """Raises NoStore, with the reason, unless results can be written here."""
        probe = f"{self.root}/.probe-{uuid.uuid4().hex}"
        try:
            self.put(probe, b"moire")
            self.files.rm_file(probe)
        except Exception as error:  # object stores have exceptions of their own
            reason = getattr(error, "strerror", None) or str(error) or repr(error)
            raise NoStore(f"results cannot be written to {self.url}: {reason}") from None

    def put(self, path: str, data: bytes) -> None:
        """A file that is complete as soon as it has its name."""
        folder, _, name = path.rpartition("/")
        self.files.makedirs(folder, exist_ok=True)
        unfinished = f"{folder}/.unfinished-{uuid.uuid4().hex}-{name}"
        self.files.pipe_file(unfinished, data)
        self.files.mv(unfinished, path)

    def write(self, result: Result) -> None:
        self.put(self.path(result.task), bytes_of(result))

    def read(self, task: Task) -> Result | None:
        """The result of a part; None if there is none, or none that is whole."""
        try:
            result = result_of(self.files.cat_file(self.path(task)))
        except FileNotFoundError:
            return None
        return result if result is not None and result.task == task else None

    def parts(self, campaign: str, version: str, seed: int) -> set[int]:
        """Numbers of the parts that have a file."""
        folder = self.folder(campaign, version, seed)
        self.files.invalidate_cache(folder)
        try:
            names = self.files.ls(folder, detail=False)
        except (FileNotFoundError, NotADirectoryError):
            return set()
        found = (PART.fullmatch(name.rpartition("/")[2]) for name in names)
        return {int(match[1]) for match in found if match}

    def results(
        self, campaign: str, version: str, seed: int, parts: Iterable[int]
    ) -> dict[int, Result]:
        """{part: result} of those of these parts that are done."""
        there = self.parts(campaign, version, seed)
        read = {
            part: self.read(Task(campaign, version, seed, part)) for part in parts if part in there
        }
        return {part: result for part, result in read.items() if result is not None}

    def write_page(self, campaign: str, version: str, seed: int, text: str) -> str:
        path = f"{self.folder(campaign, version, seed)}/{PAGE}"
        self.put(path, text.encode())
        return path

# SPDX-License-Identifier: Apache-2.0
"""Make the table of modules in rtl/README.md from the headers of the modules, and check the rules
that every module must keep.
"""

import re
import sys
from pathlib import Path

from tables import made_files
from tables.made_files import ROOT

PAGE = ROOT / "rtl" / "README.md"
BEGIN, END = "<!-- modules -->", "<!-- /modules -->"
COLUMNS = ["directory", "module", "purpose", "latency", "model and test"]
LONGEST_CELL = 160  # characters of a cell without its links; details stay in the headers
# A line of the facts begins with one of these keys; its further lines are indented.
KEYS = set("latency rate accuracy method behaviour limits source model proved proof made".split())
REQUIRED = ("purpose", "latency", "model")


def header(text: str, where: str | Path = "header") -> tuple[str | None, dict[str, str]]:
    """Name, purpose and facts from the comment at the head of a module: `name -- purpose`, then
    lines of `key text`; a fact may continue in indented lines. Formulae are indented after an empty
    line; a free paragraph begins with a capital letter. A ValueError names each line that is none
    of these.
    """
    lines: list[tuple[int, str]] = []
    wrong: list[str] = []
    facts: dict[str, str]
    key: str | None
    for number, line in enumerate(text.splitlines()[1:], 2):
        if not line.startswith("//"):
            break
        lines.append((number, line[2:].removeprefix(" ").rstrip()))
    first = re.match(r"(\w+) -- (.*)", lines[0][1]) if lines else None
    facts, key = {"purpose": first.group(2)} if first else {}, "purpose" if first else None
    for number, line in lines[1:]:
        new = re.match(r"([a-z]\S*)\s+(\S.*)", line)
        if not line:
            key = None
        elif line.startswith("  "):
            if key in facts:
                facts[key] += " " + line.strip()
        elif key == "purpose":
            facts[key] += " " + line
        elif key == "sentence" or (key is None and re.match(r"[A-Z`]", line)):
            key = "sentence"
        elif new and new.group(1) in KEYS:
            key = new.group(1)
            if key in facts:
                wrong.append(f"{where}:{number}: the key `{key}` is there twice")
            facts[key] = new.group(2)
        else:
            wrong.append(
                f"{where}:{number}: `{line.split()[0]}` is no known key of a header; "
                "tables/modules.py has the list"
            )
    if wrong:
        raise ValueError("\n".join(wrong))
    return first.group(1) if first else None, facts


def brief(text: str) -> str:
    """The first sentence of a fact; if it is too long, without the details after a semicolon or a
    colon.
    """
    sentence = re.split(r"(?<=\.) (?=[A-Z`])", text)[0].rstrip(".")
    for border in (";", ":"):
        if len(sentence) > LONGEST_CELL:
            sentence = sentence.split(border + " ")[0]
    return sentence


def check_of(path: Path) -> tuple[Path | None, Path | None]:
    """(model, test) of a module as paths from ROOT, derived from its own path."""
    folder, name = path.parent.relative_to(ROOT / "rtl"), path.stem
    if not folder.name:  # axis, node: block diagrams; whole-system tests are theirs
        return None, Path("tb/system")
    if name.endswith("_registers"):
        return Path("tb/registers/register_block.py"), Path("tb/registers/test_registers.py")
    if name.endswith("_rom"):  # a made table: its generator is the model
        user = name.removesuffix("_rom")
        tests = sorted((ROOT / "tb" / folder).glob(f"test_{user}*.py"))
        own = [path for path in tests if path.stem == f"test_{name}"]
        return Path("tables") / f"{user}.py", next(
            (path.relative_to(ROOT) for path in own + tests), None
        )
    if name.endswith("_microcode"):  # a made table too, of what its user does
        return Path("tables") / f"{name}.py", Path("tb") / folder / f"test_{name}.py"
    return Path("tb") / folder / f"{name}.py", Path("tb") / folder / f"test_{name}.py"


def row(path: Path, wrong: list[str]) -> list[str]:
    """The cells of a module; each broken rule is added to `wrong`."""
    text, here = path.read_text(), path.relative_to(ROOT)
    try:
        name, facts = header(text, here)
    except ValueError as why:
        wrong.append(str(why))
        return []
    model, test = check_of(path)
    named = re.search(r"tb/[\w/]+\.\w+", facts.get("model", ""))
    if facts.get("model", "").startswith("the models of its blocks"):  # wiring in a folder
        model, test = None, Path(named.group(0)) if named else Path("tb/system")
    elif named and model:
        model = Path(named.group(0))
    if not text.startswith("// SPDX-License-Identifier: Apache-2.0\n"):
        wrong.append(f"{here}: the first line must be // SPDX-License-Identifier: Apache-2.0")
    if name != path.stem:
        wrong.append(f"{here}: the header must begin with `// {path.stem} -- purpose`")
    if not re.search(rf"^module {path.stem}\b", text, re.MULTILINE):
        wrong.append(f"{here}: module and file must have the same name")
    if model and not (ROOT / model).exists():
        wrong.append(f"{here}: its model {model} is missing")
    if not test or not (ROOT / test).exists():
        wrong.append(f"{here}: its test {test or ''} is missing")
    if ("`ifdef FORMAL" in text) != ("proved" in facts):
        wrong.append(f"{here}: `proved` in the header and properties in the module go together")
    for key in REQUIRED:
        if key not in facts:
            wrong.append(f"{here}: the header must state its `{key}`")
    purpose, latency = (brief(facts.get(key, "")) for key in ("purpose", "latency"))
    for key, text in (("purpose", purpose), ("latency", latency)):
        if len(text) > LONGEST_CELL:
            wrong.append(
                f"{here}: `{key}` must begin with a sentence of at most {LONGEST_CELL} characters, "
                f"it has {len(text)}"
            )
    folder = path.parent.name if path.parent != ROOT / "rtl" else ""
    place = path.relative_to(ROOT / "rtl").as_posix()
    return [
        folder,
        f"[{path.stem}]({place})",
        purpose,
        latency,
        ", ".join(f"[{p.name}](../{p.as_posix()})" for p in (model, test) if p),
    ]


def made() -> dict[Path, str]:
    wrong: list[str] = []
    rows = [
        row(p, wrong)
        for p in sorted((ROOT / "rtl").rglob("*.sv"), key=lambda p: (p.parent != ROOT / "rtl", p))
    ]
    if wrong:
        raise ValueError("\n".join(wrong))
    cell = lambda text: text.replace("|", "\\|")
    table = ["| " + " | ".join(COLUMNS) + " |", "|" + " --- |" * len(COLUMNS)] + [
        "| " + " | ".join(map(cell, r)) + " |" for r in rows
    ]
    before, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"rtl/README.md must have the marks {BEGIN} and {END}, in this order")
    return {PAGE: f"{before}{BEGIN}\n" + "\n".join(table) + f"\n{END}{after}"}


def main(arguments: list[str] | None = None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())

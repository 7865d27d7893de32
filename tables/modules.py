# SPDX-License-Identifier: Apache-2.0
"""The table of modules in rtl/README.md, made of the modules' own headers; and the rules that every module keeps."""
import re
import sys
from pathlib import Path

from tables import made_files

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "rtl" / "README.md"
BEGIN, END = "<!-- modules -->", "<!-- /modules -->"
COLUMNS = ["room", "module", "purpose", "latency", "rate", "source", "proved", "model", "test"]


def header(text):
    """Name, purpose and facts from the comment at the head of a module; a fact may go on in indented lines."""
    lines = []
    for line in text.splitlines()[1:]:
        if not line.startswith("//"):
            break
        lines.append(line[2:].removeprefix(" ").rstrip())
    first = re.match(r"(\w+) -- (.*)", lines[0]) if lines else None
    facts, key = {"purpose": first.group(2)} if first else {}, "purpose"
    for line in lines[1:]:
        new = re.match(r"([a-z]+)\s{2,}(\S.*)", line)
        if new:
            key, words = new.groups()
            words, both, rate = words.partition(" rate  ") if key == "latency" else (words, "", "")
            facts[key] = words.strip()
            if both:
                facts["rate"], key = rate.strip(), "rate"
        elif line.startswith("  ") and key:
            facts[key] += " " + line.strip()
        elif not line.strip():
            key = None
        elif key == "purpose":
            facts[key] += " " + line.strip()
    return first.group(1) if first else None, facts


def check_of(path):
    """(model, test) of a module as paths from ROOT, made of its place."""
    room, name = path.parent.relative_to(ROOT / "rtl"), path.stem
    if not room.name:                                       # axis, node: block diagrams; whole-system tests are theirs
        return None, Path("tb/system")
    if name.endswith("_registers"):
        return Path("tb/registers/register_block.py"), Path("tb/registers/test_registers.py")
    if name.endswith("_rom"):                               # a made table: its generator is the model
        user = name.removesuffix("_rom")
        return Path("tables") / f"{user}.py", next((p.relative_to(ROOT) for p in (ROOT / "tb" / room).glob(f"test_{user}*.py")), None)
    if name.endswith("_microcode"):                           # a made table too, of what its user does
        user = name.removesuffix("_microcode")
        return Path("tables") / f"{name}.py", next((p.relative_to(ROOT) for p in (ROOT / "tb" / room).glob(f"test_{user}*.py")), None)
    return Path("tb") / room / f"{name}.py", Path("tb") / room / f"test_{name}.py"


def row(path, wrong):
    """The cells of a module; what breaks a rule goes into `wrong`."""
    text, here = path.read_text(), path.relative_to(ROOT)
    name, facts = header(text)
    model, test = check_of(path)
    named = re.search(r"tb/[\w/]+\.\w+", facts.get("model", ""))
    if facts.get("model", "").startswith("the models of its blocks"):        # wiring in a room
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
    room = path.parent.name if path.parent != ROOT / "rtl" else ""
    link = lambda p: f"[{p.name}](../{p.as_posix()})" if p else ""
    place = path.relative_to(ROOT / "rtl").as_posix()
    return [room, f"[{path.stem}]({place})", *(facts.get(c, "") for c in COLUMNS[2:7]), link(model), link(test)]


def made() -> dict:
    wrong = []
    rows = [row(p, wrong) for p in sorted((ROOT / "rtl").rglob("*.sv"), key=lambda p: (p.parent != ROOT / "rtl", p))]
    if wrong:
        raise ValueError("\n".join(wrong))
    cell = lambda text: text.replace("|", "\\|")
    table = ["| " + " | ".join(COLUMNS) + " |", "|" + " --- |" * len(COLUMNS)] + ["| " + " | ".join(map(cell, r)) + " |" for r in rows]
    before, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"rtl/README.md must have the marks {BEGIN} and {END}, in this order")
    return {PAGE: f"{before}{BEGIN}\n" + "\n".join(table) + f"\n{END}{after}"}


def main(arguments=None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""Make the table of modules in rtl/README.md from the headers of the modules, and check the rules
that every module must keep.
"""

import re
import sys
from pathlib import Path

from tables import made_files

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "rtl" / "README.md"
BEGIN, END = "<!-- modules -->", "<!-- /modules -->"
COLUMNS = ["directory", "module", "purpose", "latency", "model and test"]
LONGEST_CELL = 160  # characters of a cell without its links; details stay in the headers
# A line of the facts begins with one of these keys; its further lines are indented.
KEYS = set("latency rate accuracy method behaviour limits source model proved proof made".split())
# Keys of headers that are not rewritten yet; new headers do not use them.
OLD_KEYS = set(
    """
    again align anew angle answer armed body bound bounds brake built bumpless bypass code copies
    crowded decay duty enable entry exact expects faults finest fits flags frozen index joint jump
    law learns limit map modes moved off opposed options overrun override passed place points quiet
    reading refresh request reset rounding safety scale segments set shift sign slower sources
    spikes start strays table terms through timings used windup
    """.split()
)
REQUIRED = ("purpose", "latency", "model")


def header(text, where="header"):
    """Name, purpose and facts from the comment at the head of a module: `name -- purpose`, then
    lines of `key text`; a fact may continue in indented lines. Formulae are indented after an empty
    line; a free paragraph begins with a capital letter. A ValueError names each line that is none
    of these.
    """
    lines, wrong = [], []
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
        elif new and new.group(1) in KEYS | OLD_KEYS:
            key = new.group(1)
            if key in facts:
                wrong.append(f"{where}:{number}: the key `{key}` is there twice")
            facts[key] = new.group(2)
        else:
            wrong.append(
                f"{where}:{number}: `{line.split()[0]}` is no known key of a header; "
                "tables/modules.py has the list"
            )
        if key == "latency":  # the rate may follow on the same line
            latency, both, rate = facts[key].partition(" rate  ")
            if both:
                facts["latency"], facts["rate"], key = latency.rstrip(), rate.strip(), "rate"
    if wrong:
        raise ValueError("\n".join(wrong))
    return first.group(1) if first else None, facts


def brief(text):
    """The first sentence of a fact; if it is too long, without the details after a semicolon or a
    colon.
    """
    sentence = re.split(r"(?<=\.) (?=[A-Z`])", text)[0].rstrip(".")
    for border in (";", ":"):
        if len(sentence) > LONGEST_CELL:
            sentence = sentence.split(border + " ")[0]
    return sentence


def check_of(path):
    """(model, test) of a module as paths from ROOT, derived from its own path."""
    room, name = path.parent.relative_to(ROOT / "rtl"), path.stem
    if not room.name:  # axis, node: block diagrams; whole-system tests are theirs
        return None, Path("tb/system")
    if name.endswith("_registers"):
        return Path("tb/registers/register_block.py"), Path("tb/registers/test_registers.py")
    if name.endswith("_rom"):  # a made table: its generator is the model
        user = name.removesuffix("_rom")
        tests = sorted((ROOT / "tb" / room).glob(f"test_{user}*.py"))
        own = [path for path in tests if path.stem == f"test_{name}"]
        return Path("tables") / f"{user}.py", next(
            (path.relative_to(ROOT) for path in own + tests), None
        )
    if name.endswith("_microcode"):  # a made table too, of what its user does
        user = name.removesuffix("_microcode")
        return Path("tables") / f"{name}.py", next(
            (p.relative_to(ROOT) for p in (ROOT / "tb" / room).glob(f"test_{user}*.py")), None
        )
    return Path("tb") / room / f"{name}.py", Path("tb") / room / f"test_{name}.py"


def row(path, wrong):
    """The cells of a module; each broken rule is added to `wrong`."""
    text, here = path.read_text(), path.relative_to(ROOT)
    try:
        name, facts = header(text, here)
    except ValueError as why:
        wrong.append(str(why))
        return []
    model, test = check_of(path)
    named = re.search(r"tb/[\w/]+\.\w+", facts.get("model", ""))
    if facts.get("model", "").startswith("the models of its blocks"):  # wiring in a room
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
    room = path.parent.name if path.parent != ROOT / "rtl" else ""
    link = lambda p: f"[{p.name}](../{p.as_posix()})" if p else ""
    place = path.relative_to(ROOT / "rtl").as_posix()
    return [
        room,
        f"[{path.stem}]({place})",
        purpose,
        latency,
        ", ".join(filter(None, (link(model), link(test)))),
    ]


def bare_ports(path):
    """The parameters and ports, except clk and rst, whose lines state no unit and no meaning."""
    text = path.read_text()
    head = text[text.index(f"\nmodule {path.stem}") : text.index("\n);")]
    declared = re.findall(
        r"^ *(?:parameter|input|output|inout)\b([^/\n=]*)([^/\n]*)(//.*)?$", head, re.MULTILINE
    )
    names = [(re.findall(r"\w+", before)[-1], comment) for before, _, comment in declared]
    return [name for name, comment in names if not comment and name not in ("clk", "rst")]


def untested_latencies(path):
    """The numbers of cycles in the latency of a header that no test named latency_is_… states."""
    latency = header(path.read_text(), path)[1]["latency"]
    test = check_of(path)[1]
    names = re.findall(r"def (?:test_)?latency_is_(\w+)", (ROOT / test).read_text())
    stated = re.findall(r"((?:\d+(?:, | or | and | to ))*\d+) cycles?\b", latency)
    numbers = {number for figure in stated for number in re.findall(r"\d+", figure)}
    known = {part for name in names for part in name.split("_")}
    return sorted(numbers - known) if names else [latency]


def made() -> dict:
    wrong = []
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


def main(arguments=None) -> int:
    return made_files.main(__doc__, made, arguments)


if __name__ == "__main__":
    sys.exit(main())

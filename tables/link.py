# SPDX-License-Identifier: Apache-2.0
"""Makes from link.toml, the layout of the packets of the real-time link: the constants of the RTL,
the tables of the host, the header of the figures' driver, and the tables of docs/link.md.
"""

import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tables import made_files
from tables.made_files import ROOT

SOURCE = ROOT / "tables" / "link.toml"
RECEIVER = ROOT / "rtl" / "link" / "packet_receiver.sv"
PLAYER = ROOT / "rtl" / "link" / "packet_player.sv"
DATAGRAM = ROOT / "rtl" / "link" / "link_datagram.sv"
SPI = ROOT / "rtl" / "link" / "link_spi.sv"
HOST = ROOT / "sw" / "host" / "moire" / "made" / "link_tables.py"
HEADER = ROOT / "sw" / "figures" / "link_packet.h"
PAGE = ROOT / "docs" / "link.md"
BEGIN = "    // made by tables/link.py, not to be edited"
END = "    // end of the made constants"
PARTS = ("request", "request_end", "reply", "reply_end")
CRC_WORDS = 1

Table = dict[str, Any]


def read(text: str) -> Table:
    """link.toml, checked."""
    table = tomllib.loads(text)
    for name in ("identity", "sequence"):
        places = {list(table[part]).index(name) for part in ("request", "reply")}
        if len(places) > 1:
            raise ValueError(f"link.toml: {name} must have one place in request and reply")
    if len({code for code, _ in table["kind"].values()}) != len(table["kind"]):
        raise ValueError("link.toml: the kinds must differ")
    if len(table["cause"]) != 6:
        raise ValueError("link.toml: the RTL has the checks of 6 causes")
    if table["longest"] != 128:
        raise ValueError("link.toml: the memories of the RTL have 128 words for a packet")
    return table


def constants(table: Table) -> dict[str, int]:
    """{name: number} of what the RTL, the host and the figures know of a packet."""
    found = {f"KIND_{name.upper()}": code for name, (code, _) in table["kind"].items()}
    for part in PARTS:
        found |= {f"{part}_{word}".upper(): n for n, word in enumerate(table[part])}
        found[f"{part.upper()}_WORDS"] = len(table[part])
    found["FRAME_WORDS"] = len(table["request"]) + len(table["request_end"]) + CRC_WORDS
    found["REPLY_FRAME_WORDS"] = len(table["reply"]) + len(table["reply_end"]) + CRC_WORDS
    found["LONGEST_WORDS"] = table["longest"]
    frame = max(found["FRAME_WORDS"], found["REPLY_FRAME_WORDS"])
    found["MOST_VALUES"] = table["longest"] - frame
    found["UDP_PORT"] = table["udp_port"]
    found["SPI_TURNROUND_NS"] = table["spi_turnround_ns"]
    found["SPI_TURNROUND_BYTE_NS"] = table["spi_turnround_byte_ns"]
    return found


def module(path: Path, found: dict[str, int]) -> str:
    """The text of a module with the constants that it uses."""
    text = path.read_text()
    body = text.partition(END)[2]
    lines = []
    for name, number in found.items():
        if re.search(rf"\b{name}\b", body):
            kind = "logic [7:0]" if name.startswith("KIND") else "int"
            value = f"8'h{number:02X}" if name.startswith("KIND") else str(number)
            lines.append(f"    localparam {kind} {name} = {value};")
    return made_files.filled(path, BEGIN, END, lines)


def host(table: Table, found: dict[str, int]) -> str:
    lines = [
        "# SPDX-License-Identifier: Apache-2.0",
        '"""Made by tables/link.py from tables/link.toml: do not edit."""',
        "",
        *(f"{name} = {number}" for name, number in found.items()),
        "",
        "# why a packet is refused, in the order of its count: (name, words)",
        "CAUSES = (",
        *(
            f"    ({name!r}, {words!r}),".replace("'", '"')
            for name, words in table["cause"].items()
        ),
        ")",
    ]
    return "\n".join(lines) + "\n"


def header(found: dict[str, int]) -> str:
    lines = [
        "// SPDX-License-Identifier: Apache-2.0",
        "// link_packet.h -- made by tables/link.py from tables/link.toml: do not edit.",
        "#pragma once",
        "#include <cstdint>",
        "",
        "namespace link_packet {",
        *(f"constexpr uint32_t {name} = {number};" for name, number in found.items()),
        "}  // namespace link_packet",
    ]
    return "\n".join(lines) + "\n"


def page(table: Table, found: dict[str, int]) -> str:
    def rows(head: str, values: str, tail: str) -> list[str]:
        words = [(word, text) for word, text in table[head].items()]
        words += [("values", values)]
        words += [(word, text) for word, text in table[tail].items()]
        words += [("crc", "CRC-32 of all bytes before it")]
        return ["| word | content |", "| --- | --- |", *(f"| `{w}` | {t} |" for w, t in words)]

    lines = [
        "",
        "A request from the host, in words of 32 bits, low byte first; "
        f"the low byte of its first word is {found['KIND_REQUEST']:#04x}:",
        "",
        *rows("request", "one word for each entry of the write list", "request_end"),
        "",
        f"The reply of the node; the low byte of its first word is {found['KIND_REPLY']:#04x}:",
        "",
        *rows("reply", "one word for each entry of the read list", "reply_end"),
        "",
        f"A packet has at most {found['LONGEST_WORDS']} words, so each list has at most "
        f"{found['MOST_VALUES']} entries.",
        "",
        "A request is refused for the first of these causes that applies:",
        "",
        "| cause | meaning |",
        "| --- | --- |",
        *(f"| `{name}` | {words} |" for name, words in table["cause"].items()),
        "",
    ]
    return made_files.filled(
        PAGE, "<!-- made by tables/link.py: packets -->", "<!-- end of packets -->", lines
    )


def made() -> dict[Path, str]:
    """{file: its text}."""
    table = read(SOURCE.read_text(encoding="utf-8"))
    found = constants(table)
    return {
        RECEIVER: module(RECEIVER, found),
        PLAYER: module(PLAYER, found),
        DATAGRAM: module(DATAGRAM, found),
        SPI: module(SPI, found),
        HOST: host(table, found),
        HEADER: header(found),
        PAGE: page(table, found),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    return made_files.main(__doc__ or "", made, arguments)


if __name__ == "__main__":
    sys.exit(main())

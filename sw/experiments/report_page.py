# SPDX-License-Identifier: Apache-2.0
"""A page in the style of moire.report for experiments whose rows are no moves: tables and pictures,
one file.
"""

import base64
import html
from pathlib import Path

from moire.analysis import report

ROOT = Path(__file__).resolve().parents[2]


def picture(name, caption, image):
    words, source = (
        html.escape(caption),
        "data:image/png;base64," + base64.b64encode(image).decode(),
    )
    return f'<figure id="{name}"><img alt="{words}" src="{source}"><figcaption>{words}</figcaption></figure>'


def page(path, title, summary, parts, facts):
    """Writes it; parts are HTML, facts {name: words}. Returns the path."""
    text = "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{html.escape(title)}</title>",
            f"<style>\n{report.STYLE}</style></head>",
            f"<body><main><h1>{html.escape(title)}</h1>",
            f'<p class="summary">{html.escape(summary)}</p>',
            *parts,
            "<h2>How it was measured</h2>",
            report.table(("", ""), facts.items(), text_columns=2),
            "</main></body></html>",
            "",
        ]
    )
    return report.write_text(Path(path), text)

# SPDX-License-Identifier: Apache-2.0
"""Pages of the experiments and of the figures, one file each, from the templates beside this file.

They have the style of moire.analysis.report, which makes the pages whose rows are moves.
"""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from moire.analysis import report

TEMPLATES = Environment(
    loader=FileSystemLoader(Path(__file__).with_name("templates")),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


def render(template: str, **values: Any) -> Markup:
    """A template of this project, filled in; it escapes all values but those that are Markup."""
    return Markup(TEMPLATES.get_template(template).render(style=Markup(report.STYLE), **values))


def picture(name: str, caption: str, image: bytes) -> Markup:
    encoded = base64.b64encode(image).decode()
    return render("picture.html", name=name, caption=caption, image=encoded)


def text_of(
    title: str,
    summary: str,
    parts: Sequence[str],
    facts: Mapping[str, object],
    numbers: Sequence[tuple[str, str]] = (),
    claim: str = "",
    left_out: str = "",
) -> str:
    """A report. parts are HTML, facts {name: words}; numbers are (value, name), shown large.

    `claim` is the result in one sentence, which the start page shows together with `left_out`, what
    the model of the machine leaves out.
    """
    whole = [Markup(part) for part in parts]
    values = {"title": title, "summary": summary, "numbers": numbers, "parts": whole}
    head = Markup(report.meta(claim, left_out))
    return str(render("report.html", **values, facts=facts.items(), head=head))

# SPDX-License-Identifier: Apache-2.0
"""experiments.start_page: it links every report that is there, repeats its claim and what its model
leaves out, and names the command of the others.
"""

import ast
import re
from importlib.util import find_spec

import pytest

from experiments import s2_stage, s3_zero, s4_job, start_page
from experiments.report_page import text_of
from figures import browser as chromium
from moire.analysis import report
from moire.errors import BadFile
from twin.build import ROOT

RING = text_of("S1", "A ring.", [], {}, claim='12 < 13" <b>', left_out="drift & dust")


WIDEST = {  # what stands in the widest columns of a table
    "move": "to point A, half a 16-bit counter above the origin",
    "directions": "up, down, up, down",
    "target / deg": "350.00000",
    "true angle at the cut / deg": "350.00000",
}


def section(text, name):
    return re.search(f'<section id="{name}">(.*?)</section>', text, re.S).group(1)


def test_a_report_is_linked_with_its_claim_and_what_its_model_leaves_out(tmp_path):
    path = start_page.publish("s1_ring", RING, tmp_path / "new")
    assert path == tmp_path / "new" / "s1_ring.html" and path.read_text() == RING
    ring = section((tmp_path / "new" / "index.html").read_text(), "s1_ring")
    assert '<a href="s1_ring.html">S1: circular grating' in ring
    assert "12 &lt; 13&#34; &lt;b&gt;" in ring
    assert "The model leaves out: drift &amp; dust." in ring
    assert re.search(r"Written \d{4}-\d\d-\d\d \d\d:\d\d; again: <code>build/venv", ring)


def test_a_report_that_is_not_there_has_its_command_and_no_link(tmp_path):
    text = start_page.write(tmp_path).read_text()
    assert "href" not in text
    for name, (title, command) in start_page.REPORTS.items():
        shown = section(text, name)
        assert title in shown and f"No report yet: <code>{command}</code>" in shown


def test_every_report_of_an_experiment_is_named_after_its_module():
    for name in start_page.REPORTS:
        assert name == "figures" or find_spec(f"experiments.{name}"), name


def test_a_page_that_says_nothing_of_itself_is_linked_all_the_same(tmp_path):
    (tmp_path / "s2_stage.html").write_text("<html><head></head></html>")
    shown = section(start_page.write(tmp_path).read_text(), "s2_stage")
    assert 'href="s2_stage.html"' in shown and "leaves out" not in shown


def strings(path):
    """The texts of a module without its docstrings."""
    tree = ast.parse(path.read_text())
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if id(node) not in docstrings:
                yield node.value


@pytest.mark.parametrize("folder", ["sw/experiments", "sw/host/moire/analysis"])
def test_reports_and_pictures_write_micrometres_and_plus_minus_in_one_way(folder):
    """A length that is typed, such as 4um, has no space before its unit."""
    wrong = [
        (path.name, text)
        for path in sorted((ROOT / folder).glob("*.py"))
        for text in strings(path)
        if re.search(r" um\b|\+-(?!\w*\])", text)
    ]
    assert not wrong


@pytest.mark.parametrize("experiment", [s2_stage, s3_zero, s4_job])
def test_the_widest_tables_fit_a_window_of_1200_pixels(experiment, tmp_path):
    if reason := chromium.missing():
        pytest.skip(reason)
    filled = [WIDEST.get(name, "-000000") for name in experiment.HEAD]
    text = text_of("A report", "", [report.table(experiment.HEAD, [filled], text_columns=2)], {})
    path = start_page.publish("s2_stage", text, tmp_path)
    with chromium.opened() as browser:
        page = browser.new_page(viewport={"width": 1200, "height": 800})
        page.goto(path.as_uri())
        table = page.locator("section").first
        widths = [
            table.evaluate(f"element => element.{name}Width") for name in ("scroll", "client")
        ]
    assert widths[0] <= widths[1]


def test_a_folder_that_cannot_be_made_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="cannot be written"):
        start_page.publish("s1_ring", RING, tmp_path / "file")


def test_the_module_writes_the_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(start_page.write, "__defaults__", (tmp_path,))
    assert start_page.main() == 0
    assert capsys.readouterr().out == f"{tmp_path / 'index.html'}\n"

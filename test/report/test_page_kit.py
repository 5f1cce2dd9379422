"""The kit of all pages."""

import re
from pathlib import Path

import pytest
from browser import NEEDED, browser

from vessel_hsmc_ros.core.exceptions import ReportError
from vessel_hsmc_ros.report.page_kit import Section, render_sections, writing
from vessel_hsmc_ros.studies import comparison

ROOT = Path(__file__).resolve().parents[2]


def test_every_page_comes_from_one_environment() -> None:
    making = [
        path.name for path in (ROOT / "vessel_hsmc_ros").rglob("*.py") if "Environment(" in path.read_text(encoding="utf-8")
    ]
    assert making == ["page_kit.py"]
    templates = [path for path in ROOT.glob("vessel_hsmc_ros/**/assets/*.html") if path.name not in ("base.html", "macros.html")]
    assert len(templates) == 3
    assert all(path.read_text(encoding="utf-8").startswith('{% extends "report/base.html" %}') for path in templates)


def test_a_page_of_sections_has_a_theme_an_origin_and_escaped_texts() -> None:
    table = Section("Runs <1>", "A text.", ["law", "error [m]", "remark"], [["guided", "0.1", "fast"]], prose=True)
    page = render_sections("Laws <script>", ["2 runs"], [table], ["It <b>fails</b>."])
    assert 'id="theme"' in page
    assert "prefers-color-scheme: dark" in page
    assert re.search(r"vessel_hsmc_ros \S+ · (commit \w+|no git checkout)", page)
    assert "Runs &lt;1&gt;" in page
    assert "It &lt;b&gt;fails&lt;/b&gt;." in page
    assert '<td>guided</td><td class="number">0.1</td><td>fast</td>' in page
    assert "http" not in page.replace("http-equiv", "")


def test_what_cannot_be_written_is_named_in_one_line(tmp_path: Path) -> None:
    named = pytest.raises(ReportError, match=r"^report of .*there cannot be written: No such file or directory$")
    with named, writing(f"report of {tmp_path / 'there'}"):
        (tmp_path / "there" / "page.html").write_text("")


def test_a_comparison_that_cannot_be_written_is_an_error_of_its_folder(tmp_path: Path) -> None:
    (tmp_path / "figures").write_text("a file")
    with pytest.raises(ReportError, match=rf"^results in {re.escape(str(tmp_path))} cannot be written: File exists$"):
        comparison.write(tmp_path, [])


@NEEDED
def test_long_names_do_not_widen_a_page(tmp_path: Path) -> None:
    name = "runs/" + "20260101T000000_survey_of_the_harbour" * 4
    table = Section(name, name, ["name", "error"], [[name, "1 m"]])
    page = tmp_path / "page.html"
    page.write_text(render_sections(name, [name], [table], [name]), encoding="utf-8")
    with browser() as tab:
        tab.open(page, 400)
        assert tab.run("return document.documentElement.scrollWidth") <= 400

"""The kit of all pages."""

import re
from pathlib import Path

from vessel_hsmc_ros.report.page_kit import Section, render_sections

ROOT = Path(__file__).resolve().parents[2]


def test_every_page_comes_from_one_environment() -> None:
    making = [
        path.name for path in (ROOT / "vessel_hsmc_ros").rglob("*.py") if "Environment(" in path.read_text(encoding="utf-8")
    ]
    assert making == ["page_kit.py"]
    templates = [path for path in ROOT.glob("vessel_hsmc_ros/**/assets/*.html") if path.name not in ("base.html", "macros.html")]
    assert len(templates) == 4
    assert all(path.read_text(encoding="utf-8").startswith('{% extends "report/base.html" %}') for path in templates)


def test_a_page_of_sections_has_a_theme_an_origin_and_escaped_texts() -> None:
    table = Section("Runs <1>", "A text.", b"\x89PNG", ["law", "error [m]", "remark"], [["guided", "0.1", "fast"]], prose=True)
    page = render_sections("Laws <script>", ["2 runs"], [table], ["It <b>fails</b>."])
    assert 'id="theme"' in page
    assert "prefers-color-scheme: dark" in page
    assert re.search(r"vessel_hsmc_ros \S+ · (commit \w+|no git checkout)", page)
    assert "Runs &lt;1&gt;" in page
    assert "It &lt;b&gt;fails&lt;/b&gt;." in page
    assert '<td>guided</td><td class="number">0.1</td><td>fast</td>' in page
    assert "data:image/png;base64,iVBORw==" in page
    assert "http" not in page.replace("http-equiv", "")

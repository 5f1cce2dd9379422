"""README.md is short, its table and the page of results are the generated ones, and the Python example runs."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
INDEX = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")

spec = importlib.util.spec_from_file_location("benchmark_page", ROOT / "benchmarks" / "page.py")
assert spec is not None
assert spec.loader is not None
page = importlib.util.module_from_spec(spec)
sys.modules[spec.name] = page
spec.loader.exec_module(page)

ROWS, RESULTS = page.declared_rows(), page.stored_results()


def test_the_readme_has_at_most_850_words_in_lines_of_at_most_120_characters() -> None:
    assert len(README.split()) <= 850
    assert [line for line in README.splitlines() if len(line) > 120] == []


def test_the_table_of_the_readme_is_the_generated_one() -> None:
    assert page.with_readme_table(README, ROWS, RESULTS) == README
    assert 1 <= sum(bool(row.readme) for row in ROWS) <= 6
    assert page.readme_table(ROWS, RESULTS) in README


def test_the_page_of_results_is_the_generated_one() -> None:
    assert (ROOT / "docs" / "results.md").read_text(encoding="utf-8") == page.results_page(ROWS, RESULTS)


def test_figures_of_older_code_are_not_shown() -> None:
    rows = [row for row in ROWS if row.name in ("circle", "straight", "suite_sea")]
    results = {row.name: {**RESULTS[row.name], "older": row.name != "straight"} for row in rows}
    text = page.results_page(rows, results)
    for row in rows:
        assert row.what in text
        assert (page.shown(row, results[row.name]) in text) == (row.name == "straight")
    assert len(page.readme_table(rows, results).splitlines()) == 2


def test_every_result_has_a_row_and_every_row_its_code() -> None:
    assert RESULTS.keys() == {row.name for row in ROWS}
    assert [path for row in ROWS for path in row.code if not (ROOT / path).exists()] == []


def test_a_result_is_older_than_its_code_once_that_has_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def git(*arguments: str) -> None:
        identity = ("-c", "user.name=a", "-c", "user.email=a@b.invalid")
        subprocess.run(["git", *identity, *arguments], cwd=tmp_path, check=True, capture_output=True)

    monkeypatch.setattr(page, "ROOT", tmp_path)
    git("init")
    for name in ("law.py", "other.py"):
        (tmp_path / name).write_text("1\n", encoding="utf-8")
        git("add", name)
        git("commit", "-m", name)
    commit = page.commit_of(["law.py"])
    assert commit != page.commit_of(["other.py"])
    (tmp_path / "other.py").write_text("2\n", encoding="utf-8")
    assert not page.is_older({"commit": commit}, ["law.py"])
    (tmp_path / "law.py").write_text("2\n", encoding="utf-8")
    assert page.is_older({"commit": commit}, ["law.py"])
    assert page.commit_of(["law.py"]) == f"{commit}+"
    assert page.is_older({"commit": None}, ["other.py"])
    assert page.is_older({"commit": "0123abcd"}, ["other.py"])


def test_figures_are_found_in_an_output_and_lengths_have_a_unit() -> None:
    row = page.Row(
        "name", "what", "command", [], figures=r"guided (?P<guided>\S+), (?P<share>\d+ of \d+)", shown="{guided}, {share}"
    )
    assert page.figures_in(row, "guided 0.00123, 3 of 4 hit") == {"guided": "1.23 mm", "share": "3 of 4"}
    assert page.figures_in(row, "error: no such law") == {}


def test_the_python_example_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", INDEX, re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code, "index.md", "exec"), names)  # noqa: S102 - our own
    assert names["run"].state.shape == (40001, 6)
    assert names["wrench"].shape == (2,)

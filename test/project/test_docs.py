"""Links, files, commands, code and tests that the documentation names exist."""

import importlib
import re
from pathlib import Path

import pytest
from catkin_pkg.changelog import get_changelog_from_path
from catkin_pkg.package import parse_package

import vessel_hsmc_ros
from vessel_hsmc_ros.cli.options import parse_changes
from vessel_hsmc_ros.scenario.scenario import load_scenario

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for folder in ("", "docs/", "docs/api/", "docs/decisions/") for path in ROOT.glob(f"{folder}*.md"))
GENERATED_PAGES = ("boats", "claims", "parameters", "results")
PAPER = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
FOLDERS = ("benchmarks", "config", "docs", "launch", "msg_defs", "test", "tools", "vessel_hsmc_ros", "vessel_sim_node")
PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")

pages = pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))


def anchor(heading: str) -> str:
    """Return the anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    return {anchor(heading) for heading in re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)}


@pages
def test_links_have_a_target(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, place = target.partition("#")
        linked = (page.parent / path) if path else page
        assert linked.exists(), target
        assert not place or place in anchors(linked), target


@pages
def test_named_files_exist(page: Path) -> None:
    for name in re.findall(rf"`((?:{'|'.join(FOLDERS)})/[\w./*-]*)`", page.read_text(encoding="utf-8")):
        assert any(ROOT.glob(name.rstrip("/"))), name


@pytest.mark.long
@pages
def test_commands_with_a_scenario_are_valid(page: Path) -> None:
    """Load the scenario of every `vessel-hsmc run` and `simulate`, with its changes."""
    text = page.read_text(encoding="utf-8")
    for scenario, rest in re.findall(r"vessel-hsmc (?:run|simulate) +([a-z][\w/.]*)([^`\n#|]*)", text):
        file = ROOT / scenario
        changes = parse_changes(tuple(re.findall(r"--set (\S+=\S+)", rest)))
        assert load_scenario(file if file.is_file() else scenario, changes).name == file.stem


def exists(dotted: str) -> bool:
    """Whether a.b.c names a module of the packages, or an attribute in one."""
    parts = dotted.split(".")
    for package in PACKAGES:
        for length in range(len(parts) - 1, 0, -1):
            try:
                found: object = importlib.import_module(".".join([package, *parts[:length]]))
            except ModuleNotFoundError:
                continue
            for part in parts[length:]:
                found = getattr(found, part, None)
            if found is not None:
                return True
    return False


def test_the_documentation_has_at_most_40_000_words_that_are_not_generated() -> None:
    words = 0
    for page in (ROOT / "docs").rglob("*.md"):
        if page.stem not in GENERATED_PAGES:
            text = re.sub(r"<!-- (?!end)[^>]* -->\n.*?<!-- end.*? -->", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
            words += len(text.split())
    assert words <= 40_000


def test_code_cited_by_the_page_of_the_paper_exists() -> None:
    named = re.findall(r"`([a-z_]+(?:\.\w+)+)`", PAPER)
    assert len(named) > 40
    for name in named:
        assert exists(name), name


def test_tests_cited_by_the_page_of_the_paper_exist() -> None:
    named = re.findall(r"`(test_\w+)::(test_\w+)`", PAPER)
    assert len(named) > 60
    for file, test in named:
        (path,) = (ROOT / "test").rglob(f"{file}.py")
        assert f"def {test}(" in path.read_text(encoding="utf-8"), f"{file}::{test}"


def test_the_page_of_the_paper_covers_every_equation() -> None:
    rows = re.findall(r"^\| (\([^|]*) \|([^|]*)\|([^|]*)\|([^|]*)\|$", PAPER, re.MULTILINE)
    numbers = [int(number) for row in rows for number in re.findall(r"\((\d+)\)", row[0])]
    assert numbers == list(range(1, 47))
    assert all(cell.strip() for row in rows for cell in row)


def test_the_api_reference_covers_every_public_name() -> None:
    page = (ROOT / "docs" / "api" / "index.md").read_text(encoding="utf-8")
    assert [name for name in vessel_hsmc_ros.__all__ if f"vessel_hsmc_ros.{name}" not in page and f"`{name}`" not in page] == []


@pytest.mark.parametrize("folder", [ROOT, ROOT / "msg_defs"], ids=["package", "messages"])
def test_a_release_finds_the_changelog_of_its_package(folder: Path, tmp_path: Path) -> None:
    text = (folder / "CHANGELOG.rst").read_text(encoding="utf-8")
    released = text.replace(f"Forthcoming\n{'-' * 11}\n", f"0.1.0 (2026-01-01)\n{'-' * 18}\n")
    (tmp_path / "CHANGELOG.rst").write_text(released, encoding="utf-8")
    changelog = get_changelog_from_path(str(tmp_path / "CHANGELOG.rst"))
    assert f"Changelog for package {parse_package(str(folder)).name}\n" in text
    ((version, _, content),) = changelog.foreach_version()
    assert version == "0.1.0"
    assert content

"""The pages in docs/ name nothing that is not there."""

import importlib
import re
from pathlib import Path

import pytest

from vessel_hsmc_ros.cli.options import parse_changes
from vessel_hsmc_ros.scenario.scenario import load_scenario

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for path in ROOT.rglob("*.md") if path.parent in (ROOT, ROOT / "docs", ROOT / "docs" / "decisions"))
PAPER = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
FOLDERS = ("benchmarks", "config", "docs", "launch", "msg_defs", "test", "vessel_hsmc_ros", "vessel_sim_node")
PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")

pages = pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))


def anchor(heading):
    """The name that a heading gets in the page."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page):
    return {anchor(heading) for heading in re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)}


@pages
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, place = target.partition("#")
        linked = (page.parent / path) if path else page
        assert linked.exists(), target
        assert not place or place in anchors(linked), target


@pages
def test_files_that_are_named_exist(page):
    for name in re.findall(rf"`((?:{'|'.join(FOLDERS)})/[\w./*-]*)`", page.read_text(encoding="utf-8")):
        assert any(ROOT.glob(name.rstrip("/"))), name


@pages
def test_commands_that_are_shown_are_possible(page):
    """Every `vessel-hsmc run` or `simulate` of a scenario of ours, with its changes."""
    text = page.read_text(encoding="utf-8")
    for scenario, rest in re.findall(r"vessel-hsmc (?:run|simulate) +([a-z]\w*)([^`\n#|]*)", text):
        load_scenario(scenario, parse_changes(tuple(re.findall(r"--set (\S+=\S+)", rest))))


def exists(dotted):
    """Whether a.b.c is a module of the package and what it holds."""
    parts = dotted.split(".")
    for package in PACKAGES:
        for length in range(len(parts) - 1, 0, -1):
            try:
                found = importlib.import_module(".".join([package, *parts[:length]]))
            except ModuleNotFoundError:
                continue
            for part in parts[length:]:
                found = getattr(found, part, None)
            if found is not None:
                return True
    return False


def test_the_page_of_the_paper_names_code_that_exists():
    named = re.findall(r"`([a-z_]+(?:\.\w+)+)`", PAPER)
    assert len(named) > 40
    for name in named:
        assert exists(name), name


def test_the_page_of_the_paper_names_tests_that_exist():
    named = re.findall(r"`(test_\w+)::(test_\w+)`", PAPER)
    assert len(named) > 60
    for file, test in named:
        (path,) = (ROOT / "test").rglob(f"{file}.py")
        assert f"def {test}(" in path.read_text(encoding="utf-8"), f"{file}::{test}"


def test_no_equation_is_left_out():
    rows = re.findall(r"^\| (\([^|]*) \|([^|]*)\|([^|]*)\|([^|]*)\|$", PAPER, re.MULTILINE)
    numbers = [int(number) for row in rows for number in re.findall(r"\((\d+)\)", row[0])]
    assert numbers == list(range(1, 47))
    assert all(cell.strip() for row in rows for cell in row)

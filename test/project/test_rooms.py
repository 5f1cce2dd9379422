"""`make check` refuses a module that has no place among the layers, and no modules import each other in a circle."""

import shutil
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest
from durations import rest_long

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("vessel_hsmc_ros", "vessel_sim_node")


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    code = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    command = [sys.executable, "-c", code, "--no-cache"]
    environment = {"PYTHONPATH": str(folder), "PATH": ""}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120.0)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "stray",
    rest_long(
        [
            "vessel_hsmc_ros/stray.py",
            "vessel_hsmc_ros/stray/__init__.py",
            "vessel_hsmc_ros/control/stray.py",
            "vessel_hsmc_ros/studies/stray.py",
            "vessel_sim_node/stray.py",
        ]
    ),
)
def test_a_new_module_outside_the_rooms_breaks_a_contract(copy: Path, stray: str) -> None:
    (copy / stray).parent.mkdir(exist_ok=True)
    (copy / stray).write_text('"""A module that no contract names."""\n')
    done = lint_imports(copy)
    assert done.returncode == 1
    assert "stray" in done.stdout


def circle(*packages: str) -> list[str]:
    """Modules that import each other, also in functions and for annotations alone; empty if none do."""
    graph = grimp.build_graph(*packages, cache_dir=None)
    try:
        TopologicalSorter({each: graph.find_modules_directly_imported_by(each) for each in graph.modules}).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    assert circle(*PACKAGES) == []


@pytest.mark.parametrize("place", ["if TYPE_CHECKING:", "def later() -> None:"])
def test_a_circle_is_found_wherever_its_imports_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    package = f"circular{len(place)}"
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").touch()
    (tmp_path / package / "one.py").write_text(f"from {package} import two\n")
    (tmp_path / package / "two.py").write_text(f"from typing import TYPE_CHECKING\n\n{place}\n    from {package} import one\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert set(circle(package)) == {f"{package}.one", f"{package}.two"}


def test_files_of_tests_have_names_of_their_own() -> None:
    """They are imported by their names, so that of two alike one would not be collected."""
    names = [path.name for path in (ROOT / "test").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))

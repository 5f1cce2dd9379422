"""`make check` refuses a module that has no place among the layers."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("stray", ["vessel_hsmc_ros/stray.py", "vessel_hsmc_ros/stray/__init__.py", "vessel_sim_node/stray.py"])
def test_a_new_module_outside_the_rooms_breaks_a_contract(copy: Path, stray: str) -> None:
    (copy / stray).parent.mkdir(exist_ok=True)
    (copy / stray).write_text('"""A module that no contract names."""\n')
    done = lint_imports(copy)
    assert done.returncode == 1
    assert "stray" in done.stdout

"""Copies of the source tree, for tests that build or change it."""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOP = shutil.ignore_patterns(".*", "build", "dist", "install", "log", "runs")
ANYWHERE = shutil.ignore_patterns("*.egg-info", "__pycache__")


def _not_source(folder: str, names: list[str]) -> set[str]:
    # `runs` is ignored at the top only: below, it is a package.
    return ANYWHERE(folder, names) | (TOP(folder, names) if Path(folder) == ROOT else set())


def copy_source(target: Path) -> Path:
    """Copy the source tree without builds, runs and caches, as a fresh clone would have it; return the target."""
    shutil.copytree(ROOT, target, ignore=_not_source)
    return target

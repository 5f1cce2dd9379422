"""Figures that are composed but not rendered: for tests that look for their files and not at their pixels."""

from pathlib import Path
from typing import Any

import pytest


def leave_unrendered(patch: pytest.MonkeyPatch) -> None:
    """Make figures empty files: rendering takes most of the time of a report, and other tests look at it."""
    patch.setattr("matplotlib.figure.Figure.savefig", _touched)


def _touched(_: object, file: Any, **__: object) -> None:
    """Begin the file; a stream, from which a page takes its picture, is left empty too."""
    if isinstance(file, Path):
        file.touch()

"""The page of the fault matrix."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any


def write_page(path: Path, cells: Sequence[Any], minutes: float) -> None:
    """Write the table of all cells."""
    raise NotImplementedError

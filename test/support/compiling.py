"""Kernels in tests: compiled where they can be, and tests of the compilation only there."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.core.kernel import bound
from vessel_hsmc_ros.simulation import compiled_loop
from vessel_hsmc_ros.simulation.compilation import available

only_compiled = pytest.mark.skipif(not available(), reason="compilation is switched off, or Numba is not installed")
"""Marks tests of machine code, and those whose runs take minutes without it."""


def repeated(count: int) -> int:
    """A number of repetitions of a kernel, a hundredth of it where the kernel is interpreted."""
    return count if available() else count // 100


def as_plain_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let compiled loops run their text as plain Python, with the same kernels in the place of names.

    So their glue is under test where kernels are not compiled, and a test needs no machine code of its own.
    """

    def text(function: Any, title: str = "", allocates: bool = True, **kernels: Any) -> Any:
        del title, allocates
        return bound(function, **kernels)

    def drawn(draw: Any, rows: int, columns: int, wanted: bool) -> Any:
        # Machine code passes rows that do not exist on to kernels that do not read them.
        return draw(rows) if wanted else np.full((rows, columns), np.nan)

    monkeypatch.setattr(compiled_loop, "_drawn", drawn)
    monkeypatch.setattr(compiled_loop, "compiled", text)
    monkeypatch.setattr(compiled_loop, "available", lambda: True)

"""Kernels in tests: compiled where they can be, and tests of the compilation only there."""

from typing import Any

import pytest

from vessel_hsmc_ros.simulation.compilation import available, compiled

only_compiled = pytest.mark.skipif(not available(), reason="compilation is switched off, or Numba is not installed")
"""Marks tests of machine code, and those whose runs take minutes without it."""


def fastest(kernel: Any) -> Any:
    """A kernel compiled, or interpreted where compilation is switched off, as for mutants of kernels."""
    return compiled(kernel) if available() else kernel


def repeated(count: int) -> int:
    """A number of repetitions of a kernel, a hundredth of it where the kernel is interpreted."""
    return count if available() else count // 100

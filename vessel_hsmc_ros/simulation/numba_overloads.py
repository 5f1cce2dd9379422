"""What Numba lacks, written so that it gives the bits of CPython."""

import math
from typing import Any

from numba.extending import overload


@overload(math.remainder)
def _remainder(x: Any, y: Any) -> Any:  # noqa: ARG001 - Numba calls it with types
    """IEEE 754 remainder: fmod is exact, then the half-way rule."""

    def implementation(x: Any, y: Any) -> Any:
        if math.isnan(x) or math.isnan(y) or math.isinf(x) or y == 0.0:
            return math.nan
        if math.isinf(y):
            return x
        size, period = abs(x), abs(y)
        rest = size % period  # exact: both are positive
        gap = period - rest
        if rest > gap:
            rest = -gap
        elif rest == gap:  # half-way: to the even multiple
            rest -= 2.0 * ((0.5 * (size - rest)) % period)
        return math.copysign(1.0, x) * rest

    return implementation

"""Kernels, and what they are made of: arrays, limits and delay lines.

Marks the functions that can be compiled, so that one text serves the interpreted nodes and compiled batches of runs.

A kernel keeps to what Numba's nopython mode compiles to bit-identical results: floats, tuples, NamedTuples without defaults, and
arrays that are written in place; explicit loops instead of np.dot and np.exp, and products instead of `**` and math.hypot, whose
last bits differ between implementations. It may call other kernels by their names in its module, and raises no exceptions.

`array.tolist()` gives plain floats, with which CPython computes several times faster than with elements of an array. Compiled, it
is the array itself: a kernel only reads the list, and not after it has changed the array.

Elementwise operations on arrays in place: NumPy's where they are interpreted, loops where they are compiled.

Both give the same numbers, since every element is one rounded product or sum. NumPy's functions compile as well, but for arrays
of a few dozen elements their tests of shapes take longer than the arithmetic.

The saturation function of control engineering, and what counts as saturated.

A delay of whole periods: the last values in a ring buffer, which kernels write in place.
"""

import types
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])

KERNELS: set[Callable[..., Any]] = set()  # all kernels that have been imported


def kernel(function: Function) -> Function:
    """Mark a function as a kernel; it is returned unchanged, and runs interpreted unless it is compiled."""
    KERNELS.add(function)
    return function


def bound(function: Callable[..., Any], **kernels: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of a function with other kernels instead of names of its module.

    Numba cannot store a function that takes functions as arguments; one that calls them by name it can.
    """
    copy = types.FunctionType(function.__code__, {**function.__globals__, **kernels}, function.__name__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


Array = NDArray[np.float64]


def multiply(x: Array, y: Any, out: Array) -> None:
    """Write the products x·y.

    `x`: shape (l,) or (k, l) or (k, 1). `y`: a number or an array of shape (l,). `out`: array for the products, shape (l,) or
    (k, l).
    """
    np.multiply(x, y, out)


def add(x: Array, y: Array, out: Array) -> None:
    """Write the sums x + y of arrays of equal shape, (l,) or (k, l)."""
    np.add(x, y, out)


def add_outer(x: Array, y: Array, out: Array, scratch: Array) -> None:
    """Add the products x·yᵀ.

    `x`: shape (k, 1). `y`: shape (l,). `out`: array to add to, shape (k, l). `scratch`: an array to work in, shape (k, l).
    """
    np.multiply(x, y, scratch)
    np.add(out, scratch, out)


AT_LIMIT = 1.0 - 1e-6
"""A command is at its limit from this share of it on: a law that clips in other units, or a recorded number, is rounded."""


@kernel
def clip(value: float, limit: float) -> float:
    """Saturate a value symmetrically: min(max(value, -limit), limit), with limit >= 0; NaN stays NaN."""
    # Comparisons, because min and max order -0 and 0 differently when they are compiled.
    if value > limit:
        return limit
    if value < -limit:
        return -limit
    return value


@kernel
def between(value: float, low: float, high: float) -> float:
    """Limit a value to the interval from low to high; NaN stays NaN."""
    if value > high:
        return high
    if value < low:
        return low
    return value


EMPTY = -1  # index of the last row before the first


class DelayLine(NamedTuple):
    """The values of the last periods, arrays that are written in place."""

    rows: NDArray[np.float64]  # values of a period each, shape (n, k), of delays up to n - 1 periods
    last: NDArray[np.int64]  # index of the row of the last period, shape (1,)


def delay_line(periods: int, width: int) -> DelayLine:
    """A line that is empty. `periods`: the longest delay, periods. `width`: number of values of a period."""
    return DelayLine(np.zeros((periods + 1, width)), np.full(1, EMPTY))


def whole_periods(delay: float, period: float) -> int:
    """The number of periods that is closest to a delay; both in s."""
    return round(delay / period)


@kernel
def put(line: DelayLine, values: Any) -> None:
    """Replace the oldest values by those of this period. `values`: as many as the line is wide; a tuple."""
    i = (line.last[0] + 1) % len(line.rows)
    line.last[0] = i
    for j in range(len(values)):
        line.rows[i, j] = values[j]


@kernel
def fill(line: DelayLine, values: Any) -> None:
    """Write the values of this period as if they had been the same in all periods before; the arguments are those of `put`."""
    for i in range(len(line.rows)):
        for j in range(len(values)):
            line.rows[i, j] = values[j]
    line.last[0] = 0


@kernel
def delayed(line: DelayLine, periods: int, column: int) -> float:
    """The value of some periods ago. `periods`: the delay, 0 for this period."""
    return float(line.rows[(line.last[0] - periods) % len(line.rows), column])

"""What Numba lacks: some functions and methods with the results of CPython."""

import math
from typing import Any

from numba.core.types import Array
from numba.extending import overload, overload_method

from vessel_hsmc_ros.core.kernel import add, add_outer, multiply


@overload(math.remainder)  # type: ignore[untyped-decorator]
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


@overload_method(Array, "tolist")  # type: ignore[untyped-decorator]
def _tolist(array: Any) -> Any:  # noqa: ARG001
    """The array itself: kernels read plain floats from the list, which is faster only where they are interpreted."""

    def implementation(array: Any) -> Any:
        return array

    return implementation


@overload(multiply)  # type: ignore[untyped-decorator]
def _multiply(x: Any, y: Any, out: Any) -> Any:  # noqa: ARG001
    if out.ndim == 2:
        return _multiply_rows if isinstance(y, Array) else _scale_rows

    def implementation(x: Any, y: Any, out: Any) -> None:
        for i in range(len(out)):
            out[i] = x[i] * y

    def of_arrays(x: Any, y: Any, out: Any) -> None:
        for i in range(len(out)):
            out[i] = x[i] * y[i]

    return of_arrays if isinstance(y, Array) else implementation


def _scale_rows(x: Any, y: Any, out: Any) -> None:
    rows, columns = out.shape
    for i in range(rows):
        for j in range(columns):
            out[i, j] = x[i, j] * y


def _multiply_rows(x: Any, y: Any, out: Any) -> None:
    rows, columns = out.shape
    if x.shape[1] == columns:
        for i in range(rows):
            for j in range(columns):
                out[i, j] = x[i, j] * y[j]
    else:
        for i in range(rows):
            factor = x[i, 0]
            for j in range(columns):
                out[i, j] = factor * y[j]


@overload(add)  # type: ignore[untyped-decorator]
def _add(x: Any, y: Any, out: Any) -> Any:  # noqa: ARG001
    def implementation(x: Any, y: Any, out: Any) -> None:
        for i in range(out.shape[0]):
            for j in range(out.shape[1]):
                out[i, j] = x[i, j] + y[i, j]

    return implementation


@overload(add_outer)  # type: ignore[untyped-decorator]
def _add_outer(x: Any, y: Any, out: Any, scratch: Any) -> Any:  # noqa: ARG001
    def implementation(x: Any, y: Any, out: Any, scratch: Any) -> None:  # noqa: ARG001 - each product is added at once
        for i in range(out.shape[0]):
            factor = x[i, 0]
            for j in range(out.shape[1]):
                out[i, j] += factor * y[j]

    return implementation

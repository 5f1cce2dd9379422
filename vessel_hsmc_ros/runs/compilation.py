"""Compiles kernels with Numba: the same text that the nodes interpret, to machine code that gives the same bits.

float64 without fast-math: no operation is reordered, contracted or approximated.
"""

import functools
import math
import types
from collections.abc import Callable
from typing import Any

import numba
from numba.extending import overload, overload_method

from vessel_hsmc_ros.core.kernel import KERNELS


@overload(math.remainder)
def _remainder(x: Any, y: Any) -> Any:  # noqa: ARG001 - Numba calls it with types
    """IEEE 754 remainder, which Numba lacks: fmod is exact, then the half-way rule."""

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


@overload_method(numba.types.Array, "tolist")
def _tolist(array: Any) -> Any:  # noqa: ARG001
    """The array itself: kernels read plain floats from the list, which is faster only where they are interpreted."""

    def implementation(array: Any) -> Any:
        return array

    return implementation


@functools.cache
def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel compiled, with all the kernels that it calls; it is typed and translated at its first call."""
    used = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    names = {name: compiled(value) for name, value in used if _is_kernel(value)}
    copy = types.FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    # error_model: a division by zero gives infinity or NaN, without a test in every division.
    return numba.njit(error_model="numpy", nogil=True)(copy)


def _is_kernel(value: object) -> bool:
    return isinstance(value, types.FunctionType) and value in KERNELS

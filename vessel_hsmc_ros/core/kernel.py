"""Marks the functions that can be compiled, so that one text serves the interpreted nodes and compiled batches of runs.

A kernel keeps to what Numba's nopython mode compiles to bit-identical results: floats, tuples, NamedTuples without defaults, and
arrays that are written in place; explicit loops instead of np.dot and np.exp, and products instead of `**` and math.hypot, whose
last bits differ between implementations. It may call other kernels by their names in its module, and raises no exceptions.

`array.tolist()` gives plain floats, with which CPython computes several times faster than with elements of an array. Compiled, it
is the array itself: a kernel only reads the list, and not after it has changed the array.
"""

import types
from collections.abc import Callable
from typing import Any, TypeVar

Function = TypeVar("Function", bound=Callable[..., Any])

KERNELS: set[Callable[..., Any]] = set()  # all kernels that have been imported


def kernel(function: Function) -> Function:
    """Mark a function as a kernel; it is returned unchanged, and runs interpreted unless it is compiled."""
    KERNELS.add(function)
    return function


def bound(function: Callable[..., Any], **kernels: Callable[..., Any]) -> Callable[..., Any]:
    """A copy of a function with other kernels in the place of names of its module.

    Numba cannot store a function that takes functions as arguments; one that calls them by name it can.
    """
    copy = types.FunctionType(function.__code__, {**function.__globals__, **kernels}, function.__name__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy

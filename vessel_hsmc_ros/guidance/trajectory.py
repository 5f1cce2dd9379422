"""The whole trajectory of a reference in one call, for runs that know in advance how long they are."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.guidance.kernel_reference import KernelReference

Array = NDArray[np.float64]
Compiler = Callable[[Callable[..., Any]], Callable[..., Any]]


def interpreted(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function itself, in place of a compiler."""
    return function


def trajectory(parameters: ReferenceShipParameters, rate_hz: float, count: int, compiled: Compiler = interpreted) -> Array:
    """The motion of a reference at its published instants 0 to count - 1, bit-identical to stepping it.

    One that follows its vessel has the motion of its timetable, as if the vessel were never behind. `rate_hz`: rate at which it
    is published, Hz. `count`: number of instants. `compiled`: compiles a kernel; interpreted by default. Returns x, y, psi (not
    wrapped), u, v, r, du, dv, dr, shape (count, 9). Raises ParameterError as for `make_reference`; SimulationError if the
    motion is no longer finite.
    """
    reference = make_reference(replace(parameters, follow="time"), RateGrid(rate_hz).period)
    rows = np.full((count, 9), np.nan)
    if compiled is not interpreted and isinstance(reference, KernelReference):
        with suppress(ValueError):  # the cosine of an infinite heading, where another compiler interprets
            compiled(reference.follow)(reference.memory, reference.constants, rows)
        if np.isfinite(rows).all():
            return rows
    # Step by step, which raises the error that names what is no longer finite, and when.
    for k in range(count):
        if k:
            reference.advance()
        rows[k] = *reference.state, *reference.acceleration()
    return rows

"""The whole trajectory of a reference in one call, for runs that know in advance how long they are."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import bound, kernel
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.reference.factory import ReferenceShipParameters, make_reference
from vessel_hsmc_ros.reference.kernel_reference import KernelReference

Array = NDArray[np.float64]
Compiler = Callable[..., Callable[..., Any]]


def trajectory(parameters: ReferenceShipParameters, rate_hz: float, count: int, compiled: Compiler = bound) -> Array:
    """The motion of a reference at its published instants 0 to count - 1, bit-identical to stepping it.

    Args:
        parameters: Parameters of the node reference_ship.
        rate_hz: Rate at which it is published, Hz.
        count: Number of instants.
        compiled: Compiles a kernel with others in the place of names, called like `bound`, which leaves it interpreted.

    Returns:
        x, y, psi (not wrapped), u, v, r, du, dv, dr, shape (count, 9).

    Raises:
        ParameterError: as for `make_reference`.
        SimulationError: the motion is no longer finite.
    """
    reference = make_reference(parameters, RateGrid(rate_hz).period)
    rows = np.full((count, 9), np.nan)
    if isinstance(reference, KernelReference):
        kind = type(reference)
        with suppress(ValueError):  # the cosine of an infinite heading, where the kernels are interpreted
            compiled(follow, move=kind.move, read=kind.read)(reference.memory, reference.constants, rows)
        if np.isfinite(rows).all():
            return rows
    # Step by step, which raises the error that names what is no longer finite, and when.
    for k in range(count):
        if k:
            reference.advance()
        rows[k] = *reference.state, *reference.acceleration()
    return rows


@kernel
def move(memory: Any, constants: Any) -> Any:  # noqa: ARG001 - a stand-in
    """Stands for the kernel of a reference; see `KernelReference`."""
    return memory


@kernel
def read(memory: Any, constants: Any) -> Any:
    """Stands for the kernel of a reference; see `KernelReference`."""
    return memory, constants


@kernel
def follow(memory: Any, constants: Any, rows: Array) -> None:
    """Write the state and the accelerations of a reference at each of its steps.

    Args:
        memory: Its memory at the first step.
        constants: Its constants.
        rows: Written in place, shape (n, 9).
    """
    for k in range(len(rows)):
        if k > 0:
            memory = move(memory, constants)
        motion, acceleration = read(memory, constants)
        for i in range(6):
            rows[k, i] = motion[i]
        for i in range(3):
            rows[k, 6 + i] = acceleration[i]

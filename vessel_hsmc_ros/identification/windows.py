"""Simulates recorded runs window by window on the plant's own kernel: the pieces of output-error refinement and of prediction."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.identification.types import Array, Measurements
from vessel_hsmc_ros.simulation import compilation
from vessel_sim_node.integrate import rk4_step
from vessel_sim_node.plant import Vessel

LARGEST_STEP = 0.1
"""Samples that are further apart are bridged by several steps, s."""


class Windows(NamedTuple):
    """Samples of runs one after the other, and where each window begins.

    Attributes:
        times: Time from each sample to the next, (n,), s.
        wrench: (n, 3).
        first: Index of each window's first sample, and of the sample after its last: (w, 2).
        measured: x, y, psi, u, v, r, (n, 6); NaN where not measured.
        steps: Steps of integration from a sample to the next.
    """

    times: Array
    wrench: Array
    first: NDArray[np.int64]
    measured: Array
    steps: int


def windows(runs: list[Measurements], length: float) -> Windows:
    """Cut runs into windows of equal length, in s; samples left over at the end of a run belong to its last window."""
    times, first, begin = [], [], 0
    for run in runs:
        step = np.diff(run.time)
        times.append(np.append(step, step[-1]))
        samples = max(2, round(length / float(np.median(step))))
        count = max(1, len(run.time) // samples)
        ends = [*range(begin + samples, begin + count * samples, samples), begin + len(run.time)]
        first += list(zip([begin, *ends[:-1]], ends, strict=True))
        begin += len(run.time)
    measured = np.concatenate([np.hstack([run.pose, run.velocity]) for run in runs])
    every = np.concatenate(times)
    steps = max(1, math.ceil(float(np.median(every)) / LARGEST_STEP - 1e-6))
    return Windows(every, np.concatenate([run.wrench for run in runs]), np.array(first), measured, steps)


def simulated(cut: Windows, starts: Array, vessel: Vessel, gains: Array, offsets: Array) -> Array:
    """The motion in all windows, (n, 6).

    Args:
        cut: The windows.
        starts: State at the first sample of each, (w, 6).
        vessel: Coefficients of the ship.
        gains: Factors on surge force, sway force and yaw moment, (3,).
        offsets: Steady forces in the earth-fixed frame and yaw moment, (3,).
    """
    states = np.empty((len(cut.times), 6))
    call: Any = compilation.compiled(simulate_windows, allocates=False) if compilation.available() else simulate_windows
    call(cut.times, cut.wrench, cut.first, starts, vessel, gains, offsets, cut.steps, states)
    return states


@kernel
def simulate_windows(
    times: Array,
    wrench: Array,
    first: NDArray[np.int64],
    starts: Array,
    vessel: Vessel,
    gains: Array,
    offsets: Array,
    steps: int,
    states: Array,
) -> None:
    """`simulated` into an array; the wrench is constant from each sample to the next.

    Args:
        times, wrench, first, steps: As in `Windows`.
        starts, vessel, gains, offsets: As in `simulated`.
        states: Array for the result, (n, 6).
    """
    for window in range(len(first)):
        x, y, psi, u, v, r = (
            starts[window, 0],
            starts[window, 1],
            starts[window, 2],
            starts[window, 3],
            starts[window, 4],
            starts[window, 5],
        )
        motion = Motion(float(x), float(y), float(psi), float(u), float(v), float(r))
        for row in range(first[window, 0], first[window, 1]):
            states[row, 0], states[row, 1], states[row, 2] = motion.x, motion.y, motion.psi
            states[row, 3], states[row, 4], states[row, 5] = motion.u, motion.v, motion.r
            for _ in range(steps):
                force = total_wrench(motion.psi, wrench, row, gains, offsets)
                motion = rk4_step(motion, force, (0.0, 0.0, 0.0), vessel, times[row] / steps, (0.0, 0.0))


@kernel
def total_wrench(psi: float, wrench: Array, row: int, gains: Array, offsets: Array) -> tuple[float, float, float]:
    """The wrench on the hull at a sample: the recorded one times its gains, and the steady forces in the body frame.

    Args:
        psi: Heading.
        wrench: (n, 3).
        row: Sample.
        gains, offsets: As in `simulated`.
    """
    c, s = math.cos(psi), math.sin(psi)
    return (
        gains[0] * wrench[row, 0] + c * offsets[0] + s * offsets[1],
        gains[1] * wrench[row, 1] + c * offsets[1] - s * offsets[0],
        gains[2] * wrench[row, 2] + offsets[2],
    )

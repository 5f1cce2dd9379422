"""Simulates recorded runs window by window on the plant's own kernel: the pieces of output-error refinement and of prediction."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.identification.types import Array, Measurements
from vessel_hsmc_ros.simulation import compilation
from vessel_sim_node.integrate import rk4_step
from vessel_sim_node.plant import Vessel

Integers = NDArray[np.int64]

LARGEST_STEP = 0.25
"""Samples that are further apart are bridged by several steps, s."""


class Windows(NamedTuple):
    """Windows of runs, with one row each, padded at their ends to the same number of samples.

    Attributes:
        times: Time from each sample to the next, zero in the padding, (w, k), s.
        wrench: (w, k, 3).
        measured: x, y, psi, u, v, r, (w, k, 6); NaN where not measured and in the padding.
        begin, end: The samples of each window among those of all runs, (w,) each.
        steps: Steps of integration from a sample to the next.
    """

    times: Array
    wrench: Array
    measured: Array
    begin: Integers
    end: Integers
    steps: int


def windows(runs: Sequence[Measurements], length: float, exact: bool = False) -> Windows:
    """Cut runs into windows of about one length.

    Args:
        runs: The runs.
        length: Of a window, s.
        exact: Exactly this length, without what is left at the end of a run, instead of equal parts.
    """
    edges, at = [], 0
    for run in runs:
        samples = max(2, round(length / float(np.median(np.diff(run.time)))))
        count = max(1, len(run.time) // samples if exact else round(len(run.time) / samples))
        stop = min(count * samples, len(run.time)) if exact else len(run.time)
        bounds = np.linspace(0, stop, count + 1).round().astype(np.int64) + at
        edges.append(np.stack([bounds[:-1], bounds[1:]]))
        at += len(run.time)
    begin, end = np.concatenate(edges, axis=1)
    rows = begin[:, None] + np.arange(int(np.max(end - begin)))
    inside = rows < end[:, None]
    rows = np.where(inside, rows, begin[:, None])
    times = np.concatenate([np.append(np.diff(run.time), run.time[-1] - run.time[-2]) for run in runs])
    measured = np.concatenate([np.hstack([run.pose, run.velocity]) for run in runs])[rows]
    measured[~inside] = np.nan
    steps = max(1, math.ceil(float(np.median(times)) / LARGEST_STEP - 1e-6))
    return Windows(
        np.where(inside, times[rows], 0.0), np.concatenate([run.wrench for run in runs])[rows], measured, begin, end, steps
    )


def unrolled(cut: Windows, values: Array, samples: int) -> Array:
    """Values by window, (w, k, c), as those of all runs one after the other, (n, c); NaN outside of the windows."""
    result = np.full((samples, values.shape[2]), np.nan)
    for begin, end, part in zip(cut.begin, cut.end, values, strict=True):
        result[begin:end] = part[: end - begin]
    return result


def simulated(cut: Windows, starts: Array, vessel: Vessel, gains: Array, offsets: Array) -> Array:
    """The motion in all windows, (w, k, 6).

    Args:
        cut: The windows.
        starts: State at the first sample of each, (w, 6).
        vessel: Coefficients of the ship.
        gains: Factors on surge force, sway force and yaw moment, (3,).
        offsets: Steady forces in the earth-fixed frame and yaw moment, (3,).
    """
    states = np.empty(cut.measured.shape)
    call: Any = compilation.compiled(simulate_windows, allocates=False) if compilation.available() else simulate_windows
    call(cut.times, cut.wrench, starts, vessel, gains, offsets, cut.steps, states)
    return states


@kernel
def simulate_windows(
    times: Array, wrench: Array, starts: Array, vessel: Vessel, gains: Array, offsets: Array, steps: int, states: Array
) -> None:
    """`simulated` into an array; the wrench is constant from each sample to the next.

    Args:
        times, wrench, steps: As in `Windows`.
        starts, vessel, gains, offsets: As in `simulated`.
        states: Array for the result, (w, k, 6).
    """
    for window in range(len(starts)):
        first = starts[window].tolist()
        motion = Motion(first[0], first[1], first[2], first[3], first[4], first[5])
        for row in range(times.shape[1]):
            states[window, row, 0], states[window, row, 1], states[window, row, 2] = motion.x, motion.y, motion.psi
            states[window, row, 3], states[window, row, 4], states[window, row, 5] = motion.u, motion.v, motion.r
            for _ in range(steps):
                force = total_wrench(motion.psi, wrench[window, row], gains, offsets)
                motion = rk4_step(motion, force, (0.0, 0.0, 0.0), vessel, times[window, row] / steps, (0.0, 0.0))


@kernel
def total_wrench(psi: float, wrench: Array, gains: Array, offsets: Array) -> tuple[float, float, float]:
    """The wrench on the hull: the recorded one times its gains, and the steady forces in the body frame.

    Args:
        psi: Heading.
        wrench: (3,).
        gains, offsets: As in `simulated`.
    """
    c, s = math.cos(psi), math.sin(psi)
    return (
        gains[0] * wrench[0] + c * offsets[0] + s * offsets[1],
        gains[1] * wrench[1] + c * offsets[1] - s * offsets[0],
        gains[2] * wrench[2] + offsets[2],
    )

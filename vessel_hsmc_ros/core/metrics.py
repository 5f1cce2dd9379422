"""Performance metrics of a run: tracking errors and control effort.

All arrays have one row per sample: time (n,), state and reference (n, 6), wrench (n, 2).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Metrics(NamedTuple):
    """Metrics of a run; in m, N and N·m, with the unit as a suffix where it is another."""

    position_error_rms: float
    position_error_rms_last_quarter: float
    position_error_final: float
    heading_error_rms_deg: float
    heading_error_final_deg: float
    surge_force_peak: float
    surge_force_rms: float
    yaw_moment_peak: float
    yaw_moment_rms: float


def position_error(state: Array, reference: Array) -> Array:
    """Distance between ship and reference, (n,) m."""
    return np.hypot(state[:, 0] - reference[:, 0], state[:, 1] - reference[:, 1])


def heading_error(state: Array, reference: Array) -> Array:
    """Heading minus desired heading, wrapped to (-pi, pi], (n,)."""
    # As `kinematics.wrap`, on arrays.
    difference = state[:, 2] - reference[:, 2]
    return difference - 2.0 * np.pi * np.ceil((difference - np.pi) / (2.0 * np.pi))


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def evaluate(time: Array, state: Array, reference: Array, wrench: Array) -> Metrics:
    """Compute all metrics of a run.

    Args:
        time: Times of the samples, (n,) s, n at least 1.
        state, reference: x, y, psi, u, v, r of ship and reference, (n, 6).
        wrench: Applied surge force [N] and yaw moment [N·m], (n, 2).

    Returns:
        The metrics; every rms value weighs all samples equally, so the samples should be evenly spaced.
    """
    distance = position_error(state, reference)
    angle = np.degrees(heading_error(state, reference))
    # The last quarter represents the steady state, after the transient of the initial error has decayed.
    last_quarter = time >= time[0] + 0.75 * (time[-1] - time[0])
    return Metrics(
        rms(distance),
        rms(distance[last_quarter]),
        float(distance[-1]),
        rms(angle),
        float(angle[-1]),
        float(np.max(np.abs(wrench[:, 0]))),
        rms(wrench[:, 0]),
        float(np.max(np.abs(wrench[:, 1]))),
        rms(wrench[:, 1]),
    )


def reversals_per_second(time: Array, values: Array, after: float = 0.0) -> float:
    """How often a signal changes between rising and falling, per second: a measure of chattering.

    Samples at which the signal is constant, as between two control periods, are skipped.

    Args:
        time: Times of the samples, (n,) s.
        values: The signal, (n,).
        after: Start of the evaluated interval, s.

    Returns:
        Changes of sign of the slope per second; 0 for fewer than two samples.
    """
    evaluated = time >= after
    changes = np.diff(values[evaluated])
    signs = np.sign(changes[changes != 0.0])
    span = float(time[evaluated][-1] - time[evaluated][0]) if evaluated.any() else 0.0
    return float(np.count_nonzero(np.diff(signs))) / span if span > 0.0 else 0.0

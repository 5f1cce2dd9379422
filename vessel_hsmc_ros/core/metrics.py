"""What a run achieved: errors and effort, from arrays alone.

Arrays run over the samples of a run: state and reference (n, 6), wrench (n, 2), time (n,).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Metrics(NamedTuple):
    """Key figures of a run; m, rad, N and N·m, suffixed where a unit is another."""

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
    """Distance between ship and reference, (n,)."""
    return np.hypot(state[:, 0] - reference[:, 0], state[:, 1] - reference[:, 1])


def heading_error(state: Array, reference: Array) -> Array:
    """Heading minus desired heading, the short way round, in (-pi, pi], (n,)."""
    difference = state[:, 2] - reference[:, 2]
    return difference - 2.0 * np.pi * np.ceil((difference - np.pi) / (2.0 * np.pi))


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def evaluate(time: Array, state: Array, reference: Array, wrench: Array) -> Metrics:
    """All key figures of a run.

    Args:
        time: (n,) s, n at least 1.
        state, reference: x, y, psi, u, v, r, (n, 6).
        wrench: Applied surge force and yaw moment, (n, 2).
    """
    distance = position_error(state, reference)
    angle = np.degrees(heading_error(state, reference))
    late = time >= time[0] + 0.75 * (time[-1] - time[0])
    return Metrics(
        rms(distance),
        rms(distance[late]),
        float(distance[-1]),
        rms(angle),
        float(angle[-1]),
        float(np.max(np.abs(wrench[:, 0]))),
        rms(wrench[:, 0]),
        float(np.max(np.abs(wrench[:, 1]))),
        rms(wrench[:, 1]),
    )


def reversals_per_second(time: Array, values: Array, after: float = 0.0) -> float:
    """How often a signal reverses the sign of its rate; where it is held, as between two control periods, it has none.

    Args:
        time: (n,) s.
        values: (n,).
        after: From when on, s.
    """
    late = time >= after
    changes = np.diff(values[late])
    signs = np.sign(changes[changes != 0.0])
    span = float(time[late][-1] - time[late][0]) if late.any() else 0.0
    return float(np.count_nonzero(np.diff(signs))) / span if span > 0.0 else 0.0

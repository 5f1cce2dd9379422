"""Smooths a recorded run by local cubic polynomials: pose, body velocities and their derivatives at every sample.

The bandwidth is chosen from the data: the longest window whose residuals are hardly larger than the noise of the sensors, which
the third differences of neighbouring samples show. Velocities are differentiated from the pose where they are not measured.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.identification.types import Measurements

ORDER = 3
SHORTEST = 7
"""Window in samples: the shortest that still averages."""
TOLERANCE = 1.1
"""Largest ratio of the residuals of smoothing to the noise."""


class Smoothed(NamedTuple):
    """A smoothed run.

    Attributes:
        pose, velocity, acceleration: x, y, heading; u, v, r; du, dv, dr: (n, 3) each.
        noise: Standard deviation of the measured x, y, heading, u, v, r, (6,); NaN where not measured.
        error: The same of the smoothed ones, (6,), as far as it comes from noise.
        bandwidth: Length of the polynomials' window, s.
    """

    pose: Array
    velocity: Array
    acceleration: Array
    noise: Array
    error: Array
    bandwidth: float

    @property
    def states(self) -> Array:
        """x, y, psi, u, v, r, (n, 6)."""
        return np.hstack([self.pose, self.velocity])


def smooth(run: Measurements) -> Smoothed:
    """Smooth a run; u = R(psi)ᵀ·dp, and du = R(psi)ᵀ·ddp + (r·v, -r·u), where the velocities are not measured."""
    step = float(np.median(np.diff(run.time)))
    measured = np.isfinite(run.velocity).all()
    columns = np.hstack([run.pose, run.velocity]) if measured else run.pose
    noise = _noise(columns)
    width = _width(columns, noise)
    pose, rate, second = (savgol_filter(run.pose, width, ORDER, deriv, step, axis=0) for deriv in range(3))
    if measured:
        velocity, acceleration = (savgol_filter(run.velocity, width, ORDER, deriv, step, axis=0) for deriv in range(2))
    else:
        velocity = in_body_frame(rate, pose[:, 2])
        turning = velocity[:, [1, 0]] * velocity[:, 2:] * (1.0, -1.0)
        acceleration = in_body_frame(second, pose[:, 2]) + np.column_stack([turning, np.zeros(len(pose))])
    # A smoothed value is a weighted sum of samples, so its standard deviation is that of the noise times the norm of the weights.
    norms = [float(np.linalg.norm(savgol_coeffs(width, ORDER, deriv, step))) for deriv in range(2)]
    error = np.append(norms[0] * noise[:3], norms[0] * noise[3:] if measured else norms[1] * noise)
    return Smoothed(pose, velocity, acceleration, np.append(noise, [np.nan] * 3)[:6], error, width * step)


def in_body_frame(vectors: Array, heading: Array) -> Array:
    """Rotate horizontal vectors from the earth-fixed into the body frame; third components, (n, 3), stay."""
    c, s = np.cos(heading), np.sin(heading)
    return np.column_stack([c * vectors[:, 0] + s * vectors[:, 1], c * vectors[:, 1] - s * vectors[:, 0], vectors[:, 2]])


def _noise(columns: Array) -> Array:
    """Standard deviation of the noise of each column; third differences have 20 times its variance and hardly any motion."""
    return np.asarray(np.sqrt(np.mean(np.square(np.diff(columns, 3, axis=0)), axis=0) / 20.0))


def _width(columns: Array, noise: Array) -> int:
    """Window in samples, odd: doubled in steps of a half until smoothing changes a column by more than its noise."""
    width, longest = SHORTEST, max(SHORTEST, len(columns) // 4)
    while (wider := int(1.5 * width) // 2 * 2 + 1) <= longest:
        residuals = columns - savgol_filter(columns, wider, ORDER, axis=0)
        if np.any(np.sqrt(np.mean(np.square(residuals), axis=0)) > TOLERANCE * noise + 1e-12):
            break
        width = wider
    return width

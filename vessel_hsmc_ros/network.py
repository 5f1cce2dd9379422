"""The radial-basis-function network that stands in for the unknown dynamics, equations (1) to (3).

| symbol | meaning | unit | equation |
|---|---|---|---|
| Z | input: u, v, r | m/s, m/s, rad/s | (29) |
| mu | centres of the l neurons, shape (l, n) | as Z | (3) |
| delta | width of every neuron | as Z | (3) |
| H | activations of the neurons, shape (l,) | - | (2) |
| W | weights, shape (l,) | unit of f | (1) |

The printed (3) has the distance itself in the exponent; the text calls it a Gaussian, so its square is meant.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.schema import parameter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NetworkParameters:
    """One grid of neurons, shared by the networks of a law."""

    center: float = parameter(
        0.5, "Middle of the grid of centres, in each of surge, sway and yaw velocity.", low=-1e3, high=1e3, symbol="mu"
    )
    spacing: float = parameter(0.5, "Distance between neighbouring centres on an axis.", low=0.0, high=1e3)
    centers_per_axis: int = parameter(3, "Centres on each axis; their cube is the number of neurons.", low=1, high=9)
    width: float = parameter(5.0, "Width of every neuron.", low=1e-3, high=1e3, symbol="delta")

    def centers(self) -> Array:
        """All centres, shape (centers_per_axis³, 3)."""
        offsets = (np.arange(self.centers_per_axis) - 0.5 * (self.centers_per_axis - 1)) * self.spacing
        axis = self.center + offsets
        return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)


def activations(Z: Array, mu: Array, delta: float) -> Array:
    """H(Z) of (2) with the Gaussians h_i = exp(-|Z - mu_i|² / (2·delta²)) of (3).

    Args:
        Z: Input, shape (n,).
        mu: Centres, shape (l, n).
        delta: Width, above 0.

    Returns:
        Activations in (0, 1], shape (l,).
    """
    distance = Z - mu
    H: Array = np.exp(np.sum(distance * distance, axis=1) * (-0.5 / (delta * delta)))
    return H


def output(W: Array, H: Array) -> float:
    """f_n = WᵀH of (1)."""
    return float(np.dot(W, H))

"""The radial-basis-function (RBF) network that approximates the unknown dynamics, equations (1) to (3).

| symbol | meaning | unit | equation |
|---|---|---|---|
| Z | input: u, v, r | m/s, m/s, rad/s | (29) |
| mu | centres of the l neurons, shape (l, n) | as Z | (3) |
| delta | width of every neuron | as Z | (3) |
| H | activations of the neurons, shape (l,) | - | (2) |
| W | weights, shape (l,) | unit of f | (1) |

The printed (3) has the distance in the exponent; the text calls the function a Gaussian, so the squared distance is meant. The
printed form is selected by `basis: as_printed`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]


class Neurons(NamedTuple):
    """Centres, shape (l, n), width, and whether (3) is evaluated as printed; the arguments of `activations` after the input."""

    mu: Array
    delta: float
    as_printed: bool = False


@dataclass(frozen=True)
class NetworkParameters:
    """The neurons shared by all networks of a law, on a grid or listed one by one."""

    layout: str = parameter("grid", "Layout of the centres: on a grid, or as listed.", choices=("grid", "listed"))
    center: float = parameter(
        0.5, "Middle of the grid of centres, on each of the axes surge, sway and yaw velocity.", low=-1e3, high=1e3, symbol="mu"
    )
    spacing: float = parameter(0.5, "Distance between neighbouring centres on an axis.", low=0.0, high=1e3)
    centers_per_axis: int = parameter(3, "Centres on each axis; the number of neurons is its cube.", low=1, high=9)
    listed_centers: tuple[float, ...] = parameter(
        (0.5, 0.5, 0.5),
        "The listed centres: u, v, r of the first, u, v, r of the second and so on.",
        low=-1e3,
        high=1e3,
    )
    width: float = parameter(5.0, "Width of every neuron.", low=1e-3, high=1e3, symbol="delta")
    basis: str = parameter(
        "gaussian",
        "Exponent of (3): the squared distance, or the distance as printed.",
        choices=("gaussian", "as_printed"),
    )

    def neurons(self) -> Neurons:
        """Centres, width and form of the basis function.

        Raises:
            ParameterError: the number of listed centres is not a positive multiple of three.
        """
        return Neurons(self.centers(), self.width, self.basis == "as_printed")

    def centers(self) -> Array:
        """All centres, shape (l, 3); on the grid l = centers_per_axis³.

        Raises:
            ParameterError: the number of listed centres is not a positive multiple of three.
        """
        if self.layout == "listed":
            return self._listed()
        # Symmetric about the middle; with an even number of centres none lies in the middle itself.
        offsets = (np.arange(self.centers_per_axis) - 0.5 * (self.centers_per_axis - 1)) * self.spacing
        axis = self.center + offsets
        # Row-major order: the yaw velocity varies fastest. The order of the weights in bags depends on it.
        return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)

    def _listed(self) -> Array:
        numbers = np.array(self.listed_centers)
        if not len(numbers) or len(numbers) % 3:
            raise ParameterError(
                f"network.listed_centers = {list(self.listed_centers)} is not allowed:"
                " it takes three finite numbers for each centre, and one centre at least"
            )
        return numbers.reshape(-1, 3)


def activations(Z: Array, mu: Array, delta: float, as_printed: bool = False) -> Array:
    """H(Z) of (2) with the Gaussians h_i = exp(-|Z - mu_i|² / (2·delta²)) of (3).

    Args:
        Z: Input, shape (n,).
        mu: Centres, shape (l, n).
        delta: Width, above 0.
        as_printed: Evaluate the printed h_i = exp(-|Z - mu_i| / (2·delta²)) instead.

    Returns:
        Activations in (0, 1], shape (l,).
    """
    distance = Z - mu
    squared = np.sum(distance * distance, axis=1)
    H: Array = np.exp((np.sqrt(squared) if as_printed else squared) * (-0.5 / (delta * delta)))
    return H


def output(W: Array, H: Array) -> float:
    """The network's output f_n = WᵀH of (1)."""
    return float(np.dot(W, H))

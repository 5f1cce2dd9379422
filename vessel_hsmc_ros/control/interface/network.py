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

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import Array, add, add_outer, kernel, multiply
from vessel_hsmc_ros.core.schema import parameter

LONGEST_LOOP = 32  # longer sums are folded before they are added up one by one


class Estimates(NamedTuple):
    """Outputs of the networks for f_u, f_v, f_r."""

    fu: float
    fv: float
    fr: float


class Neurons(NamedTuple):
    """The neurons of a network."""

    mu: Array  # centres, shape (l, 3)
    delta: float  # width
    as_printed: bool  # whether (3) is evaluated as printed
    axis: Array  # centres of a grid on each of its axes, shape (k,) with l = k³; empty for centres that are listed


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
        (0.5, 0.5, 0.5), "The listed centres: u, v, r of the first, u, v, r of the second and so on.", low=-1e3, high=1e3
    )
    width: float = parameter(5.0, "Width of every neuron.", low=1e-3, high=1e3, symbol="delta")
    basis: str = parameter(
        "gaussian", "Exponent of (3): the squared distance, or the distance as printed.", choices=("gaussian", "as_printed")
    )

    def neurons(self) -> Neurons:
        """Centres, width and form of the basis function."""
        as_printed = self.basis == "as_printed"
        # Only the Gaussian of a squared distance is the product of Gaussians of its axes.
        axis = self._axis() if self.layout == "grid" and not as_printed else np.empty(0)
        return Neurons(self.centers(), self.width, as_printed, axis)

    def centers(self) -> Array:
        """All centres, shape (l, 3); on the grid l = centers_per_axis³."""
        if self.layout == "listed":
            return self._listed()
        axis = self._axis()
        # Row-major order: the yaw velocity varies fastest. The order of the weights in bags depends on it.
        return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)

    def _axis(self) -> Array:
        # Symmetric about the middle; with an even number of centres none lies in the middle itself.
        offsets: Array = (np.arange(self.centers_per_axis, dtype=float) - 0.5 * (self.centers_per_axis - 1)) * self.spacing
        axis: Array = self.center + offsets
        return axis

    def _listed(self) -> Array:
        numbers = np.array(self.listed_centers)
        if not len(numbers) or len(numbers) % 3:
            raise ParameterError(
                "network.listed_centers must be three finite numbers for each centre, and at least one centre"
                f" (got {list(self.listed_centers)})"
            )
        return numbers.reshape(-1, 3)


def activations(Z: Array, mu: Array, delta: float, as_printed: bool = False) -> Array:
    """H(Z) of (2) with the Gaussians h_i = exp(-|Z - mu_i|² / (2·delta²)) of (3).

    `Z`: input, shape (3,). `mu`: centres, shape (l, 3). `delta`: width, above 0. `as_printed`: evaluate the printed h_i =
    exp(-|Z - mu_i| / (2·delta²)) instead. Returns activations in (0, 1], shape (l,).
    """
    H = np.empty(len(mu))
    activate(float(Z[0]), float(Z[1]), float(Z[2]), Neurons(mu, delta, as_printed, np.empty(0)), H)
    return H


@kernel
def activate(u: float, v: float, r: float, n: Neurons, H: Array) -> None:
    """Write H(Z) of (2), (3) for Z = (u, v, r) into an array of shape (l,)."""
    scale = -0.5 / (n.delta * n.delta)
    k = len(n.axis)
    if k == 3:  # usual: compiled, loops of a constant length need no counter
        _activate_grid(u, v, r, n.axis, 3, scale, H)
        return
    if k:
        _activate_grid(u, v, r, n.axis, k, scale, H)
        return
    for i in range(len(H)):
        du, dv, dr = u - n.mu[i, 0], v - n.mu[i, 1], r - n.mu[i, 2]
        distance = du * du + dv * dv + dr * dr
        H[i] = math.exp((math.sqrt(distance) if n.as_printed else distance) * scale)


@kernel
def _activate_grid(u: float, v: float, r: float, axis: Array, k: int, scale: float, H: Array) -> None:
    """`activate` on a grid: exp(-(a + b + c)) = exp(-a)·exp(-b)·exp(-c), so k³ neurons need 3·k exponentials."""
    places = axis.tolist()
    for i in range(k):
        dr = r - places[i]
        H[i] = math.exp(dr * dr * scale)
    # Every row of neurons is the first one times the factor of its place, and so is every plane; the first is written last.
    for row in range(k - 1, -1, -1):
        dv = v - places[row]
        factor = math.exp(dv * dv * scale)
        for i in range(k):
            H[row * k + i] = factor * H[i]
    size = k * k
    for plane in range(k - 1, -1, -1):
        du = u - places[plane]
        multiply(H[:size], math.exp(du * du * scale), H[plane * size : (plane + 1) * size])


@kernel
def output(W: Array, H: Array, scratch: Array) -> float:
    """The network's output f_n = WᵀH of (1), with an array to work in, shape (k, l) and k >= 1."""
    multiply(W, H, scratch[0])
    total = 0.0
    for product in scratch[0, : _fold(scratch[:1])].tolist():
        total += product
    return total


@kernel
def outputs(W: Array, H: Array, scratch: Array) -> Estimates:
    """The outputs (1) of three networks that share their neurons.

    `W`: weights, shape (3, l). `H`: activations, shape (l,). `scratch`: an array to work in, shape (3, l). Returns the outputs,
    in the order of the rows of W.
    """
    multiply(W, H, scratch)
    sums = scratch[:, : _fold(scratch)]
    fu, fv, fr = 0.0, 0.0, 0.0
    for u, v, r in zip(sums[0].tolist(), sums[1].tolist(), sums[2].tolist()):  # noqa: B905 - Numba knows no `strict`
        fu += u
        fv += v
        fr += r
    return Estimates(fu, fv, fr)


@kernel
def _fold(rows: Array) -> int:
    """Add the halves of long rows until they have at most LONGEST_LOOP elements with the same sum; their number."""
    # Whole halves at once, because a loop over 729 elements is slow where it is interpreted.
    n: int = rows.shape[1]
    while n > LONGEST_LOOP:
        half = n // 2
        add(rows[:, :half], rows[:, n - half : n], rows[:, :half])
        n -= half
    return n


@kernel
def adapt(W: Array, growth: Array, H: Array, scratch: Array) -> None:
    """One step of the adaptation of k networks that share their neurons, in place: W += growth·Hᵀ.

    `W`: weights, shape (k, l). `growth`: change of the weights of each network for a fully active neuron, shape (k, 1). `H`:
    activations, shape (l,). `scratch`: an array to work in, shape (k, l).
    """
    add_outer(growth, H, W, scratch)

"""The linear-quadratic regulator of a ship's distance from its track, heading, sway velocity and yaw rate.

| symbol | meaning | unit |
|---|---|---|
| e | distance of the ship to port of its track | L |
| psi, v, r | heading, sway velocity and yaw rate beyond those of the track | rad, L/T, 1/T |
| W | speed through the water | L/T |
| a, kappa | decay rate of the sway, and its growth per surge velocity and yaw rate | 1/T, - |
| e_0, r_0 | what is worth the full yaw moment; e_0 at least | L, 1/T |

    de = W·psi + v,   dpsi = r,   dv = -a·v - kappa·W·r,   dr = alpha,   minimise the integral of (e/e_0)² + (r/r_0)² + alpha²

From alpha to e this hull has a zero at -a/(1 - kappa): where kappa > 1 its course is non-minimum phase, and no gain can make it
faster than that zero. Where lateral damping has its centre x_d behind the pivot, kappa is less by a·x_d/W. The Riccati equation
knows it; with instant actuators its loop has an infinite gain margin and a phase margin of 60 degrees (R. E. Kalman,
When is a linear control system optimal?, Journal of Basic Engineering 86, 1964).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import between

SPEEDS = 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.9, 1.35, 2.0
DECAYS = 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8
RATIOS = -2.0, -1.0, -0.4, 0.0, 0.3, 0.5, 0.7, 0.85, 1.0, 1.1, 1.2, 1.35, 1.6  # the grid of W, a and kappa
LARGEST_HEADING_GAIN = 20.0  # largest K_psi, 1/T²: a faster loop answers to the unmodelled more than to its errors


def regulator(W: ArrayLike, a: ArrayLike, kappa: ArrayLike, e_0: ArrayLike, r_0: float) -> Array:
    """The gains K of alpha = -K·(e, psi, v, r), shape (..., 4), from the stable subspaces of the Hamiltonian matrices."""
    W, a, kappa, e_0 = np.broadcast_arrays(*map(np.asarray, (W, a, kappa, e_0)))
    H = np.zeros((*W.shape, 8, 8))
    H[..., 0, 1], H[..., 0, 2], H[..., 1, 3], H[..., 2, 2], H[..., 2, 3] = W, 1.0, 1.0, -a, -kappa * W
    H[..., 4:, 4:] = -np.swapaxes(H[..., :4, :4], -1, -2)
    H[..., 3, 7], H[..., 4, 0], H[..., 7, 3] = -1.0, -1.0 / e_0**2, -1.0 / r_0**2
    values, vectors = np.linalg.eig(H)
    stable = np.take_along_axis(vectors, np.argsort(values.real)[..., None, :4], axis=-1)
    P = np.real(stable[..., 4:, :] @ np.linalg.inv(stable[..., :4, :]))
    return np.ascontiguousarray(P[..., 3, :])


def bounded(W: ArrayLike, a: ArrayLike, kappa: ArrayLike, e_0: float, r_0: float) -> Array:
    """The gains K, shape (..., 4), of the least e_0, in steps of a quarter, at which K_psi is at most LARGEST_HEADING_GAIN.

    At speed the track is worth less, because K_psi grows with it: K_e = 1/e_0 whatever W, a and kappa.
    """
    K = regulator(W, a, kappa, e_0, r_0)
    W, a, kappa = np.broadcast_arrays(W, a, kappa)
    while (large := K[..., 1] > LARGEST_HEADING_GAIN).any():
        e_0 *= 1.25
        K[large] = regulator(W[large], a[large], kappa[large], e_0, r_0)
    return K


@lru_cache(maxsize=16)
def table(e_0: float, r_0: float) -> Array:
    """The gains on the grid, shape (9, 9, 13, 4); they are the same for every ship with the same e_0."""
    found = bounded(*np.meshgrid(SPEEDS, DECAYS, RATIOS, indexing="ij"), e_0, r_0)
    found.flags.writeable = False
    return found


@kernel
def place(value: float, nodes: tuple[float, ...]) -> tuple[int, float]:
    """The node below a value, and the share of the way to the next one; values outside count as the first or last node."""
    i = 0
    while i < len(nodes) - 2 and value >= nodes[i + 1]:
        i += 1
    return i, between((value - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)


@kernel
def interpolate(W: float, a: float, kappa: float, t: Array, K: Array) -> None:
    """The gains between the nodes of the grid, trilinear, written to K, shape (4,)."""
    i, p = place(W, SPEEDS)
    j, q = place(a, DECAYS)
    k, s = place(kappa, RATIOS)
    for n in range(4):
        K[n] = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                share = (p if di else 1.0 - p) * (q if dj else 1.0 - q) * (s if dk else 1.0 - s)
                for n in range(4):
                    K[n] += share * t[i + di, j + dj, k + dk, n]

"""Sway model and current of a hull with low sway damping, learned together while the ship turns.

| symbol | meaning | unit |
|---|---|---|
| c, c_h, c_n | current: east and north, ahead of the hull, to port | m/s |
| v_r | sway velocity through the water, v - c_n | m/s |
| kappa | declared `coriolis_ratio`, or m11/m22 | - |
| A | decay rate of v_r, a1 + a2·abs(v_r) + a3·abs(r) | 1/s |
| a | declared `sway_damping_rate`, the initial a1 | 1/s |
| p | what is learned: c towards the east and the north, a1, a2, a3 | - |
| P, P_0 | covariance of p, and its initial value | - |
| h | derivatives of the residual by p, with the opposite sign | - |
| e | residual of the sway equation with the opposite sign | m/s² |
| R | variance of e after a radian of turn | m²/s⁴ |

    dv + r·c_h + kappa·(u - c_h)·r + A·(v - c_n) = -e

On such a hull the sway that a turn causes is as large as what a current does, and follows the turn late, so that the two
can be distinguished by the dynamics of both only. An extended Kalman filter learns them with the angle of turn in the place of
time: on a straight path nothing is learned and nothing forgotten. P returns to P_0 as the ship turns, so that damping that does
not follow the model counts as a change of a1, a2 and a3.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import GRAVITY as GRAVITY
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.rule import unit_time
from vessel_hsmc_ros.law.known_vessel import KnownVessel

CURRENT, LINEAR, QUADRATIC, TURNING = 0.03, 2.0, 2.0, 0.5
"""Initial deviations of c in sqrt(g·L), of a1 in a, of a2 in 1/L and of a3."""

FORGOTTEN_C, FORGOTTEN_A = 0.05, 0.01
"""Share of P that returns to P_0 in a radian, of c and of the rest. Where a1, a2 and a3 change within a turn, they explain what
the current does."""

RESIDUAL, LEAST = 0.2, 0.02
"""Deviation of e after a radian in terms of abs(u·r), with at least LEAST·a·sqrt(g·L) in the place of abs(u·r). Much less, and c
would follow every error of the model round the circle."""

OUTLIER = 3.0
"""Largest residual in terms of its deviation."""

MIN_DECAY = 0.2
"""Smallest a1 in terms of a."""


Five = tuple[float, float, float, float, float]


class SwayPrior(NamedTuple):
    """What is known before: a (negative: not declared), kappa, the diagonal of P_0, smallest abs(u·r), largest v_r and r."""

    a: float
    kappa: float
    spread: Five
    least: float
    v_max: float
    r_max: float


def sway_prior(vessel: KnownVessel) -> SwayPrior:
    """The prior of a declared vessel."""
    a, wave, T = vessel.sway_damping_rate, math.sqrt(GRAVITY * vessel.length), unit_time(vessel)
    kappa = vessel.coriolis_ratio if vessel.coriolis_ratio >= 0.0 else min(vessel.surge_inertia / vessel.sway_inertia, 1.0)
    c, a1, a2, a3 = CURRENT * wave, LINEAR * a, QUADRATIC / vessel.length, TURNING
    return SwayPrior(a, kappa, (c * c, c * c, a1 * a1, a2 * a2, a3 * a3), LEAST * a * wave, 1.4 * vessel.length / T, 0.92 / T)


def first_sway(prior: SwayPrior) -> Array:
    """Before the first turn: p, and below it P, shape (6, 5)."""
    return np.vstack([[0.0, 0.0, prior.a, 0.0, 0.0], np.diag(prior.spread)])


@kernel
def decay_rate(p: list[float], v: float, r: float) -> float:
    """The decay rate A.

    Args:
        p: What is learned.
        v: Sway velocity through the water.
        r: Yaw rate.
    """
    return p[2] + p[3] * abs(v) + p[4] * abs(r)


@kernel
def turn_slope(sway: Array, v: float, r: float, prior: SwayPrior) -> float:
    """The change of v_r with u·r in steady turns: with A·v_r = -kappa·u·r, -kappa·(1 - a3·abs(r)/A)/(A + a2·abs(v_r)).

    Args:
        sway: What is learned, in its first row.
        v: Sway velocity through the water.
        r: Yaw rate.
        prior: What is known before.
    """
    p = sway[0].tolist()
    A = decay_rate(p, v, r)
    slope: float = -prior.kappa * (1.0 - p[4] * abs(r) / A) / (A + p[3] * abs(v))
    return slope


@kernel
def learn_sway(sway: Array, motion: Motion, v: float, dv: float, turned: float, prior: SwayPrior) -> None:
    """Learn from a period, in place.

    Args:
        sway: p in the first row, and below it P.
        motion: State of the ship.
        v, dv: Its sway velocity, at the pivot, and its sway acceleration, in its own turning axes.
        turned: Angle of turn of the period; 0 where it shows nothing.
        prior: What is known before.
    """
    if turned <= 0.0:
        return
    p, P = sway[0].tolist(), sway[1:].tolist()
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    c_h, c_n = p[0] * c + p[1] * s, -p[0] * s + p[1] * c
    v, r = clip(v - c_n, prior.v_max), clip(motion.r, prior.r_max)
    A = decay_rate(p, v, r)
    ahead, port = (1.0 - prior.kappa) * r, -(A + p[3] * abs(v))
    h = (ahead * c - port * s, ahead * s + port * c, v, abs(v) * v, abs(r) * v)
    size = RESIDUAL * max(abs(motion.u * r), prior.least)
    k = (product(P[0], h), product(P[1], h), product(P[2], h), product(P[3], h), product(P[4], h))
    variance = size * size / turned + product(k, h)
    deviation = math.sqrt(variance)
    e = clip(-(dv + r * c_h + prior.kappa * (motion.u - c_h) * r + A * v), OUTLIER * deviation) / variance
    kept_c, kept_a = 1.0 - FORGOTTEN_C * turned, 1.0 - FORGOTTEN_A * turned
    kept = (math.sqrt(kept_c), math.sqrt(kept_c), math.sqrt(kept_a), math.sqrt(kept_a), math.sqrt(kept_a))
    for i in range(5):
        sway[0, i] = p[i] + k[i] * e
        for j in range(5):
            sway[1 + i, j] = kept[i] * kept[j] * (P[i][j] - k[i] * k[j] / variance)
        sway[1 + i, i] += (1.0 - kept[i] * kept[i]) * prior.spread[i]
    # Damping that feeds the sway, or hardly any, has no steady turn.
    sway[0, 2] = max(sway[0, 2], MIN_DECAY * prior.a)
    sway[0, 3], sway[0, 4] = max(sway[0, 3], 0.0), max(sway[0, 4], 0.0)


@kernel
def product(x: Sequence[float], y: Five) -> float:
    """The product of two vectors of five elements."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2] + x[3] * y[3] + x[4] * y[4]

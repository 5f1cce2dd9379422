"""Conditions and bounds of the hierarchical law in closed form: docs/theory.md derives them.

| symbol | meaning | unit |
|---|---|---|
| D, K | decay rate of the sway velocity, sway acceleration per surge velocity and yaw rate: dv = -D·v - K·u·r | 1/s, - |
| lam | l/U, distance of the controlled point in terms of the speed; T_a where the vessel is not slow | s |
| k | sway acceleration per angle between the bow and an earth-fixed force | m/s² |
| s | bound of the length of (S2, S1) | m/s |

With S1 = S2 = 0 the position error across has these polynomials, all of whose roots are on the left where the ratios exceed 1:

    lam·p³ + (lam·D + 1 - K)·p² + (D + c·(1 - K))·p + c·D       on a straight line: `turning_ratio` and `routh_ratio`
    l0·p³ + l0·D·p² + k·p + k·c                                 at rest, the bow in wind or current: `rest_ratio`

The functions of a `Value` take intervals too, and then hold for every hull within them.
"""

import math
from typing import TypeVar

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains, HierarchicalParameters, gains
from vessel_hsmc_ros.core.interval import Interval

MARGIN, FURTHER = 1.05, 1.2
"""How much larger the error at rest may be under a varying sway force than under a constant one, and the growth with the drift in
terms of c·l0; measured, docs/theory.md."""

MAX_DRIFT = 0.6
"""The same drift beyond which the motion may not be a circle."""

PATIENCE = 100.0
"""Time after which what is left of an error at rest in calm water counts as its bound, in 1/c."""

Value = TypeVar("Value", float, Interval)


def turning_ratio(D: Value, K: Value, lam: float) -> Value:
    """(1 + lam·D)/K, above 1 where the course turns with the heading in the end; K above 0."""
    return (D * lam + 1.0) / K


def routh_ratio(g: Gains, D: Value, K: Value, lam: float) -> Value:
    """(lam·D + 1 - K)·(D + c·(1 - K))/(c·lam·D), with the product expanded, so that intervals stay narrow."""
    q = -K + 1.0
    square = q.squared() if isinstance(q, Interval) else q * q
    return D / g.c + q * (1.0 + 1.0 / (g.c * lam)) + square / (D * lam)


def rest_ratio(g: Gains, D: Value) -> Value:
    """D/c."""
    return D / g.c


def decay(g: Gains, d: float) -> float:
    """The rate f = 2·c/(1 + sqrt(1 + 2·c²·d/a)) at which an error of length d is to decay."""
    return 2.0 * g.c / (1.0 + math.sqrt(1.0 + 2.0 * g.c * g.c * d / g.a))


def ball(g: Gains, s: float) -> float:
    """The error at rest under any load: d = 2·l0 + s/f(d)."""
    d = 2.0 * g.l0
    for _ in range(200):  # s/f grows as the square root of d does, so this converges
        d = 2.0 * g.l0 + s / decay(g, d)
    return d


def circling(g: Gains, v: float) -> float:
    """The radius at which a vessel circles the target under a sway force fixed to the hull.

    It is near (l0²·v/c)^(1/3) for a slow drift.

    z2·(c·z2 + v)² = c·l0²·v,   r = -(c·z2 + v)/l0,   z1 = v/r

    `v`: sway velocity at which the hull drifts under the force, at least 0.
    """
    if v == 0.0:
        return 0.0
    low, high = 0.0, (g.l0 * g.l0 * v / g.c) ** (1.0 / 3.0)
    for _ in range(100):
        z2 = 0.5 * (low + high)
        low, high = (z2, high) if z2 * (g.c * z2 + v) ** 2 < g.c * g.l0 * g.l0 * v else (low, z2)
    return math.hypot(low, v * g.l0 / (g.c * low + v))


def circled(g: Gains, v: float, s: float) -> tuple[float, float]:
    """The largest error at rest under a sway force fixed to the hull that varies at will, and the time constant of that circle.

    docs/theory.md has the model, in which a constant force is the worst up to a margin. Surfaces of the size s act like a drift
    of 2·s. In calm water the error decays as the square root of the time: what is left after PATIENCE counts. Infinite beyond
    MAX_DRIFT.

    Args:
        g: Gains.
        v: Largest sway velocity at which the hull drifts under the force while it circles.
        s: Bound of the length of (S2, S1).
    """
    drive = max((v + 2.0 * s) / (g.c * g.l0), (2.0 * PATIENCE) ** -1.5)
    if drive > MAX_DRIFT:
        return math.inf, math.inf
    return (MARGIN + FURTHER * drive) * circling(g, drive * g.c * g.l0), 1.0 / (3.0 * g.c * drive ** (2.0 / 3.0))


def sway_warning(parameters: HierarchicalParameters, vessel: KnownVessel, period: float) -> str:
    """A sentence on a vessel whose declared sway makes the path error grow; empty for one that is kept or declares nothing.

    `parameters`: numbers of the law. Raises InstabilityError if the period is too long for the gains.
    """
    D, K = vessel.sway_damping_rate, vessel.coriolis_ratio
    if D < 0.0:
        return ""
    g, K = gains(parameters, vessel, period), K if K >= 0.0 else min(vessel.surge_inertia / vessel.sway_inertia, 1.0)
    ratio = min(routh_ratio(g, D, K, g.T_a), turning_ratio(D, K, g.T_a) if K else math.inf) if D else 0.0
    if ratio > 1.0:
        return ""
    return (
        f"the hierarchical law does not keep this vessel on its path: with controller.vessel.sway_damping_rate = {D:g} 1/s and"
        f" coriolis_ratio = {K:g} the Routh ratio of the path error must be above 1 (got {ratio:.2g}); guided suits it, or a"
        " smaller controller.hierarchical.approach_rate"
    )

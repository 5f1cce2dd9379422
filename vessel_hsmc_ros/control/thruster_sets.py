"""The forces that each thruster may give, as kernels: their sets, and the wrenches that they make.

A thruster gives the hull a force (p, q) out of a convex set: p along its own direction for a fixed one, ahead and to port
for an azimuth or a rudder. Surge force and yaw moment are linear in the forces,

    X = p·cos(angle)                          N = p·(x·sin(angle) - y·cos(angle))        of a fixed thruster
    X = p                                     N = x·q - y·p                              of an azimuth or a rudder

The set of an azimuth that turns all the way round is a disc; of one that does not, a sector ahead or, with reversed thrust, one
astern. A rudder gives q up to its largest lift, which grows with the thrust p ahead of its propeller, and with the speed.

| symbol | meaning |
|---|---|
| p, q | force of a thruster, N |
| l, l_2 | lift of a rudder, N·s²/m² |
| s | slipstream of a rudder's propeller, m²/(s²·N) |
| u | surge speed through the water, m/s |
"""

import math
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import between
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED

KIND, X, Y, ANGLE, COSINE, SINE, AHEAD, ASTERN, THRUST_RATE, ANGLE_LIMIT, ANGLE_RATE, LIFT, LIFT_QUADRATIC, SLIPSTREAM = range(14)
"""Columns of the constants of a thruster: its parameters, with cosine and sine of the direction of a fixed one, and of the angle
limit of others."""

THRUST, TURN, LOW, HIGH, MODE, P, Q, LEAST_FORCE, MOST_FORCE, SQUARES, BEST = (*range(8), 9, 11, 13)
"""Columns of the state of a thruster: the latest demands of thrust [N] and angle; limits of the thrust in this period, N; whether
an azimuth or a rudder has its thrust ahead (1), astern (-1) or keeps its force (0); its force p, q, N; and, each as p and q, the
forces with the least and with the largest surge force, those of least squares, and the best so far."""

COLUMNS = 15

Array = Any
"""A NumPy array of floats; its elements are read one by one, as floats."""


class Allocator(NamedTuple):
    """The constants of an allocation.

    Attributes:
        rows: The constants of the thrusters, (k, 14).
        lever: Largest distance of a thruster from the origin, m.
        steered: Number of azimuths and rudders.
        sectors: Number of those that do not turn all the way round.
    """

    rows: Array
    lever: float
    steered: int
    sectors: int


@kernel
def largest_lift(i: int, thrust: float, u: float, c: Allocator) -> float:
    """The largest lift of a rudder, N, at a thrust of its propeller, N, and a surge speed, m/s."""
    d = c.rows[i, ANGLE_LIMIT]
    lift: float = (c.rows[i, LIFT] - c.rows[i, LIFT_QUADRATIC] * d) * d * inflow(i, thrust, max_zero(u), c)
    return lift


@kernel
def inflow(i: int, thrust: float, u: float, c: Allocator) -> float:
    """The inflow of a rudder, |u|u + s·max(T, 0), m²/s²."""
    q: float = abs(u) * u + c.rows[i, SLIPSTREAM] * max_zero(thrust)
    return q


@kernel
def max_zero(value: float) -> float:
    """The value where it is positive, otherwise 0."""
    return value if value > 0.0 else 0.0


@kernel
def support(i: int, gx: float, gn: float, u: float, c: Allocator, s: Array) -> tuple[float, float]:
    """The force of a thruster, inside its limits, for which gx·X + gn·N is largest.

    Args:
        i: The thruster.
        gx, gn: Weights of surge force and yaw moment.
        u: Surge speed, m/s.
        c, s: Constants and state of the allocation.

    Returns:
        p, q, N.
    """
    hx, hy, sign = gx - gn * c.rows[i, Y], gn * c.rows[i, X], s[i, MODE]
    if c.rows[i, KIND] == FIXED:
        gain = hx * c.rows[i, COSINE] + hy * c.rows[i, SINE]
        if gain == 0.0:
            return between(0.0, s[i, LOW], s[i, HIGH]), 0.0
        return (s[i, HIGH] if gain > 0.0 else s[i, LOW]), 0.0
    if sign == 0.0:
        return s[i, P], s[i, Q]
    if c.rows[i, KIND] == AZIMUTH:
        return support_of_azimuth(i, hx, hy, sign * (c.rows[i, AHEAD] if sign > 0.0 else c.rows[i, ASTERN]), c)
    if sign > 0.0:  # more thrust also gives more lift
        per_thrust = largest_lift(i, 1.0, 0.0, c)
        thrust = c.rows[i, AHEAD] if hx + abs(hy) * per_thrust > 0.0 else 0.0
    else:
        thrust = -c.rows[i, ASTERN] if hx < 0.0 else 0.0
    return thrust, math.copysign(largest_lift(i, thrust, u, c), hy)


@kernel
def support_of_azimuth(i: int, hx: float, hy: float, thrust: float, c: Allocator) -> tuple[float, float]:
    """The force of an azimuth, of at most a thrust, N, for which hx·p + hy·q is largest; negative thrusts are astern."""
    along = hx if thrust > 0.0 else -hx
    size = math.sqrt(hx * hx + hy * hy)
    if c.rows[i, ANGLE_LIMIT] >= ALL_ROUND or abs(hy) * c.rows[i, COSINE] <= along * c.rows[i, SINE]:
        return (abs(thrust) * hx / size, abs(thrust) * hy / size) if size > 0.0 else (0.0, 0.0)
    # On the nearer edge of the sector, unless every force of it points the other way.
    if along * c.rows[i, COSINE] + abs(hy) * c.rows[i, SINE] <= 0.0:
        return 0.0, 0.0
    return thrust * c.rows[i, COSINE], math.copysign(thrust * c.rows[i, SINE], hy)


@kernel
def wrench_of(i: int, p: float, q: float, c: Allocator) -> tuple[float, float]:
    """Surge force [N] and yaw moment [N·m] of a thruster's force."""
    if c.rows[i, KIND] == FIXED:
        return p * c.rows[i, COSINE], p * (c.rows[i, X] * c.rows[i, SINE] - c.rows[i, Y] * c.rows[i, COSINE])
    return p, c.rows[i, X] * q - c.rows[i, Y] * p


@kernel
def column(i: int, j: int, u: float, c: Allocator) -> tuple[float, float, float]:
    """Surge force and yaw moment per unit of a thruster's force p (j = 0) or q (j = 1), and the square of its largest value."""
    if c.rows[i, KIND] == FIXED:
        gx, gn = wrench_of(i, 1.0, 0.0, c)
        return gx, gn, (c.rows[i, AHEAD] * c.rows[i, AHEAD] if j == 0 else 0.0)
    largest = c.rows[i, AHEAD] if j == 0 or c.rows[i, KIND] == AZIMUTH else largest_lift(i, c.rows[i, AHEAD], u, c)
    gx, gn = wrench_of(i, 1.0 - j, 1.0 * j, c)
    return gx, gn, largest * largest


@kernel
def is_inside(i: int, p: float, q: float, u: float, c: Allocator, s: Array) -> bool:
    """Whether a force is inside the limits of a thruster."""
    if c.rows[i, KIND] == FIXED:
        return bool(s[i, LOW] <= p <= s[i, HIGH])
    sign = s[i, MODE]
    if sign == 0.0:
        return True
    largest = c.rows[i, AHEAD] if sign > 0.0 else c.rows[i, ASTERN]
    if c.rows[i, KIND] == AZIMUTH:
        turned = c.rows[i, ANGLE_LIMIT] >= ALL_ROUND or abs(q) * c.rows[i, COSINE] <= sign * p * c.rows[i, SINE]
        return bool(turned and p * p + q * q <= largest * largest)
    return bool(0.0 <= sign * p <= largest and abs(q) <= largest_lift(i, p, u, c))

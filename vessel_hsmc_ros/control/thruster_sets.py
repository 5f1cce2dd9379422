"""The forces that each thruster may give, as kernels: their sets, and the wrenches that they make.

A thruster pushes the hull with a force (p, q) out of a convex set: p along its own direction for a fixed one, ahead and to port
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
from vessel_hsmc_ros.core.limits import between, clip
from vessel_hsmc_ros.core.thruster_layout import AZIMUTH, FIXED


class Allocator(NamedTuple):
    """The constants of an allocation: those of the layout, an element for each thruster.

    Attributes:
        kind: Index in KINDS.
        x, y: Position, m.
        angle: Direction of a fixed thruster.
        ahead, astern: Largest thrusts, N.
        thrust_rate: Largest rate of change of the thrust, N/s.
        angle_limit, angle_rate: Of an azimuth or a rudder, rad and rad/s.
        lift, lift_quadratic, slipstream: l, l_2 and s of a rudder.
        lever: Largest distance of a thruster from the origin, m.
        steered: Number of azimuths and rudders.
        sectors: Number of those that do not turn all the way round.
    """

    kind: Any
    x: Any
    y: Any
    angle: Any
    ahead: Any
    astern: Any
    thrust_rate: Any
    angle_limit: Any
    angle_rate: Any
    lift: Any
    lift_quadratic: Any
    slipstream: Any
    lever: float
    steered: int
    sectors: int


class AllocationState(NamedTuple):
    """Arrays with an element for each thruster, written in place.

    Attributes:
        thrust, angle: The latest demands, N and rad.
        low, high: Limits of the thrust of fixed thrusters in this period, N.
        mode: Of an azimuth or a rudder: 1 pushes ahead, -1 astern, 0 keeps its force.
        p, q: The forces, N.
        least, most: Forces with the least and the largest surge force, (2, k); `squares`: of least squares; `best`: of all modes.
    """

    thrust: Any
    angle: Any
    low: Any
    high: Any
    mode: Any
    p: Any
    q: Any
    least: Any
    most: Any
    squares: Any
    best: Any


@kernel
def largest_lift(i: int, thrust: float, u: float, c: Allocator) -> float:
    """The largest lift of a rudder, N, at a thrust of its propeller, N, and a surge speed, m/s."""
    d = c.angle_limit[i]
    return (c.lift[i] - c.lift_quadratic[i] * d) * d * inflow(i, thrust, max_zero(u), c)


@kernel
def inflow(i: int, thrust: float, u: float, c: Allocator) -> float:
    """The inflow of a rudder, |u|u + s·max(T, 0), m²/s²."""
    return abs(u) * u + c.slipstream[i] * max_zero(thrust)


@kernel
def max_zero(value: float) -> float:
    """The value where it is positive, otherwise 0."""
    return value if value > 0.0 else 0.0


@kernel
def support(i: int, gx: float, gn: float, u: float, c: Allocator, s: AllocationState) -> tuple[float, float]:
    """The force of a thruster, inside its limits, for which gx·X + gn·N is largest.

    Args:
        i: The thruster.
        gx, gn: Weights of surge force and yaw moment.
        u: Surge speed, m/s.
        c, s: Constants and state of the allocation.

    Returns:
        p, q, N.
    """
    hx, hy, sign = gx - gn * c.y[i], gn * c.x[i], s.mode[i]
    if c.kind[i] == FIXED:
        gain = hx * math.cos(c.angle[i]) + hy * math.sin(c.angle[i])
        if gain == 0.0:
            return between(0.0, s.low[i], s.high[i]), 0.0
        return (s.high[i] if gain > 0.0 else s.low[i]), 0.0
    if sign == 0.0:
        return s.p[i], s.q[i]
    if c.kind[i] == AZIMUTH:
        wanted = math.atan2(sign * hy, sign * hx)
        angle = clip(wanted, c.angle_limit[i])
        if math.cos(wanted - angle) <= 0.0:  # every force of the sector points the other way
            return 0.0, 0.0
        force = sign * (c.ahead[i] if sign > 0.0 else c.astern[i])
        return force * math.cos(angle), force * math.sin(angle)
    if sign > 0.0:  # more thrust also gives more lift
        per_thrust = largest_lift(i, 1.0, 0.0, c)
        thrust = c.ahead[i] if hx + abs(hy) * per_thrust > 0.0 else 0.0
    else:
        thrust = -c.astern[i] if hx < 0.0 else 0.0
    return thrust, math.copysign(largest_lift(i, thrust, u, c), hy)


@kernel
def wrench_of(i: int, p: float, q: float, c: Allocator) -> tuple[float, float]:
    """Surge force [N] and yaw moment [N·m] of a thruster's force."""
    if c.kind[i] == FIXED:
        ahead, port = math.cos(c.angle[i]), math.sin(c.angle[i])
        return p * ahead, p * (c.x[i] * port - c.y[i] * ahead)
    return p, c.x[i] * q - c.y[i] * p


@kernel
def column(i: int, j: int, u: float, c: Allocator) -> tuple[float, float, float]:
    """Surge force and yaw moment per unit of a thruster's force p (j = 0) or q (j = 1), and the square of its largest value."""
    if c.kind[i] == FIXED:
        gx, gn = wrench_of(i, 1.0, 0.0, c)
        return gx, gn, (c.ahead[i] * c.ahead[i] if j == 0 else 0.0)
    largest = c.ahead[i] if j == 0 or c.kind[i] == AZIMUTH else largest_lift(i, c.ahead[i], u, c)
    gx, gn = wrench_of(i, 1.0 - j, 1.0 * j, c)
    return gx, gn, largest * largest


@kernel
def is_inside(i: int, p: float, q: float, u: float, c: Allocator, s: AllocationState) -> bool:
    """Whether a force is inside the limits of a thruster."""
    if c.kind[i] == FIXED:
        return s.low[i] <= p <= s.high[i]
    sign = s.mode[i]
    if sign == 0.0:
        return True
    largest = c.ahead[i] if sign > 0.0 else c.astern[i]
    if c.kind[i] == AZIMUTH:
        limit = c.angle_limit[i]
        turned = limit >= math.pi or abs(q) * math.cos(limit) <= sign * p * math.sin(limit)
        return turned and p * p + q * q <= largest * largest
    return 0.0 <= sign * p <= largest and abs(q) <= largest_lift(i, p, u, c)

"""The forces of the thrusters whose wrench is the nearest to a demand: kernels of the thrust allocation.

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

The attainable wrenches are the sum of these convex sets in the plane of surge force X and yaw moment N. Of them the nearest to
the demand is taken, moment before force: first the attainable moment that is nearest to the demanded one, then, with that
moment, the nearest surge force. The sway force is free. The least and the largest surge force at a moment are where
-X cos(t) + N sin(t) and X cos(t) + N sin(t) are largest for some t: the moment grows with t, which is found by bisection.

Of the forces with this wrench those of least squares are taken, weighted with the largest forces; where these exceed a limit,
the nearest to them on the straight way from a mixture of the forces with the least and with the largest surge force.
"""

import math
from typing import Any, NamedTuple

from vessel_hsmc_ros.core.kernel import between, kernel
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED

KIND, X, Y, ANGLE, COSINE, SINE, AHEAD, ASTERN, THRUST_RATE, ANGLE_LIMIT, ANGLE_RATE, LIFT, LIFT_QUADRATIC, SLIPSTREAM = range(14)
"""Columns of the constants of a thruster: its parameters, with cosine and sine of the direction of a fixed one, and of the angle
limit of others."""

THRUST, TURN, LOW, HIGH, MODE, P, Q, LEAST_FORCE, MOST_FORCE, SQUARES, BEST = (*range(8), 9, 11, 13)
"""Columns of the state of a thruster: the latest demands of thrust [N] and angle; limits of the thrust in this period, N; whether
an azimuth or a rudder has its thrust ahead (1), astern (-1) or keeps its force (0); its force p, q, N; and, each as p and q, the
forces with the least and with the largest surge force, those of least squares, and the best so far."""

COLUMNS = 15

Array = Any  # a NumPy array of floats; its elements are read one by one, as floats


class Allocator(NamedTuple):
    """The constants of an allocation."""

    rows: Array  # the constants of the thrusters, (k, 14)
    lever: float  # largest distance of a thruster from the origin, m
    steered: int  # number of azimuths and rudders
    sectors: int  # number of those that do not turn all the way round


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

    `gx`, `gn`: weights of surge force and yaw moment. `u`: surge speed, m/s. Returns p, q, N.
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


BISECTIONS = 36  # halvings of an interval, to 5e-11 of an angle: closer ones differ by less than rounding errors


@kernel
def wrench_at(side: float, t: float, u: float, c: Allocator, s: Array, forces: int) -> tuple[float, float]:
    """Surge force and yaw moment where side·X cos(t) + N sin(t)/lever is largest, whose forces are written.

    `side`: 1 or -1. `t`: between -pi/2 and pi/2. `u`: surge speed, m/s. `forces`: column of their p, before that of q.
    """
    x = n = 0.0
    gx, gn = side * math.cos(t), math.sin(t) / c.lever
    for i in range(len(c.rows)):
        p, q = support(i, gx, gn, u, c, s)
        s[i, forces], s[i, forces + 1] = p, q
        force, moment = wrench_of(i, p, q, c)
        x, n = x + force, n + moment
    return x, n


@kernel
def extreme(side: float, moment: float, u: float, c: Allocator, s: Array, forces: int) -> float:
    """The largest side·X with an attainable yaw moment; its forces are written.

    `side`: 1 or -1. `moment`: N·m. `forces`: column of their p, before that of q. Returns the surge force, N.
    """
    low, high = -0.5 * math.pi, 0.5 * math.pi
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if wrench_at(side, middle, u, c, s, forces)[1] <= moment:
            low = middle
        else:
            high = middle
    x_low, n_low = wrench_at(side, low, u, c, s, SQUARES)
    x_high, n_high = wrench_at(side, high, u, c, s, forces)
    # Where the largest value changes from one force to another the moment jumps; between both, the forces are on a straight line.
    share = between((moment - n_low) / (n_high - n_low), 0.0, 1.0) if n_high > n_low else 0.0
    for i in range(len(c.rows)):
        for j in range(2):
            s[i, forces + j] = s[i, SQUARES + j] + share * (s[i, forces + j] - s[i, SQUARES + j])
    return x_low + share * (x_high - x_low)


@kernel
def share_between_two(surge_force: float, yaw_moment: float, c: Allocator, s: Array) -> None:
    """`share_forces` of two fixed thrusters in closed form: their thrusts are on the line of one moment.

    With X = c_1·p_1 + c_2·p_2 and N = n_1·p_1 + n_2·p_2, they move along it by t·(n_2, -n_1), which changes X alone.
    """
    c1, n1 = wrench_of(0, 1.0, 0.0, c)
    c2, n2 = wrench_of(1, 1.0, 0.0, c)
    l1, l2, h1, h2 = s[0, LOW], s[1, LOW], s[0, HIGH], s[1, HIGH]
    lowest = (n1 * l1 if n1 > 0.0 else n1 * h1) + (n2 * l2 if n2 > 0.0 else n2 * h2)
    highest = (n1 * h1 if n1 > 0.0 else n1 * l1) + (n2 * h2 if n2 > 0.0 else n2 * l2)
    n = between(yaw_moment, lowest, highest)
    determinant = c1 * n2 - c2 * n1
    p1, p2 = (n2 * surge_force - c2 * n) / determinant, (c1 * n - n1 * surge_force) / determinant
    low, high = way_inside(p1, n2, l1, h1, -math.inf, math.inf)
    low, high = way_inside(p2, -n1, l2, h2, low, high)
    t = between(0.0, low, high)
    s[0, P], s[1, P] = between(p1 + t * n2, l1, h1), between(p2 - t * n1, l2, h2)


@kernel
def way_inside(start: float, slope: float, low: float, high: float, first: float, last: float) -> tuple[float, float]:
    """The part of the interval from first to last on which start + t·slope is between low and high."""
    if slope == 0.0:
        return first, last
    one, other = (low - start) / slope, (high - start) / slope
    if slope < 0.0:
        one, other = other, one
    return (one if one > first else first), (other if other < last else last)


@kernel
def share_forces(surge_force: float, yaw_moment: float, u: float, c: Allocator, s: Array) -> bool:
    """Write the forces p, q whose wrench is the nearest to a demand, moment before force.

    `surge_force`, `yaw_moment`: the demand, N and N·m. Returns whether they are those of least squares that give the demand.
    """
    if least_squares(surge_force, yaw_moment, u, c, s) and are_inside(u, c, s):
        for i in range(len(c.rows)):
            s[i, P], s[i, Q] = s[i, SQUARES], s[i, SQUARES + 1]
        return True
    right_angle = 0.5 * math.pi
    lowest, highest = wrench_at(1.0, -right_angle, u, c, s, MOST_FORCE)[1], wrench_at(1.0, right_angle, u, c, s, MOST_FORCE)[1]
    n = between(yaw_moment, lowest, highest)
    x_least, x_most = extreme(-1.0, n, u, c, s, LEAST_FORCE), extreme(1.0, n, u, c, s, MOST_FORCE)
    x = between(surge_force, x_least, x_most)
    share = (x - x_least) / (x_most - x_least) if x_most > x_least else 0.0
    for i in range(len(c.rows)):
        for j in range(2):
            s[i, P + j] = s[i, LEAST_FORCE + j] + share * (s[i, MOST_FORCE + j] - s[i, LEAST_FORCE + j])
    if least_squares(x, n, u, c, s):
        part = 1.0
        for i in range(len(c.rows)):
            part = share_inside(i, part, u, c, s)
        for i in range(len(c.rows)):
            s[i, P], s[i, Q] = s[i, P] + part * (s[i, SQUARES] - s[i, P]), s[i, Q] + part * (s[i, SQUARES + 1] - s[i, Q])
    return False


@kernel
def are_inside(u: float, c: Allocator, s: Array) -> bool:
    """Whether the forces of least squares are inside the limits; the surge speed in m/s."""
    inside = True
    for i in range(len(c.rows)):
        inside = inside and is_inside(i, s[i, SQUARES], s[i, SQUARES + 1], u, c, s)
    return inside


@kernel
def least_squares(x: float, n: float, u: float, c: Allocator, s: Array) -> bool:
    """Write the forces of least squares, weighted with the largest forces, that give a wrench; False where none do.

    `x`, `n`: surge force, N, and yaw moment, N·m. `u`: surge speed, m/s.
    """
    xx = xn = nn = 0.0
    for i in range(len(c.rows)):
        if c.rows[i, KIND] != FIXED and s[i, MODE] == 0.0:
            force, moment = wrench_of(i, s[i, P], s[i, Q], c)
            x, n = x - force, n - moment
            continue
        for j in range(1 if c.rows[i, KIND] == FIXED else 2):
            gx, gn, w = column(i, j, u, c)
            xx, xn, nn = xx + w * gx * gx, xn + w * gx * gn, nn + w * gn * gn
    determinant = xx * nn - xn * xn
    if determinant <= 1e-12 * xx * nn:
        return False
    a, b = (nn * x - xn * n) / determinant, (xx * n - xn * x) / determinant
    for i in range(len(c.rows)):
        s[i, SQUARES], s[i, SQUARES + 1] = s[i, P], s[i, Q]
        if c.rows[i, KIND] == FIXED or s[i, MODE] != 0.0:
            for j in range(2):
                gx, gn, w = column(i, j, u, c)
                s[i, SQUARES + j] = w * (gx * a + gn * b)
    return True


@kernel
def share_inside(i: int, part: float, u: float, c: Allocator, s: Array) -> float:
    """How far the force of a thruster may go from p, q, inside its limits, towards that of least squares, at most `part`."""
    dp, dq = s[i, SQUARES] - s[i, P], s[i, SQUARES + 1] - s[i, Q]
    if is_inside(i, s[i, P] + part * dp, s[i, Q] + part * dq, u, c, s):
        return part
    low, high = 0.0, part
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if is_inside(i, s[i, P] + middle * dp, s[i, Q] + middle * dq, u, c, s):
            low = middle
        else:
            high = middle
    return low

"""Guidance of the guided law: the course, turn and surge velocity through the water that bring the ship to its reference.

| symbol | meaning | unit |
|---|---|---|
| p, p_d, e | positions of ship and reference, p - p_d | L |
| w_d, w_t | velocity of the reference over ground, and the velocity that the ship is to have along its hull | L/T |
| c | estimated current | L/T |
| W, chi | speed and course through the water of the track | L/T, rad |
| e_c | distance of the ship to port of the track | L |
| k | approach speed per distance: k_p near, bounded at rest; the braking curve of a deceleration a_p far away | 1/T |
| b | share of the error by which the course itself is turned towards the reference, 0 near the track | - |
| xi | integrals of the error along and across the reference, and over the earth | L/T |
| beta, v_s | drift angle and sway velocity that go with the turn | rad, L/T |
| psi_s, r_s | heading and yaw rate of the track, chi - beta | rad, 1/T |

Its turn is that of this velocity, with the velocity that the ship has: so the course loses no time on the way to a reference that
turns, which it would otherwise follow indefinitely on a smaller circle.

Through the water the track has the velocity w_d - xi - c - b·k·e. Near a reference that moves through the water, b = 0:
course and turn are those of the reference, and the regulator closes the distance e_c. Far from it, or where a reference at rest
stands in still water, b = 1: the course is that to the reference. A ship at rest in a current is a ship under way.

The extended Kalman filter of the guided law: what the ship does, what acts on it, and the water that carries it.

| symbol | meaning | unit |
|---|---|---|
| u, v, r | surge velocity, sway velocity of the pivot, yaw rate, over ground | L/T, L/T, 1/T |
| f_u, f_v, f_r | accelerations by all that is not modelled: damping, wind, waves, errors of the inertia | L/T², L/T², 1/T² |
| a, kappa | decay rate of the sway; sway acceleration per surge velocity and yaw rate | 1/T, - |
| x_d | distance of the centre of lateral damping behind the pivot | L |
| b | decay rate of the surge velocity through the water | 1/T |
| c_E, c_N | current, constant over the earth; what wind does as if it were one | L/T |
| u_r, v_r | velocities through the water, (u, v) - R(psi)ᵀ·c | L/T |
| c_h, c_n | the current along and across the hull | L/T |
| a_1, a_2 | accelerations by surge force and yaw moment, as the actuators apply them | L/T², 1/T² |
| m | m22/m11 as declared, 1/kappa | - |
| R, Q, P | variances of the measurements, of the noise per time, and of the states | |
| h | control period | T |

    du = r·c_n + m·v_r·r - b·u_r + f_u + a_1             df = noise
    dv = -r·c_h - kappa·u_r·r - a·(v_r - x_d·r) + f_v    d(ln a), dkappa, db, dc = -w_0·(deviation from the expected) + noise
    dr = f_r + a_2                                       measured: u, v, r

The pivot is the point whose sway the yaw moment does not accelerate. The current stands in the earth-fixed frame, so that what
one leg has taught holds on the next. Its covariance is the doubt: what a straight leg does not show stays as it was expected.
Innovations beyond four standard deviations count as four.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.actuators import Channel
from vessel_hsmc_ros.core.kernel import Array, add, add_outer, between, clip, kernel, multiply
from vessel_hsmc_ros.core.kinematics import TURN, Acceleration, Motion, magnitude, to_body

U, V, R, FU, FV, FR, LN_A, KAPPA, B, CE, CN = range(11)  # indices of the states
STATES = 11
GATE = 4.0  # standard deviations at which an innovation is cut
FOLLOWING, NOISIEST = 2.0, 1e4
"""Time in T in which the variances of the measurements follow the innovations, and their largest multiple of the least."""

LN_A_RANGE, KAPPA_RANGE, B_RANGE = (-3.5, 2.8), (-0.5, 1.6), (0.0, 2.0)  # ranges of ln a, kappa and b


class Gains(NamedTuple):
    """The constants of the law; all but L, T, force and moment in its units."""

    # L, T: the units, m and s
    L: float
    T: float
    # force, moment: the units of force and moment, N and N·m
    force: float
    moment: float
    h: float  # control period
    # x_p, x_d, U_s: distances of the pivot ahead of the point that is controlled at rest, and of the centre of lateral damping
    # behind the pivot; speed at which half of it is controlled
    x_p: float
    x_d: float
    U_s: float
    # k_p, v_max, a_p, k_i, k_u, theta: of the guidance, with q
    k_p: float
    v_max: float
    a_p: float
    k_i: float
    k_u: float
    theta: float
    # a_max, r_max, a_r: of the braking curves of heading and yaw rate
    a_max: float
    r_max: float
    a_r: float
    q: float  # stretch of the regulator's unit of time
    m: float  # m22/m11
    # R_u, R_r: variances of a measured velocity and yaw rate
    R_u: float
    R_r: float
    # Q, P_0, x_0: growth of the variances per time, variances and states at the start, shape (11,)
    Q: Array
    P_0: Array
    x_0: Array
    w_0: float  # rate of return to x_0
    # z_p, z_h: poles of the correction of position and heading
    z_p: float
    z_h: float
    step_f: float  # step of the filter of the turns that are fed forward
    # surge, yaw: the actuators
    surge: Channel
    yaw: Channel
    table: Array  # gains of the regulator


@kernel
def measure(x: Array, P: Array, i: int, y: float, variance: float, S: Array) -> None:
    """Correct the states by a measurement of state i, in place: with s = P[i]/sqrt(P[i, i] + R), P <- P - s·sᵀ.

    `x`, `P`: states, shape (11,), and their covariance, shape (11, 11). `S`: working memory, shape (20, 15), of which row 8 and
    the rows from the tenth on are used.
    """
    root = math.sqrt(max(float(P[i, i]), 0.0) + variance)
    e = clip(y - float(x[i]), GATE * root) / root
    s, column = S[8, :STATES], S[9:20, STATES : STATES + 1]
    multiply(P[i], 1.0 / root, s)
    values = s.tolist()
    for j in range(STATES):
        x[j] += values[j] * e
        column[j, 0] = -values[j]
    add_outer(column, s, P, S[9:20, :STATES])


@kernel
def correct(x: Array, P: Array, noise: Array, y: tuple[float, float, float], S: Array, g: Gains) -> None:
    """Correct the states by the measured velocities, in place, and keep a, kappa and b within their ranges.

    `noise`: variances of a measured velocity and yaw rate, R, shape (2,), which follow the innovations. `y`: measured u, v, r.
    """
    step = g.h / FOLLOWING
    for i in range(3):
        k = 0 if i < R else 1
        most = 100.0 * (float(P[i, i]) + float(noise[k]))
        found = min((y[i] - float(x[i])) * (y[i] - float(x[i])), most) - float(P[i, i])
        noise[k] += (0.5 if i < R else 1.0) * step * (found - float(noise[k]))
        least = g.R_r if k else g.R_u
        noise[k] = between(float(noise[k]), least, NOISIEST * least)
        measure(x, P, i, y[i], float(noise[k]), S)
    x[LN_A] = between(float(x[LN_A]), LN_A_RANGE[0], LN_A_RANGE[1])
    x[KAPPA] = between(float(x[KAPPA]), KAPPA_RANGE[0], KAPPA_RANGE[1])
    x[B] = between(float(x[B]), B_RANGE[0], B_RANGE[1])


@kernel
def unforced(u: float, v: float, r: float, psi: float, x: Array, g: Gains) -> tuple[float, float, float]:
    """The accelerations without a wrench at any velocities of the pivot and heading, by the filter's present model."""
    c_h, c_n = to_body(float(x[CE]), float(x[CN]), psi)
    u_r, v_r = u - c_h, v - c_n
    return (
        float(x[FU]) + r * c_n + g.m * v_r * r - float(x[B]) * u_r,
        float(x[FV]) - float(x[KAPPA]) * u_r * r - r * c_h - math.exp(float(x[LN_A])) * (v_r - g.x_d * r),
        float(x[FR]),
    )


@kernel
def predict(x: Array, P: Array, psi: float, a_1: float, a_2: float, S: Array, g: Gains) -> None:
    """States and covariance one period later, in place; the sway decays exactly, all else by an Euler step.

    `S`: working memory, shape (20, 15).
    """
    h, u, v, r, kappa, b = g.h, float(x[U]), float(x[V]), float(x[R]), float(x[KAPPA]), float(x[B])
    c, s = math.cos(psi), math.sin(psi)
    c_h, c_n = to_body(float(x[CE]), float(x[CN]), psi)
    u_r, v_r, a = u - c_h, v - c_n, math.exp(float(x[LN_A]))
    fall = 1.0 - math.exp(-a * h)
    step = fall / a
    J = S[4]
    J[0], J[1], J[2], J[3], J[4] = -h * b, h * g.m * r, h * (c_n + g.m * v_r), -h * u_r, h
    J[5], J[6] = h * (r * s * (g.m - 1.0) + b * c), h * (r * c * (1.0 - g.m) + b * s)
    v_d = v_r - g.x_d * r
    J[7], J[8], J[9] = -step * kappa * r, -fall, -step * (kappa * u_r + c_h) + fall * g.x_d
    J[10], J[11] = -fall * v_d, -step * u_r * r
    J[12], J[13] = step * (kappa - 1.0) * r * c - fall * s, step * (kappa - 1.0) * r * s + fall * c
    J[14] = step
    propagate(P, S)
    multiply(P[LN_A:], 1.0 - g.w_0 * h, P[LN_A:])
    multiply(P[:, LN_A:], 1.0 - g.w_0 * h, P[:, LN_A:])
    for i in range(STATES):
        P[i, i] += g.Q[i] * h
    for i in range(LN_A, STATES):
        x[i] -= g.w_0 * h * (x[i] - g.x_0[i])
    x[U] = u + h * (float(x[FU]) + r * c_n + g.m * v_r * r - b * u_r + a_1)
    x[V] = v + step * (float(x[FV]) - kappa * u_r * r - r * c_h) - fall * v_d
    x[R] = r + h * (float(x[FR]) + a_2)


@kernel
def propagate(P: Array, S: Array) -> None:
    """P <- F·P·Fᵀ in place with F = I + G, of which only the rows of u, v and r are not zero: P + G·P + (G·P)ᵀ + G·(G·P)ᵀ.

    `S`: working memory with the elements of G in its fifth row; rows 1 to 3 and 6 to 8 are used.
    """
    rows, corner = S[0:3, :STATES], S[5:8, :3]
    for k in range(STATES):
        _times(P[k], S[4], rows, k)  # the columns of a symmetric matrix are its rows
    for k in range(3):
        _times(rows[k], S[4], corner, k)
    add(P[:3], rows, P[:3])
    add(P[:, :3], rows.T, P[:, :3])
    add(P[:3, :3], corner, P[:3, :3])
    # A rounding error that is not symmetric would not be corrected by any measurement, and grow.
    P[0, 1], P[0, 2], P[1, 2] = P[1, 0], P[2, 0], P[2, 1]


@kernel
def _times(column: Array, elements: Array, rows: Array, k: int) -> None:
    """G times a column, as column k of three rows."""
    c, J = column.tolist(), elements.tolist()
    by_surge = J[0] * c[U] + J[1] * c[V] + J[2] * c[R] + J[3] * c[B] + J[4] * c[FU]
    rows[0, k] = by_surge + J[5] * c[CE] + J[6] * c[CN]
    by_sway = J[7] * c[U] + J[8] * c[V] + J[9] * c[R] + J[10] * c[LN_A] + J[11] * c[KAPPA]
    rows[1, k] = by_sway + J[12] * c[CE] + J[13] * c[CN] + J[14] * c[FV]
    rows[2, k] = J[4] * c[FR]


NEAR = 0.5  # distance in L within which a track is followed rather than its reference pursued
STILL = 0.06  # speed of the reference through the water, L/T, at which that distance is half as large
ASTERN = 0.004
"""Speed astern, L/T, from which a reference that moves astern over ground and through the water is followed astern."""

SLOWEST = 0.011
"""Least speed of the track through the water, L/T: the rest is along the hull, so that a ship at rest keeps its heading."""

TURNING = 0.05  # yaw rate of a reference at rest, 1/T, at which half of the way to its heading is followed
LARGEST_TURN = 2.0  # largest turn that is fed forward, 1/T
INTEGRAL = 0.03, 0.1
"""Largest integral of the error, L/T, and distance within which it is integrated along and across the reference, L."""

ACROSS = 0.14  # integral gain across the track at most, in terms of the square of the rate at which the regulator approaches it
OVER_EARTH = 1.4, 0.03
"""Integral gain over the earth in terms of that across the track, and distance at which half of it holds, L."""

LEAN = 0.1  # shortest time constant, in terms of 1/a, in which the drift takes part in a turn
AT_REST = 0.35
"""Largest rate of the approach to a point at rest, in terms of a/kappa: a ship that comes faster than its drift decays ends up
circling it."""

STEEPEST = 0.8  # sine of the largest drift angle
STATION_SPEED = 0.12  # velocity command, L/T, at which a ship whose pivot is ahead is half under way and half keeps station
LEVER = 0.02  # lever arm of station keeping in still water, L
SHORT = 0.075  # distance of the pivot ahead of the origin, L, from which station keeping reckons with it


class Integrals(NamedTuple):
    """Integrals of the position error: along and across the reference, and along x and y of the earth-fixed frame."""

    along: float
    across: float
    x: float
    y: float


class Track(NamedTuple):
    """Speed, course and turn of the track, and what the ship has to do along its hull."""

    # W, chi: speed and course through the water
    W: float
    chi: float
    # growth, dchi: their rates of change, dW and dchi
    growth: float
    dchi: float
    way: float  # 1 where the track is to be sailed ahead, -1 astern
    e_c: float  # distance to port of the course of the track
    # w_t, w_n: velocity over ground along and across the hull
    w_t: float
    w_n: float
    dw_t: float  # rate of change of w_t in the axes of the hull
    xi: Integrals  # the integrals one period later


@kernel
def to_earth(x: float, y: float, psi: float) -> tuple[float, float]:
    """A vector along and across a hull of heading psi, along x and y of the earth-fixed frame."""
    return to_body(x, y, -psi)


@kernel
def braked(epsilon: float, c: float, a: float, largest: float) -> float:
    """A rate for an error of what it changes: c·epsilon when small, sqrt(2·a·|epsilon|) when large, at most the largest.

    The square root is the braking curve of a constant deceleration a, which may be infinite: the positive root of
    rate²/(2·a) + rate/c = |epsilon| joins both limits smoothly.
    """
    rate = 2.0 * c * abs(epsilon) / (1.0 + math.sqrt(1.0 + 2.0 * c * c * abs(epsilon) / a))
    return math.copysign(min(rate, largest), epsilon)


@kernel
def track(
    ship: Motion,
    goal: Motion,
    acceleration: Acceleration,
    c_E: float,
    c_N: float,
    xi: Integrals,
    slope: float,
    settling: float,
    g: Gains,
) -> Track:
    """The track of a ship.

    `ship`: the motion of its controlled point, over ground. `goal`, `acceleration`: the reference, and the derivatives of its
    body velocities. `slope`: angle by which the regulator approaches the track per distance from it, K_e/K_psi, rad/L.
    `settling`: rate at which the drift of its turns decays, a/kappa.
    """
    e_x, e_y = ship.x - goal.x, ship.y - goal.y
    distance = magnitude(e_x, e_y)
    vx, vy = to_earth(goal.u - xi.along, goal.v - xi.across, goal.psi)
    vx, vy = vx - xi.x, vy - xi.y
    ax, ay = to_earth(acceleration.du - goal.r * goal.v, acceleration.dv + goal.r * goal.u, goal.psi)
    Wx, Wy = vx - c_E, vy - c_N
    square = Wx * Wx + Wy * Wy
    moving = square / (square + STILL * STILL)
    far = max(0.0, 1.0 - moving * NEAR / max(distance, 1e-9))
    at_rest = min(g.k_p, AT_REST * settling)
    k = braked(distance, at_rest + moving * (g.k_p - at_rest), g.a_p, g.v_max) / max(distance, 1e-9)
    Bx, By = Wx - k * far * e_x, Wy - k * far * e_y
    along = Wx * math.cos(goal.psi) + Wy * math.sin(goal.psi)
    way = -1.0 if max(goal.u, along) < -ASTERN and far < 0.5 else 1.0
    missing = way * max(0.0, SLOWEST - magnitude(Bx, By))
    # The ship follows a reference that turns on the spot, and else keeps the heading at which it rests.
    turning = goal.r * goal.r / (goal.r * goal.r + TURNING * TURNING)
    heading = ship.psi + turning * math.remainder(goal.psi - ship.psi, TURN)
    Bx, By = Bx + missing * math.cos(heading), By + missing * math.sin(heading)
    W, chi = max(magnitude(Bx, By), 1e-3), math.atan2(By, Bx)
    ux, uy = to_earth(ship.u, ship.v, ship.psi)
    dBx, dBy, of_B = ax - k * far * (ux - vx), ay - k * far * (uy - vy), Bx * Bx + By * By
    dchi = square / (square + 1e-4) * clip((Bx * dBy - By * dBx) / max(of_B, 1e-4), LARGEST_TURN)
    growth = (1.0 - far) * square / (square + 1e-4) * clip((Wx * ax + Wy * ay) / W, LARGEST_TURN)
    e_c = (1.0 - far) * to_body(e_x, e_y, chi)[1]
    # The velocity along the hull closes the whole error; a point at rest abeam has to come ahead of the hull first.
    v_t, v_n = to_body(vx, vy, ship.psi)
    e_t, e_n = to_body(e_x, e_y, ship.psi)
    k_t = k * (1.0 - (1.0 - moving) * e_n * e_n / max(distance * distance, 1e-18))
    w_t, w_n = v_t - k_t * e_t, v_n - k * e_n
    dw_t = to_body(ax - k_t * (ux - vx), ay - k_t * (uy - vy), ship.psi)[0] + ship.r * w_n
    # A regulator that is slow across the track needs slow integrals.
    rate = W * slope
    across = min(g.k_i, ACROSS * rate * rate)
    xi = integrated(xi, e_x, e_y, goal.psi, moving * g.k_i, moving * across, turning, g)
    return Track(W, chi, growth, dchi, way, e_c, w_t, w_n, dw_t, xi)


@kernel
def integrated(
    xi: Integrals, e_x: float, e_y: float, psi: float, along: float, across: float, turning: float, g: Gains
) -> Integrals:
    """The integrals one period later.

    In a turn, what is constant over the earth, such as an error of the current, turns through the axes of the reference, where
    an integral cannot follow it: so there is one over the earth as well. On a straight track both would be the same, so it
    rests there, and what no turn shows returns to zero at the rate w_0. Far away no integral grows, but each is unloaded: one
    that stood still there would always keep the ship away. `turning`: share in which the reference turns, from 0 to 1.
    """
    square = e_x * e_x + e_y * e_y
    near = square / (OVER_EARTH[1] * OVER_EARTH[1])
    step, kept, most = g.h * OVER_EARTH[0] * across * turning / (1.0 + near * near), 1.0 - g.w_0 * g.h, INTEGRAL[0]
    x, y = clip(kept * xi.x + step * e_x, most), clip(kept * xi.y + step * e_y, most)
    e_1, e_2 = to_body(e_x, e_y, psi)
    far = square > INTEGRAL[1] * INTEGRAL[1]
    d_1 = 0.0 if far and e_1 * xi.along > 0.0 else g.h * along * e_1
    d_2 = 0.0 if far and e_2 * xi.across > 0.0 else g.h * across * e_2
    return Integrals(clip(xi.along + d_1, most), clip(xi.across + d_2, most), x, y)


@kernel
def drift_in_turn(beta: float, t: Track, a: float, kappa: float, f_v: float, h: float) -> tuple[float, float]:
    """The drift angle one period later that goes with the turn of the track, and its rate of change.

    With u = W·cos(beta), v = W·sin(beta) and r = dchi - dbeta, dv = -kappa·u·r - a·v + f_v becomes

        (1 - kappa)·cos(beta)·dbeta = f_v/W - kappa·cos(beta)·dchi - (a + dW/W)·sin(beta)

    Astern, the water passes the hull the other way round, and f_v counts with the other sign. Where kappa is near 1 or above, the
    drift would have to begin before the turn: it takes part almost at once.
    """
    decay, along = max(a + t.growth / t.W, 0.5 * a), math.cos(beta)
    goal = clip((t.way * f_v / t.W - kappa * along * t.dchi) / decay, STEEPEST)
    change = -math.expm1(-decay * h / max(1.0 - kappa, LEAN)) * (goal - math.sin(beta)) / along
    return beta + change, change / h


@kernel
def on_the_spot(t: Track, v_p: float, a: float, lever: float, x: Array, g: Gains) -> tuple[float, float]:
    """How far a ship whose pivot is ahead keeps station, from 0 to 1, and the yaw rate at which it does.

    The moment moves the controlled point sideways, opposite to the turn. So the ship turns to the side to which it drifts: r =
    (v_p - w_n)/(x + rho) moves the point rho behind it across the hull at w_n, and the stern comes into wind and current.
    There, rho > kappa·|c|/a keeps it from oscillating, because m11·u·r carries it to the other side first. `v_p`: sway
    velocity of the pivot, over ground. `a`: decay rate of the sway. `lever`: distance x of the pivot ahead of the controlled
    point.
    """
    square = (t.w_t * t.w_t + t.w_n * t.w_n) / (STATION_SPEED * STATION_SPEED)
    short = SHORT * SHORT / (g.x_p * g.x_p)
    share = lever / g.x_p / ((1.0 + square * square) * (1.0 + short * short * short * short))
    rho = LEVER + float(x[KAPPA]) / a * magnitude(float(x[CE]), float(x[CN]))
    return share, clip((v_p - t.w_n) / (lever + rho), g.r_max)

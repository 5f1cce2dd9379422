"""The extended Kalman filter of the guided law: what the ship does, what acts on it, and the water that carries it.

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

from vessel_hsmc_ros.control.guided.parameters import Gains
from vessel_hsmc_ros.core.arrays import Array, add, add_outer, multiply
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import to_body
from vessel_hsmc_ros.core.limits import between, clip

U, V, R, FU, FV, FR, LN_A, KAPPA, B, CE, CN = range(11)  # indices of the states
STATES = 11

GATE = 4.0  # standard deviations at which an innovation is cut
FOLLOWING, NOISIEST = 2.0, 1e4
"""Time in T in which the variances of the measurements follow the innovations, and their largest multiple of the least."""

LN_A_RANGE, KAPPA_RANGE, B_RANGE = (-3.5, 2.8), (-0.5, 1.6), (0.0, 2.0)  # ranges of ln a, kappa and b


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

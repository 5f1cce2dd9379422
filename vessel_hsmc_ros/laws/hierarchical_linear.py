"""The hierarchical law about a steady motion of a hull: poles, tolerated dead time, and errors under noise, gusts and current.

| symbol | meaning | unit |
|---|---|---|
| x | deviation from the steady motion, in the axes of the reference | |
| A, B | dx = A·x + B·(errors of measurements, earth-fixed force, current, hull-fixed wrench) | |
| P, Q | covariance of x and intensity of the noise, A·P + P·A' + Q = 0 | |
| L(j·omega) | loop broken at a command, with the other one closed | - |

The law is differentiated as it stands, with its networks (one integrator each, since |H| is constant with the paper's centres),
predictions and current estimate, and the hull with first-order lags of its actuators and gusts. Limits, sampling and the
identification of the actuators are not in it. docs/theory.md says what that covers.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, to_body
from vessel_hsmc_ros.law.network import Estimates
from vessel_hsmc_ros.laws.hierarchical import control
from vessel_hsmc_ros.laws.hierarchical_guidance import guidance, learned_current, turn_in_current
from vessel_hsmc_ros.laws.hierarchical_parameters import Gains

Hull = Callable[[Motion, tuple[float, float, float], tuple[float, float]], tuple[float, float, float]]
"""The accelerations of u, v and r at the controlled point: of a motion, under surge force, sway force and yaw moment, in a
current in the hull's axes."""

SIGMAS = 4.5
"""How many standard deviations of the position error count as its bound."""

DX, DY, PSI, U_, V_, R_, U_P, V_P, R_P, F_U, F_V, F_R, TAU_1, TAU_2, GUST_1, GUST_2, C_1, C_2, LASTING = range(19)
"""The states: position, heading, velocities, predictions, networks, actuators, gusts, estimated current."""

HEADINGS = 36
"""Number of intervals in which a heading is looked for in which a vessel at rest stays."""

FREQUENCIES = 100
"""Number of frequencies at which a loop is looked at."""

STEP = 1e-5
"""Of the differences, in units of each state."""


class Mean(NamedTuple):
    """Mean loads along and across the reference: earth-fixed force, with its lever, and current."""

    force: tuple[float, float] = (0.0, 0.0)
    lever: float = 0.0
    current: tuple[float, float] = (0.0, 0.0)


class Steady(NamedTuple):
    """A steady motion about which the law is linearised.

    Attributes:
        speed, turn: Speed over ground and yaw rate of the reference.
        motion: Of the vessel; the reference is at the origin with heading 0.
        mean: Loads.
        wrench: Surge force and yaw moment that it takes.
    """

    speed: float
    turn: float
    motion: Motion
    mean: Mean
    wrench: tuple[float, float]


class Linear(NamedTuple):
    """A and the columns of B: errors of x, y, psi, u, v, r, (19, 6), force and current, (19, 2), hull-fixed wrench, (19, 3)."""

    A: Array
    noise: Array
    force: Array
    current: Array
    wrench: Array


class Loads(NamedTuple):
    """What disturbs a vessel.

    Attributes:
        noise: Standard deviations of x, y, psi, u, v, r times the square root of the time between two samples.
        gust, gust_time: Standard deviation of the gusts, N, and their correlation time.
        force, current: Mean earth-fixed force, N, and current, m/s.
        between: Angle from the direction of the force to that of the current.
        wrench, frequency: Amplitudes of the periodic hull-fixed wrench, and its frequency.
    """

    noise: tuple[float, ...]
    gust: float
    gust_time: float
    force: float
    current: float
    between: float
    wrench: tuple[float, float, float]
    frequency: float


def steady(hull: Hull, speed: float, turn: float, mean: Mean) -> Steady:
    """The steady motion of a hull along a straight line or circle; its drift angle by the secant method.

    Args:
        hull: Accelerations.
        speed, turn: Of the reference.
        mean: Loads.
    """

    def motion(v: float) -> Motion:
        u = math.sqrt(speed * speed - v * v)
        return Motion(0.0, 0.0, -math.atan2(v, u), u, v, turn)

    def excess(v: float) -> float:
        return _accelerations(hull, motion(v), mean, (0.0, 0.0, 0.0))[1]

    before, v = 0.0, 1e-3 * speed
    for _ in range(50):
        slope = (excess(v) - excess(before)) / (v - before) if v != before else 0.0
        if slope == 0.0:
            break
        before, v = v, min(max(v - excess(v) / slope, -0.7 * speed), 0.7 * speed)
    return Steady(speed, turn, motion(v), mean, _balance(hull, motion(v), mean))


def at_rest(hull: Hull, mean: Mean) -> list[Steady]:
    """The vessel at the target, in each heading that the loads turn it back to: there the sway force grows with the heading.

    Args:
        hull: Accelerations.
        mean: Loads, at least one of them.
    """

    def sway(psi: float) -> float:
        return _accelerations(hull, Motion(0.0, 0.0, psi, 0.0, 0.0, 0.0), mean, (0.0, 0.0, 0.0))[1]

    grid = np.linspace(-math.pi, math.pi, HEADINGS + 1) + 1e-3
    values = [sway(float(psi)) for psi in grid]
    found = []
    for k in range(HEADINGS):
        if values[k] < 0.0 <= values[k + 1]:
            low, high = float(grid[k]), float(grid[k + 1])
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if sway(middle) < 0.0 else (low, middle)
            motion = Motion(0.0, 0.0, high, 0.0, 0.0, 0.0)
            found.append(Steady(0.0, 0.0, motion, mean, _balance(hull, motion, mean)))
    return found


def _accelerations(hull: Hull, motion: Motion, mean: Mean, wrench: tuple[float, float, float]) -> tuple[float, float, float]:
    """The accelerations under a hull-fixed wrench and the mean loads."""
    X, Y = to_body(*mean.force, motion.psi)
    return hull(motion, (wrench[0] + X, wrench[1] + Y, wrench[2] + mean.lever * Y), to_body(*mean.current, motion.psi))


def _balance(hull: Hull, motion: Motion, mean: Mean) -> tuple[float, float]:
    """The surge force and yaw moment at which u and r do not change."""
    free, of_force, of_moment = (
        np.array(_accelerations(hull, motion, mean, wrench))[[0, 2]]
        for wrench in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    )
    tau = np.linalg.solve(np.column_stack((of_force - free, of_moment - free)), -free)
    return float(tau[0]), float(tau[1])


def linearise(g: Gains, hull: Hull, at: Steady, lags: tuple[float, float], gust_time: float) -> Linear:
    """A and B about a steady motion, by central differences of law and hull.

    Args:
        g: Gains; `T` is the control period.
        hull: Accelerations of the hull, which need not be the one that the gains are for.
        at: The steady motion.
        lags: First-order lags of surge force and yaw moment, which stand for dead times too.
        gust_time: Correlation time of the gusts.
    """
    m, (force, moment) = at.motion, at.wrench
    x = np.zeros(32)
    x[:19] = [*m, m.u, m.v, m.r, -force / g.m11, 0.0, -moment / g.m33, force, moment, 0.0, 0.0, 0.0, 0.0, m.v]
    L, W, w, X, N = g.U_c * g.T_c, g.U_c, 1.0 / g.T_c, g.tau_1max, g.tau_2max
    pose, velocities = [L, L, 1.0], [W, W, w]
    steps = [*pose, *velocities, *velocities, W * w, W * w, w * w, X, N, X, X, W, W, W]
    steps += [*pose, *velocities, X, X, W, W, X, X, N]
    columns = np.empty((19, 32))
    for i, size in enumerate(steps):
        d = np.zeros(32)
        d[i] = STEP * size
        columns[:, i] = (_rates(g, hull, at, lags, gust_time, x + d) - _rates(g, hull, at, lags, gust_time, x - d)) / (2.0 * d[i])
    return Linear(*np.split(columns, [19, 25, 27, 29], axis=1))


def _rates(g: Gains, hull: Hull, at: Steady, lags: tuple[float, float], gust_time: float, x: Array) -> Array:
    """The derivative of the states: of the states, measurement errors, force, current and hull-fixed wrench in x, shape (32,)."""
    z = x.tolist()
    n, m, U, r_d, c = z[19:], Motion(*z[:6]), at.speed, at.turn, (z[C_1], z[C_2], z[LASTING])
    seen = Motion(*[a + b for a, b in zip(m, n, strict=False)])
    desired, still = Motion(0.0, 0.0, 0.0, U, 0.0, r_d), Acceleration(0.0, 0.0, 0.0)
    s = control(
        seen, guidance(seen, desired, still, g), turn_in_current(desired, still, c, g), c, U, Estimates(*z[F_U : F_R + 1]), g
    )
    p, (eu, ev, er) = 0.25 * g.lam * g.lam, (a - b for a, b in zip(seen[3:], z[U_P : R_P + 1], strict=True))
    (F_1, F_2), (c_1, c_2), mean = at.mean.force, at.mean.current, at.mean
    mean = Mean((F_1 + z[GUST_1] + n[6], F_2 + z[GUST_2] + n[7]), mean.lever, (c_1 + n[8], c_2 + n[9]))
    du, dv, dr = _accelerations(hull, m, mean, (z[TAU_1] + n[10], n[11], z[TAU_2] + n[12]))
    ux, uy = to_body(m.u, m.v, -m.psi)
    learned = learned_current(seen, desired, c, g._replace(T=1.0))
    return np.array([
        ux - U + r_d * m.y, uy - r_d * m.x, m.r - r_d, du, dv, dr,
        z[F_U] + s.tau_1 / g.m11 + g.lam * eu, z[F_V] + g.lam * ev, z[F_R] + s.tau_2 / g.m33 + g.lam * er,
        p * eu + g.gamma3 * s.S2, p * ev + g.gamma1 * s.S1, p * er + g.gamma2 * s.ahead * s.S1,
        (s.tau_1 - z[TAU_1]) / lags[0], (s.tau_2 - z[TAU_2]) / lags[1],
        -z[GUST_1] / gust_time + r_d * z[GUST_2], -z[GUST_2] / gust_time - r_d * z[GUST_1],
        learned[0] - c[0] + r_d * c[1], learned[1] - c[1] - r_d * c[0], learned[2] - c[2],
    ])  # fmt: skip


def covariance(A: Array, Q: Array) -> Array:
    """P of A·P + P·A' + Q = 0 for a stable A."""
    n = len(A)
    one = np.eye(n)
    return np.asarray(np.linalg.solve(np.kron(one, A) + np.kron(A, one), -Q.ravel()).reshape(n, n))


class Error(NamedTuple):
    """Deviations in the end: amplitudes under loads that return, and standard deviations under noise and gusts.

    Attributes:
        amplitude, deviation: Of the position, m; the deviation in the worst direction.
        heading: Amplitude and deviation of the heading, rad.
        surfaces: Amplitude and deviation of the length of (S2, S1), m/s.
        shares: Largest surge force and yaw moment, in terms of their limits.
    """

    amplitude: float
    deviation: float
    heading: tuple[float, float]
    surfaces: tuple[float, float]
    shares: tuple[float, float]

    def bound(self, ahead: float) -> float:
        """The bound of the position error of the origin, where the law controls a point ahead of it, m."""
        largest = self.heading[0] + SIGMAS * self.heading[1]
        return self.amplitude + SIGMAS * self.deviation + ahead * largest


def error(g: Gains, found: Linear, at: Steady, loads: Loads) -> Error:
    """The errors of the linearised law in the end.

    On a straight line and at rest constant loads leave none, and the estimated current has no effect; on a circle force and
    current turn with the rate of the reference.

    Args:
        g: Gains.
        found: A and B about the steady motion.
        at: The steady motion.
        loads: What disturbs the vessel.
    """
    keep = np.arange(19 if at.turn else C_1)
    A, noise = found.A[np.ix_(keep, keep)], found.noise[keep] * np.array(loads.noise)
    Q = noise @ noise.T
    Q[[GUST_1, GUST_2], [GUST_1, GUST_2]] += 2.0 * loads.gust * loads.gust / loads.gust_time
    P = covariance(A, Q)
    inputs = [(found.wrench[keep] @ np.array(loads.wrench), loads.frequency)] if loads.frequency else []
    if at.turn:
        rotating, current = np.array([1.0, 1j]), loads.current / (1.0 - loads.current / at.speed) ** 2
        inputs += [(found.force[keep] @ rotating * loads.force, at.turn), (found.current[keep] @ rotating * current, at.turn)]
    responses = [response(A, *each) for each in inputs]
    size = sum((np.abs(x) for x in responses), np.zeros(len(A)))
    surfaces = _surfaces(g, at)[:, keep]
    sigma = np.sqrt(np.maximum(np.diag(P), 0.0))
    peaks = np.abs(at.wrench) + np.abs(np.array(loads.wrench)[[0, 2]]) + size[[TAU_1, TAU_2]] + SIGMAS * sigma[[TAU_1, TAU_2]]
    return Error(
        sum(_half_axis(x[DX], x[DY]) for x in responses),
        _largest(P[:2, :2]),
        (float(size[PSI]), float(sigma[PSI])),
        (float(np.linalg.norm(np.abs(surfaces) @ size)), _largest(surfaces @ P @ surfaces.T)),
        (float(peaks[0] / g.tau_1max), float(peaks[1] / g.tau_2max)),
    )


def response(A: Array, B: Array, omega: float) -> NDArray[np.complex128]:
    """The states under an input of the frequency omega, as complex amplitudes."""
    return np.asarray(np.linalg.solve(1j * omega * np.eye(len(A)) - A, B), dtype=np.complex128)


def _half_axis(x: complex, y: complex) -> float:
    """The larger half axis of the ellipse on which a point with these complex amplitudes moves."""
    return math.sqrt(0.5 * (abs(x) ** 2 + abs(y) ** 2 + abs(x * x + y * y)))


def _largest(P: Array) -> float:
    """The largest standard deviation in any direction."""
    return math.sqrt(max(float(np.linalg.eigvalsh(P)[-1]), 0.0))


def _surfaces(g: Gains, at: Steady) -> Array:
    """S2 and S1 as functions of the states, near the target at rest or on the path, shape (2, 19)."""
    s, lever = np.zeros((2, 19)), math.hypot(g.l0, g.T_a * at.speed)
    cosine, sine = math.cos(at.motion.psi), math.sin(at.motion.psi)
    s[0, [DX, DY, U_]], s[1, [DX, DY, V_, R_]] = (g.c * cosine, g.c * sine, 1.0), (-g.c * sine, g.c * cosine, 1.0, lever)
    s[1, PSI] = at.speed
    return s


def poles(found: Linear) -> Array:
    """The real parts of the poles; the estimated current, which does not enter the straight line, is left out."""
    return np.asarray(np.linalg.eigvals(found.A[:C_1, :C_1]).real)


def settling(found: Linear, at: Steady) -> float:
    """The time constant of the slowest deviation, in a turn with the estimated current, s."""
    n = 19 if at.turn else C_1
    return -1.0 / float(np.linalg.eigvals(found.A[:n, :n]).real.max())


def dead_time(g: Gains, found: Linear, command: int, lag: float) -> float:
    """The smallest dead time of a command that makes the law unstable, beyond the lag that is in A, s.

    Args:
        g: Gains.
        found: A and B.
        command: TAU_1 or TAU_2.
        lag: Of this command.
    """
    A, B, one = found.A[:C_1, :C_1].copy(), np.zeros(C_1), np.eye(C_1)
    of_states = lag * A[command] + one[command]
    A[command], B[command] = -one[command] / lag, 1.0 / lag
    omega = np.geomspace(0.1 * g.c, 10.0 * g.lam, FREQUENCIES)
    L = -np.linalg.solve(1j * omega[:, None, None] * one - A, np.broadcast_to(B[:, None].astype(complex), (len(omega), C_1, 1)))
    loop = L[:, :, 0] @ of_states
    passes = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
    return float(min((np.angle(-loop[k]) % (2.0 * math.pi) / omega[k + 1] for k in passes), default=math.inf))

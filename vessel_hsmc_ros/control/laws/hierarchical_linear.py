"""The hierarchical law about a steady motion of a hull: poles, tolerated dead time, and errors under noise, gusts and current.

| symbol | meaning | unit |
|---|---|---|
| x | deviation from the steady motion, in the axes of the reference, at the control steps | |
| A, B | x' = A·x + B·(errors of measurements, earth-fixed force, current, hull-fixed wrench, commands) a period later | |
| P, Q | covariance of x and of what noise and gusts add in a period, P = A·P·A' + Q | |
| L(z) | loop broken where a command arrives at its actuator, with the other one closed | - |

The step of the law is differentiated as it stands: prediction, networks (one integrator each, since |H| is constant with the
paper's centres), current estimate, modelled actuators, lead and dead time. The hull has actuators with a lag and a dead time, and
gusts. Limits, rates and the identification of the actuators are not in it. docs/theory.md says what that covers.

Steady motions of a hull under mean loads: along a straight line, on a circle, and at rest with the bow in wind or current.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.actuators import LARGEST_CHANGE, Bank, bank, first_state
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.interface.network import Neurons
from vessel_hsmc_ros.control.laws.hierarchical import Constants, Memory, step
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, extrapolate, to_body

Hull = Callable[[Motion, tuple[float, float, float], tuple[float, float]], tuple[float, float, float]]
"""The accelerations of u, v and r at the controlled point: of a motion, under surge force, sway force and yaw moment, in a
current in the hull's axes."""

HEADINGS = 36
"""Number of intervals in which a heading is looked for in which a vessel at rest stays."""


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


def steady(hull: Hull, speed: float, turn: float, mean: Mean) -> Steady:
    """The steady motion of a hull along a straight line or circle; its drift angle by the secant method.

    `speed`, `turn`: of the reference.
    """

    def motion(v: float) -> Motion:
        u = math.sqrt(speed * speed - v * v)
        return Motion(0.0, 0.0, -math.atan2(v, u), u, v, turn)

    def excess(v: float) -> float:
        return accelerations(hull, motion(v), mean, (0.0, 0.0, 0.0))[1]

    before, v = 0.0, 1e-3 * speed
    for _ in range(50):
        slope = (excess(v) - excess(before)) / (v - before) if v != before else 0.0
        if slope == 0.0:
            break
        before, v = v, min(max(v - excess(v) / slope, -0.7 * speed), 0.7 * speed)
    return Steady(speed, turn, motion(v), mean, _balance(hull, motion(v), mean))


def at_rest(hull: Hull, mean: Mean) -> list[Steady]:
    """The vessel at the target, in each heading that the loads turn it back to: there the sway force grows with the heading.

    `mean`: loads, at least one of them.
    """

    def sway(psi: float) -> float:
        return accelerations(hull, Motion(0.0, 0.0, psi, 0.0, 0.0, 0.0), mean, (0.0, 0.0, 0.0))[1]

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


def accelerations(hull: Hull, motion: Motion, mean: Mean, wrench: tuple[float, float, float]) -> tuple[float, float, float]:
    """The accelerations under a hull-fixed wrench and the mean loads."""
    X, Y = to_body(*mean.force, motion.psi)
    return hull(motion, (wrench[0] + X, wrench[1] + Y, wrench[2] + mean.lever * Y), to_body(*mean.current, motion.psi))


def _balance(hull: Hull, motion: Motion, mean: Mean) -> tuple[float, float]:
    """The surge force and yaw moment at which u and r do not change."""
    free, of_force, of_moment = (
        np.array(accelerations(hull, motion, mean, wrench))[[0, 2]]
        for wrench in ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    )
    tau = np.linalg.solve(np.column_stack((of_force - free, of_moment - free)), -free)
    return float(tau[0]), float(tau[1])


SIGMAS = 4.5
"""How many standard deviations of the position error count as its bound."""

DX, DY, PSI, U_, V_, R_ = range(6)
PREDICTED, NETWORKS, MODELLED = slice(6, 12), slice(12, 15), slice(15, 17)
TAU_1, TAU_2, GUST_1, GUST_2, C_1, C_2, LASTING, COMMANDS = range(17, 25)
"""The states: motion, its prediction, networks, modelled and acting wrench, gusts, estimated current, and from COMMANDS on the
last commands of force and moment, the latest pair first."""

FREQUENCIES = 100
"""Number of frequencies at which a loop is looked at."""

STEP = 1e-5
"""Of the differences, in units of each state."""


UNUSED: Bank = bank(KnownVessel(**INSTANT), 1.0)._replace(every=0)
UNUSED_STATE = first_state(UNUSED, 1.0)
"""The identification of the actuators, which is not in the model."""


class Lag(NamedTuple):
    """What an actuator of the hull does to its commands: first-order lag and dead time, s."""

    lag: float
    dead_time: float


class Linear(NamedTuple):
    """The linearised law and hull.

    Attributes:
        T: Period.
        late: Dead times of the hull's actuators in periods.
        A: Shape (n, n).
        noise, force, current, wrench, arriving: Columns of B: of errors of x, y, psi, u, v, r, (n, 6), earth-fixed force and
            current, (n, 2), hull-fixed wrench, (n, 3), and what is added to the commands that arrive, (n, 2).
    """

    T: float
    late: tuple[int, int]
    A: Array
    noise: Array
    force: Array
    current: Array
    wrench: Array
    arriving: Array


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


def linearise(g: Gains, hull: Hull, at: Steady, lags: tuple[Lag, Lag], gust_time: float) -> Linear:
    """A and B about a steady motion, by central differences of law and hull.

    `g`: gains; `T` is the control period. `hull`: accelerations of the hull, which need not be the one that the gains are for.
    `lags`: of the actuators of surge force and yaw moment, which need not be those that the law assumes. `gust_time`:
    correlation time of the gusts.
    """
    m, (force, moment) = at.motion, at.wrench
    late = round(lags[0].dead_time / g.T), round(lags[1].dead_time / g.T)
    places = max(*late, g.surge.delay, g.yaw.delay, 1)
    x = [*m, *m, -force / g.m11, 0.0, -moment / g.m33, force, moment, force, moment, 0.0, 0.0, 0.0, 0.0, m.v, *at.wrench * places]
    n = len(x)
    L, W, w, X, N = g.U_c * g.T_c, g.U_c, 1.0 / g.T_c, g.tau_1max, g.tau_2max
    motion = [L, L, 1.0, W, W, w]
    steps = [*motion, *motion, W * w, W * w, w * w, X, N, X, N, X, X, W, W, W, *[X, N] * places]
    steps += [*motion, X, X, W, W, X, X, N, X, N]
    centre, columns, period = np.array(x + [0.0] * 15), np.empty((n, n + 15)), Period(g, hull, at, lags, late, gust_time)
    for i, size in enumerate(steps):
        d = np.zeros(n + 15)
        d[i] = STEP * size
        columns[:, i] = (period.later(centre + d, n) - period.later(centre - d, n)) / (2.0 * d[i])
    return Linear(g.T, late, *np.split(columns, [n, n + 6, n + 8, n + 10, n + 13], axis=1))


class Period:
    """The states a control period later, without limits.

    `g`, `hull`, `at`, `lags`, `gust_time`: as for `linearise`. `late`: the dead times in periods.
    """

    def __init__(self, g: Gains, hull: Hull, at: Steady, lags: tuple[Lag, Lag], late: tuple[int, int], gust_time: float) -> None:
        surge, yaw = (each._replace(limit=LARGEST_CHANGE, change=LARGEST_CHANGE) for each in (g.surge, g.yaw))
        g = g._replace(tau_1max=LARGEST_CHANGE, tau_2max=LARGEST_CHANGE, surge=surge, yaw=yaw)
        # One neuron, so wide that it is always active, is an integrator.
        self.constants = Constants(g, Neurons(np.zeros((1, 3)), 1e9, False, np.zeros(0)), UNUSED)
        self.hull, self.at, self.lags, self.late, self.gust = hull, at, lags, late, math.exp(-g.T / gust_time)

    def later(self, x: Array, n: int) -> Array:
        """The n states after a period in which states and inputs were x."""
        z, T, at = x.tolist(), self.constants.gains.T, self.at
        motion, inputs = Motion(*z[:6]), z[n:]
        seen = Motion(*[a + b for a, b in zip(motion, inputs, strict=False)])
        wrench, m = self.command(z[:n], seen)
        commands = [*wrench, *z[COMMANDS:n]]
        tau, acting = [], []
        for i, (lag, late) in enumerate(zip(self.lags, self.late, strict=True)):
            command, last = commands[2 * late + i] + inputs[13 + i], z[TAU_1 + i]
            share = -math.expm1(-T / lag.lag) if lag.lag else 1.0
            tau.append(last + share * (command - last))
            acting.append(command + share * lag.lag / T * (last - command))  # the mean of the period
        loads = [*inputs[6:10], acting[0] + inputs[10], inputs[11], acting[1] + inputs[12]]
        motion, turned = self.moved(motion, loads, z[GUST_1 : GUST_2 + 1]), at.turn * T
        fu, fv, fr = (float(w + growth) for w, growth in zip(m.W[:, 0], m.growth[:, 0], strict=True))
        gusts = to_body(self.gust * z[GUST_1], self.gust * z[GUST_2], turned)
        relative = self.seen_from_reference(motion), self.seen_from_reference(m.predicted)
        return np.array(
            [*relative[0], *relative[1], fu, fv, fr, m.tau_1, m.tau_2, *tau, *gusts, *to_body(m.c[0], m.c[1], turned), m.c[2],
             *commands[: n - COMMANDS]]
        )  # fmt: skip

    def command(self, z: list[float], seen: Motion) -> tuple[tuple[float, float], Memory]:
        """The wrench that the law commands, and its memory afterwards."""
        one, at = np.ones(1), self.at
        queue = np.array(z[COMMANDS:]).reshape(-1, 2).T
        queue = np.concatenate((np.zeros((2, 1)), queue[:, ::-1]), axis=1)  # the present command goes to the column 0
        networks, c = np.array(z[NETWORKS])[:, None], (z[C_1], z[C_2], z[LASTING])
        predicted, (tau_1, tau_2) = Motion(*z[PREDICTED]), z[MODELLED]
        m = Memory(networks, one, np.zeros((3, 1)), np.zeros((3, 1)), predicted, tau_1, tau_2, 0, queue, c, UNUSED_STATE)
        desired = Motion(0.0, 0.0, 0.0, at.speed, 0.0, at.turn)
        wrench, _, m = step(seen, desired, Acceleration(0.0, 0.0, 0.0), m, self.constants)
        return wrench, m

    def moved(self, motion: Motion, loads: list[float], gusts: list[float]) -> Motion:
        """The motion of the hull after the period, by two steps of the midpoint rule."""
        (F_1, F_2), (c_1, c_2), h = self.at.mean.force, self.at.mean.current, 0.5 * self.constants.gains.T
        mean = Mean((F_1 + gusts[0] + loads[0], F_2 + gusts[1] + loads[1]), self.at.mean.lever, (c_1 + loads[2], c_2 + loads[3]))
        wrench = loads[4], loads[5], loads[6]
        for _ in range(2):
            start = Acceleration(*accelerations(self.hull, motion, mean, wrench))
            middle = Acceleration(*accelerations(self.hull, extrapolate(motion, start, 0.5 * h), mean, wrench))
            motion = extrapolate(motion, middle, h)
        return motion

    def seen_from_reference(self, motion: Motion) -> Motion:
        """A motion in the axes of the reference, a period later."""
        desired = Motion(0.0, 0.0, 0.0, self.at.speed, 0.0, self.at.turn)
        goal = extrapolate(desired, Acceleration(0.0, 0.0, 0.0), self.constants.gains.T)
        x, y = to_body(motion.x - goal.x, motion.y - goal.y, goal.psi)
        return Motion(x, y, motion.psi - goal.psi, motion.u, motion.v, motion.r)


def covariance(A: Array, Q: Array) -> Array:
    """P of P = A·P·A' + Q for a stable A: the sum of A^k·Q·A'^k, twice as many terms with each step."""
    P = Q
    for _ in range(60):
        more = A @ P @ A.T
        P, A = P + more, A @ A
        if np.abs(more).max() <= 1e-13 * np.abs(P).max():
            break
    return P


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
    current turn with the rate of the reference. `found`: A and B about the steady motion.
    """
    keep, T = _kept(found, at), found.T
    A, noise = found.A[np.ix_(keep, keep)], found.noise[keep] * np.array(loads.noise)
    Q = noise @ noise.T / T
    Q[[GUST_1, GUST_2], [GUST_1, GUST_2]] -= loads.gust * loads.gust * math.expm1(-2.0 * T / loads.gust_time)
    P = covariance(A, Q)
    inputs = [(found.wrench[keep] @ np.array(loads.wrench), loads.frequency)] if loads.frequency else []
    if at.turn:
        rotating, current = np.array([1.0, 1j]), loads.current / (1.0 - loads.current / at.speed) ** 2
        inputs += [(found.force[keep] @ rotating * loads.force, at.turn), (found.current[keep] @ rotating * current, at.turn)]
    responses = [response(A, B, omega * T) for B, omega in inputs]
    size = sum((np.abs(x) for x in responses), np.zeros(len(A)))
    surfaces = _surfaces(g, at, len(found.A))[:, keep]
    sigma = np.sqrt(np.maximum(np.diag(P), 0.0))
    latest = [*np.flatnonzero(np.isin(keep, [COMMANDS, COMMANDS + 1]))]
    peaks = np.abs(at.wrench) + size[latest] + SIGMAS * sigma[latest]
    return Error(
        sum(_half_axis(x[DX], x[DY]) for x in responses),
        _largest(P[:2, :2]),
        (float(size[PSI]), float(sigma[PSI])),
        (float(np.linalg.norm(np.abs(surfaces) @ size)), _largest(surfaces @ P @ surfaces.T)),
        (float(peaks[0] / g.tau_1max), float(peaks[1] / g.tau_2max)),
    )


def _kept(found: Linear, at: Steady | None) -> NDArray[np.intp]:
    """The states that count: the estimated current has no effect where the reference does not turn."""
    n = np.arange(len(found.A))
    return n if at and at.turn else n[(n < C_1) | (n > LASTING)]


def response(A: Array, B: Array, angle: float) -> NDArray[np.complex128]:
    """The states under an input that turns by an angle in each period, as complex amplitudes."""
    return np.asarray(np.linalg.solve(np.exp(1j * angle) * np.eye(len(A)) - A, B), dtype=np.complex128)


def _half_axis(x: complex, y: complex) -> float:
    """The larger half axis of the ellipse on which a point with these complex amplitudes moves."""
    return math.sqrt(0.5 * (abs(x) ** 2 + abs(y) ** 2 + abs(x * x + y * y)))


def _largest(P: Array) -> float:
    """The largest standard deviation in any direction."""
    return math.sqrt(max(float(np.linalg.eigvalsh(P)[-1]), 0.0))


def _surfaces(g: Gains, at: Steady, n: int) -> Array:
    """S2 and S1 as functions of the states, near the target at rest or on the path, shape (2, n)."""
    s, lever = np.zeros((2, n)), math.hypot(g.l0, g.T_a * at.speed)
    cosine, sine = math.cos(at.motion.psi), math.sin(at.motion.psi)
    s[0, [DX, DY, U_]], s[1, [DX, DY, V_, R_]] = (g.c * cosine, g.c * sine, 1.0), (-g.c * sine, g.c * cosine, 1.0, lever)
    s[1, PSI] = at.speed
    return s


def poles(found: Linear, at: Steady | None = None) -> NDArray[np.complex128]:
    """The poles, as rates in 1/s; without a turn those of the estimated current are left out."""
    keep = _kept(found, at)
    values = np.linalg.eigvals(found.A[np.ix_(keep, keep)]).astype(complex)
    return np.asarray(np.log(np.where(values == 0.0, 1e-300, values)) / found.T)


def settling(found: Linear, at: Steady) -> tuple[float, float]:
    """The time constants of the slowest deviation with a constant estimated current, and in a turn of that estimate or 0, s."""
    fast, slow = (-1.0 / float(poles(found, each).real.max()) for each in (None, at))
    return fast, slow if at.turn else 0.0


def dead_time(g: Gains, found: Linear, command: int) -> float:
    """The smallest dead time of a command that makes the law unstable, beyond what is in A, s.

    `found`: A and B. `command`: 0 of surge force, 1 of yaw moment.
    """
    keep = _kept(found, None)
    A, B, row = found.A[np.ix_(keep, keep)], found.arriving[keep, command], int(np.flatnonzero(keep == COMMANDS + command)[0])
    omega = np.geomspace(0.1 * g.c, min(10.0 * g.lam, 0.99 * math.pi / g.T), FREQUENCIES)
    z = np.exp(1j * omega * g.T)
    x = np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B[:, None].astype(complex), (len(z), len(A), 1)))
    # An input w where the command y arrives gives y = -L·(y + w); the latest command is known a period later.
    y = x[:, row, 0] * z ** (1 - found.late[command])
    loop = -y / (1.0 + y)
    passes = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
    return float(min((np.angle(-loop[k]) % (2.0 * math.pi) / omega[k + 1] for k in passes), default=math.inf))

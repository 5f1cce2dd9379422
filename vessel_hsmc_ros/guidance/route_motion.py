"""The motion of a hull along a route on which its speed changes: drift angle, velocities, what they take, and the timetable.

| symbol | meaning | unit | equation |
|---|---|---|---|
| t, W | time, speed along the route | s, m/s | - |
| kappa, kappa' | curvature of the route, its slope | 1/m, 1/m² | - |
| beta | drift angle chi - psi, positive for a drift to port | rad | - |
| u, v, r | W·cos(beta), W·sin(beta), W·kappa - dbeta/dt | m/s, m/s, rad/s | (6) |
| Y(u, v, r) | sway force lost to damping | N | plant.py |
| tau_1, tau_2 | surge force and yaw moment of (6) with these velocities | N, N·m | (6) |

No force acts on the sway, so m22·dv + m23·dr = -m11·u·r - Y. As in `drift`, where the speed is constant and the curve closed, one
solution does not grow. Of m23 = 0 it is, divided by W·cos(beta),

    (m22 - m11)·dbeta = -[m22·dW/W + Y/v]·tan(beta) - m11·W·kappa

which is solved forwards in time if m22 > m11, else backwards, from a straight part on which the drift angle is zero. With m23 the
equation is of the second order, and conditions stand at the ends where its modes decay. Both are solved by collocation.
"""

import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import require
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.guidance.route import Route, SpeedProfile
from vessel_hsmc_ros.guidance.timetable import Timetable
from vessel_hsmc_ros.plant.dynamics import Velocities, Vessel, hull_velocities, inverse_dynamics, steady_drift, sway_damping

TOLERANCE = 1e-9  # relative residual of the collocation, so small that its choice of instants does not show
SMALL_MESH, FINER, LARGEST_MESH = 200_000, 20, 2_000_000
"""The largest number of instants of the collocation: of a short path, in terms of the instants of a longer one, and of any."""

MESH_EXCEEDED = 1  # status of SciPy's solver that has not converged with its largest number of instants
SLOW = 0.02
"""Share of the largest speed below which a change of speed no longer changes the drift angle, which is undefined at rest."""

SINGULAR = 1e-3
"""m22 - m11 and m23 that are smaller than this share of m22, and of sqrt(m22·m33), count as that share: without one of them the
equation is of a lower order."""

MESHES = 8
"""Meshes at which the travel is kept: the collocation has its nodes, the middles and two quadrature points between them."""

INSTANT = 1e-3  # step of the difference that gives the second derivative, relative to the time between two instants

STEPS, GROWTH, LARGEST_TURN = 16, 0.15, 0.1
"""Instants of a transition; growth of the time between two on legs and arcs, away from their ends; and the largest change of the
course between two, rad."""


class Travel(NamedTuple):
    """Where a ship is at some times: arc length, speed, acceleration along the route, curvature and its slope; arrays."""

    s: Array
    W: Array
    W_rate: Array
    kappa: Array
    slope: Array


class DriftOverTime(NamedTuple):
    """The drift angle and its time derivatives, arrays; rad, rad/s, rad/s²."""

    beta: Array
    rate: Array
    rate_rate: Array


def travel_at(t: Array, route: Route, profile: SpeedProfile) -> Travel:
    """Where a ship is on a route. `t`: times, s."""
    s, W, dW = profile.at(t)
    return Travel(s, W, dW, *route.curvature(s))


def drift_along(
    route: Route, profile: SpeedProfile, times: Array, vessel: Vessel, start: float = 0.0, tolerance: float = TOLERANCE
) -> DriftOverTime:
    """The drift angle at some times.

    `times`: from the first to the last instant, resolving turns and changes of speed, shape (n,), s. `vessel`: coefficients of
    the hull, with sway damping. `start`: drift angle at the first instant, rad. `tolerance`: relative residual of the equation.
    Raises ParameterError if there is no solution with which the hull moves ahead; InstallationError if SciPy is missing.
    """
    require("scipy")
    from scipy.integrate import solve_bvp  # SciPy's import takes time, and few runs need it

    equation = _Coupled(route, profile, vessel) if vessel.coupled else _Plain(route, profile, vessel)
    travel = travel_at(times, route, profile)
    if not np.any(travel.kappa) and start == 0.0:
        return DriftOverTime(*np.zeros((3, len(times))))
    guess = np.zeros((equation.order, len(times)))
    guess[0] = steady_drift(vessel.m11 * travel.W * travel.kappa, np.maximum(travel.W, SLOW * profile.top), vessel)
    boundary = equation.conditions(start)
    with np.errstate(all="ignore"):
        most = min(max(SMALL_MESH, FINER * len(times)), LARGEST_MESH)
        found = solve_bvp(equation.rates, boundary, times, guess, tol=tolerance, max_nodes=most)
    if found.status == MESH_EXCEEDED:
        raise ParameterError(f"the drift angle along this path needs more than {most} instants; a shorter path would do")
    if not found.success or np.max(np.abs(found.y[0])) > 0.5 * math.pi:
        raise ParameterError("no drift angle is found with which this hull turns so at this speed")
    beta = found.sol(times)
    rates = equation.rates(times, beta)
    if equation.order == 2:
        return DriftOverTime(beta[0], beta[1], rates[1])
    # On the side of the longer of two steps, where the equation is smooth.
    h = INSTANT * np.gradient(times)
    low, high = np.maximum(times - h, times[0]), np.minimum(times + h, times[-1])
    change = equation.rates(high, found.sol(high))[0] - equation.rates(low, found.sol(low))[0]
    return DriftOverTime(beta[0], rates[0], change / (high - low))


class _Travels:
    """The travel at the meshes of a collocation, which evaluates its equation many times at each."""

    def __init__(self, route: Route, profile: SpeedProfile) -> None:
        self._route, self._profile = route, profile
        self._known: deque[tuple[Array, Travel]] = deque(maxlen=MESHES)

    def at(self, t: Array) -> Travel:
        for times, travel in self._known:
            if len(times) == len(t) and np.array_equal(times, t):
                return travel
        travel = travel_at(t, self._route, self._profile)
        self._known.append((t.copy(), travel))
        return travel


class _Plain:
    """The equation of a hull whose sway is not coupled to its yaw."""

    order = 1

    def __init__(self, route: Route, profile: SpeedProfile, vessel: Vessel) -> None:
        self._travels, self._profile, self._vessel = _Travels(route, profile), profile, vessel
        least, difference = SINGULAR * vessel.m22, vessel.m22 - vessel.m11
        self._difference = math.copysign(max(abs(difference), least), difference)

    def rates(self, t: Array, y: Array) -> Array:
        c, travel, beta = self._vessel, self._travels.at(t), y[0]
        W, tangent = travel.W, np.tan(beta)
        v = np.abs(W * np.sin(beta))
        lost = c.d_v + c.d_v2 * v + c.d_v3 * v * v
        slow = SLOW * self._profile.top
        braking = c.m22 * travel.W_rate * W / (W * W + slow * slow)
        result: Array = (-(braking + lost) * tangent - c.m11 * W * travel.kappa) / self._difference
        return result[None, :]

    def conditions(self, start: float) -> Any:
        forwards = self._difference > 0.0
        return lambda first, last: np.array([first[0] - start if forwards else last[0]])


class _Coupled:
    """The equation of a hull whose sway is coupled to its yaw, for beta and its rate."""

    order = 2

    def __init__(self, route: Route, profile: SpeedProfile, vessel: Vessel) -> None:
        self._travels, self._profile, self._vessel = _Travels(route, profile), profile, vessel
        least = SINGULAR * math.sqrt(vessel.m22 * vessel.m33)
        self._m23 = math.copysign(max(abs(vessel.m23), least), vessel.m23)

    def rates(self, t: Array, y: Array) -> Array:
        c, travel, (beta, rate) = self._vessel, self._travels.at(t), y
        W, dW = travel.W, travel.W_rate
        u, v, r = W * np.cos(beta), W * np.sin(beta), W * travel.kappa - rate
        dv = dW * np.sin(beta) + u * rate
        force = c.m22 * dv + c.m11 * u * r + sway_damping(u, v, r, c)
        return np.array([rate, dW * travel.kappa + W * W * travel.slope + force / self._m23])

    def conditions(self, start: float) -> Any:
        """Conditions at the start for the modes that decay forwards, at the end for the others."""
        c, W = self._vessel, self._profile.top
        first_order = (c.m22 - c.m11) * W - c.d_y_r - c.d_y_ur * W
        modes = np.roots((self._m23, -first_order, -(c.d_v + c.d_y_uv * W) * W))
        decaying = int(np.sum(modes.real < 0.0))
        if decaying == 1:
            return lambda first, last: np.array([first[0] - start, last[0]])
        if decaying == 2:
            return lambda first, _last: np.array([first[0] - start, first[1]])
        return lambda _first, last: np.array([last[0], last[1]])


class RouteMotion(NamedTuple):
    """A motion along a route at some instants."""

    times: Array  # instants, shape (n,), s
    travel: Travel  # where the ship is, and how fast
    drift: DriftOverTime  # the drift angle
    velocities: Velocities  # body velocities and accelerations
    vessel: Vessel  # coefficients of the hull

    def inputs(self, current: float = 0.0) -> tuple[Array, Array]:
        """Surge force [N] and yaw moment [N·m] that the motion takes against a current from ahead, m/s."""
        return inverse_dynamics(self.velocities._replace(u=self.velocities.u + current), self.vessel)


def motion_along(
    route: Route, profile: SpeedProfile, vessel: Vessel, start: float = 0.0, tolerance: float = TOLERANCE
) -> RouteMotion:
    """The motion of a hull.

    `start`: drift angle at the beginning, rad. `tolerance`: relative residual of the equation of the drift angle.
    """
    times = _instants(route, profile)
    drift, travel = drift_along(route, profile, times, vessel, start, tolerance), travel_at(times, route, profile)
    bend, direction = (travel.kappa, travel.slope), (np.cos(drift.beta), np.sin(drift.beta))
    velocities = hull_velocities(travel.W, travel.W_rate, bend, direction, drift.rate, drift.rate_rate)
    return RouteMotion(times, travel, drift, velocities, vessel)


def timetable(motion: RouteMotion, route: Route, begin: float) -> Timetable:
    """The motion as a table. `begin`: time at which it begins, s."""
    travel, drift = motion.travel, motion.drift
    p, chi = route.position(travel.s), route.course(travel.s)
    along = np.exp(1j * chi)
    velocity, acceleration = travel.W * along, (travel.W_rate + 1j * travel.W * travel.W * travel.kappa) * along
    columns = (p, chi - drift.beta, velocity, motion.velocities.r, acceleration, motion.velocities.dr)
    x, psi, dx, r, ddx, dr = columns
    rows = np.column_stack((x.real, x.imag, psi, dx.real, dx.imag, r, ddx.real, ddx.imag, dr))
    return Timetable(begin + motion.times, np.ascontiguousarray(rows, np.float64))


def _instants(route: Route, profile: SpeedProfile) -> Array:
    """Instants that resolve transitions, arcs and changes of speed; all at which a derivative jumps are among them."""
    joints = np.unique(np.concatenate((profile.corners, profile.time_at(route.ends[1:-1]))))
    # Joints that coincide but for rounding.
    joints = joints[np.concatenate(([True], np.diff(joints) > 1e-9 * joints[-1]))]
    s, W, _ = profile.at(0.5 * (joints[:-1] + joints[1:]))
    kappa, slope = route.curvature(s)
    spans = np.diff(joints)
    bent = spans[slope != 0.0]
    finest = float(np.min(bent) if len(bent) else np.max(spans)) / STEPS
    parts = [joints[-1:]]
    for begin, span, rate, changing in zip(joints, spans, W * np.abs(kappa), slope != 0.0, strict=False):
        parts.append(begin + span * (np.arange(STEPS) / STEPS if changing else _graded(span, finest, rate)))
    return np.unique(np.concatenate(parts))


def _graded(span: float, finest: float, rate: float) -> Array:
    """Fractions of a span that is resolved finely at its two ends."""
    coarsest = LARGEST_TURN / rate if rate > 0.0 else math.inf
    times, t = [0.0], 0.0
    while t < 0.5 * span:
        t += min(finest + GROWTH * t, coarsest)
        times.append(t)
    half = np.array(times) / (2.0 * t)
    return np.concatenate((half, 1.0 - half[-2:0:-1]))

"""The certificate of a scenario: what holds of the law `hierarchical` near the reference, with hull data known to a fifth.

| symbol | meaning | unit |
|---|---|---|
| U, r_d | mean speed and largest yaw rate of the reference | m/s, rad/s |
| D, K | decay rate of the sway velocity, sway acceleration per surge velocity and yaw rate, at the controlled point | 1/s, - |

The box: surge and yaw inertia, D and K differ by up to a fifth from their data.

The conditions in closed form hold for every hull of the box, by interval arithmetic; poles and errors are the worst of its
corners. docs/theory.md has the theorems.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.known_vessel import ControlledVessel
from vessel_hsmc_ros.control.laws.hierarchical_linear import (
    R_,
    SIGMAS,
    U_,
    V_,
    Error,
    Hull,
    Lag,
    Loads,
    Mean,
    Steady,
    at_rest,
    dead_time,
    error,
    linearise,
    poles,
    settling,
    steady,
)
from vessel_hsmc_ros.control.laws.hierarchical_parameters import (
    Gains,
    HierarchicalParameters,
    Interval,
    about,
    ball,
    circled,
    gains,
    rest_ratio,
    routh_ratio,
    turning_ratio,
)
from vessel_hsmc_ros.core.exceptions import InstabilityError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.quantities import number
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.dynamics import Vessel, acceleration, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.scenario import Scenario

BOX = 0.2
"""Share by which the data of a hull may be wrong."""

MAX_DURATION, REFERENCE_HZ = 400.0, 5.0
"""How much of the reference is looked at, s, and its rate."""

DAMPING = tuple(name for name in ShipParameters.__dataclass_fields__ if "_damping" in name)


class Case(NamedTuple):
    """What a certificate is for.

    Attributes:
        parameters, known, g: The law's numbers, what it knows of the vessel, and its gains.
        ship: The hull as given.
        speed, turn: Of the reference; 0 for one that hardly moves.
        lags: Lag and dead time of surge force and yaw moment.
        loads, lever: What disturbs the vessel, and the lever of the wind, m.
    """

    parameters: HierarchicalParameters
    known: ControlledVessel
    g: Gains
    ship: ShipParameters
    speed: float
    turn: float
    lags: tuple[Lag, Lag]
    loads: Loads
    lever: float

    def hulls(self, x: float) -> list[Hull]:
        """The corners of the box at a point at the distance x ahead of the origin."""
        return [hull_at(ship.coefficients(), x) for ship in box(self.ship)]

    def mean(self, angle: float) -> Mean:
        """The mean loads, the force towards a direction."""
        F, c, along = self.loads.force, self.loads.current, angle + self.loads.between
        force, current = (F * math.cos(angle), F * math.sin(angle)), (c * math.cos(along), c * math.sin(along))
        return Mean(force, self.lever, current)


def case_of(scenario: Scenario) -> Case:
    """The hull, law, loads and reference of a scenario."""
    c, sim = scenario.controller, scenario.vessel_sim
    known, period = c.vessel.as_controlled(), RateGrid(c.rate_hz).period
    count = int(min(sim.duration or MAX_DURATION, MAX_DURATION) * REFERENCE_HZ)
    motion = trajectory(scenario.reference_ship, REFERENCE_HZ, max(count, 4))
    late = motion[len(motion) // 2 :]  # the start from rest is not what the reference is like
    g, speed = gains(c.hierarchical, known, period), float(np.mean(np.hypot(late[:, 3], late[:, 4])))
    moves = speed > g.U_c
    return Case(
        c.hierarchical,
        known,
        g,
        sim.vessel,
        speed if moves else 0.0,
        float(late[np.argmax(np.abs(late[:, 5])), 5]) if moves else 0.0,
        _lags(scenario),
        _loads(scenario, period),
        sim.disturbance.earth_fixed.lever,
    )


def _lags(scenario: Scenario) -> tuple[Lag, Lag]:
    """Lag and dead time of surge force and yaw moment."""
    if (a := scenario.vessel_sim.actuators).kind == "wrench":
        return Lag(a.surge_lag, a.surge_dead_time), Lag(a.yaw_lag, a.yaw_dead_time)
    d = dynamics(scenario.controller.vessel.as_controlled())
    return Lag(d.surge.lag, d.surge.dead_time), Lag(d.yaw.lag, d.yaw.dead_time)


def _loads(scenario: Scenario, period: float) -> Loads:
    """The loads of a scenario. Without the observer's dynamics its noise is unknown, so then that of the sensors is left out."""
    d, s = scenario.vessel_sim.disturbance, scenario.vessel_sim.sensors
    deviations = s.position_noise, s.position_noise, s.heading_noise, s.velocity_noise, s.velocity_noise, s.yaw_rate_noise
    rates = (s.position_rate_hz,) * 2 + (s.heading_rate_hz,) + (s.velocity_rate_hz,) * 3
    seen = 0.0 if scenario.controller.observer.enabled else 1.0
    noise = [
        seen * each * math.sqrt(max(period, 1.0 / rate if rate else 0.0)) for each, rate in zip(deviations, rates, strict=True)
    ]
    wind, periodic = d.earth_fixed, d.periodic
    between = math.atan2(d.current.north, d.current.east) - math.atan2(wind.north_force, wind.east_force)
    return Loads(
        tuple(noise),
        wind.gust_deviation,
        wind.gust_time_constant,
        math.hypot(wind.east_force, wind.north_force),
        math.hypot(d.current.east, d.current.north),
        between,
        (periodic.surge_force, periodic.sway_force, periodic.yaw_moment),
        periodic.frequency,
    )


def hull_at(vessel: Vessel, x: float) -> Hull:
    """The accelerations of a hull at a point at the distance x ahead of its origin."""

    def accelerations(m: Motion, wrench: tuple[float, float, float], c: tuple[float, float]) -> tuple[float, float, float]:
        f_u, f_v, f_r = unforced_acceleration(m.u - c[0], m.v - x * m.r - c[1], m.r, vessel)
        a_u, a_v, a_r = acceleration(wrench, vessel)
        dr = f_r + a_r
        return f_u + a_u + m.r * c[1], f_v + a_v - m.r * c[0] + x * dr, dr

    return accelerations


def box(ship: ShipParameters) -> Iterator[ShipParameters]:
    """The corners of the box: m11, m33, D and K a fifth less or more."""
    for factors in itertools.product((1.0 - BOX, 1.0 + BOX), repeat=4):
        yield in_box(ship, *factors)


def in_box(ship: ShipParameters, surge: float, yaw: float, D: float, K: float) -> ShipParameters:
    """A hull with other m11, m33, D and K, by their factors; the centre of percussion stays where it is."""
    sway = surge / K
    factors = {"surge_inertia": surge, "sway_inertia": sway, "sway_yaw_inertia": sway, "yaw_sway_inertia": sway}
    factors |= {"yaw_inertia": yaw, **dict.fromkeys(DAMPING, D * sway)}
    return replace(ship, **{name: factor * getattr(ship, name) for name, factor in factors.items()})


def sway_of(hull: Hull, U: float, step: float) -> tuple[float, float]:
    """D and K of a hull at a speed, by central differences; K is 0 at rest."""

    def sway(v: float, r: float) -> float:
        return hull(Motion(0.0, 0.0, 0.0, U, v, r), (0.0, 0.0, 0.0), (0.0, 0.0))[1]

    D = (sway(-step, 0.0) - sway(step, 0.0)) / (2.0 * step)
    return D, (sway(0.0, -step / U) - sway(0.0, step / U)) / (2.0 * step) if U else 0.0


SIDES = 0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi
"""Directions of the wind relative to a straight line."""

SMALL, SMALL_AT_REST = 0.5, 0.35
"""Largest deviation of the heading under way, and its largest standard deviation at rest, for which the law is linear, rad."""

DAMPED = 1.5
"""D/c above which a vessel at rest was never seen to circle in wind and current; below, some do."""

NONLINEAR = 1.6
"""How much larger errors in wind and current may be at rest than those of the linear law: measured, docs/theory.md."""

WEAK = 0.02
"""Share of the surge force with which the surfaces at rest are bounded where no load turns the vessel."""

PEAK = 2.0
"""Peak of the periodic load, whose mean is its amplitude, in terms of that."""

NEGLIGIBLE = 1e-6
"""Share of a limit below which a command or heading counts as this."""

SLOW_CURRENT = 3.0
"""In a turn the speed over ground must be so many times the current."""


class Clause(NamedTuple):
    """A condition: what must exceed 1, in words, and its values over the box."""

    name: str
    ratio: Interval

    @property
    def holds(self) -> bool:
        """Whether it holds for every hull of the box."""
        return self.ratio.low > 1.0

    def __str__(self) -> str:
        values = dict.fromkeys(number(value) for value in (self.ratio.low, self.ratio.high))
        return f"{self.name} must exceed 1 (got {' to '.join(values)})"


class Part(NamedTuple):
    """The certificate of one kind of motion.

    Attributes:
        clauses: Its conditions, up to the first that does not hold.
        bound: Of the position error in the end, m; infinite without a certificate.
        settling: Time constant with which the slowest deviation decays, s.
        current_settling: The same of the estimated current in a turn, s; otherwise 0.
    """

    clauses: tuple[Clause, ...]
    bound: float = math.inf
    settling: float = math.inf
    current_settling: float = 0.0

    @property
    def failed(self) -> tuple[Clause, ...]:
        """The clauses that do not hold."""
        return tuple(each for each in self.clauses if not each.holds)


def under_way(case: Case) -> Part:
    """The certificate on a steady reference: a circle with its largest yaw rate, or a straight line in loads from any side."""
    g, U, ahead = case.g, case.speed, case.known.ahead
    D, K = (about(each, BOX) for each in sway_of(hull_at(case.ship.coefficients(), ahead), U, 1e-4 * g.U_c))
    lam = math.hypot(g.l0, g.T_a * U) / U
    clauses = [_sampled(g)]
    if K.low > 0.0:
        clauses.append(Clause("course by heading (1 + lam·D)/K", turning_ratio(D, K, lam)))
    if D.low > 0.0:
        clauses.append(Clause("Routh ratio of the path error", routh_ratio(g, D, K, lam)))
    else:
        clauses.append(Clause("sway damping", D))
    if case.turn and case.loads.current:
        ratio = U / (SLOW_CURRENT * case.loads.current)
        clauses.append(Clause("speed/(3·current) in a turn", Interval(ratio, ratio)))
    if not all(each.holds for each in clauses):
        return Part(tuple(clauses))
    means = [Mean((0.0, 0.0), case.lever)] if case.turn else [case.mean(angle) for angle in SIDES]
    motions = [(hull, steady(hull, U, case.turn, mean)) for hull in case.hulls(ahead) for mean in means]
    return _judged(case, clauses, motions, lambda found: (max(each.bound(ahead) for each in found), 0.0))


def at_a_point(case: Case) -> Part:
    """The certificate of station keeping."""
    g, loads, x_p = case.g, case.loads, case.known.ahead
    D, _ = sway_of(hull_at(case.ship.coefficients(), 0.0), 0.0, 1e-4 * g.U_c)
    damping, blows = rest_ratio(g, about(D, BOX)), bool(loads.force or loads.current)
    clauses = [_sampled(g), Clause("sway damping/approach rate D/c", damping)]
    if blows:
        clauses.append(Clause(f"D/({DAMPED:g}·c) in wind or current", damping / DAMPED))
    if x_p > 0.0:
        lever = Interval(g.l0, g.l0) / x_p
        clauses.append(Clause("station lever/centre of percussion l0/x_p", lever))
    if not all(each.holds for each in clauses):
        return Part(tuple(clauses))
    mean = case.mean(0.0) if blows else Mean((WEAK * g.tau_1max, 0.0))
    motions = [(hull, at) for hull in case.hulls(0.0) for at in at_rest(hull, mean)]

    def bound(found: list[Error]) -> tuple[float, float]:
        s = max(each.surfaces[0] + SIGMAS * each.surfaces[1] for each in found)
        if not blows:
            return min((ball(g, s), 0.0), circled(g, _drift(case), s))
        turned = not any(loads.wrench) and max(each.heading[1] for each in found) < SMALL_AT_REST
        return min(ball(g, s), NONLINEAR * max(each.bound(0.0) for each in found)) if turned else ball(g, s), 0.0

    return _judged(case, clauses, motions, bound)


def _drift(case: Case) -> float:
    """The largest sway velocity under the hull-fixed sway force while the vessel circles: D·v = d - K·u·r with u·r = -c·v."""
    largest = 0.0
    for hull in case.hulls(0.0):
        D, K = sway_of(hull, case.g.U_c, 1e-4 * case.g.U_c)
        still = _steady_velocity(hull, V_, (0.0, PEAK * abs(case.loads.wrench[1]), 0.0))
        largest = max(largest, still * D / (D - K * case.g.c) if K * case.g.c < D else math.inf)
    return largest


def _sampled(g: Gains) -> Clause:
    """The sampled surfaces converge: 2/((k + eta/phi)·h·m/m_true) and 2/(lam·h), with the inertia that the law knows."""
    fastest = max(g.k1 + g.eta1 / g.phi1, g.k2 + g.eta2 / g.phi2)
    ratio = 2.0 / (fastest * g.T / Interval(1.0 - BOX, 1.0 + BOX))
    return Clause("control rate/lowest rate", Interval(min(ratio.low, 2.0 / (g.lam * g.T)), ratio.high))


def _judged(
    case: Case, clauses: list[Clause], motions: list[tuple[Hull, Steady]], bound: Callable[[list[Error]], tuple[float, float]]
) -> Part:
    """The rest of a certificate: every deviation decays, and the commands keep within their limits."""
    g = case.g
    linear = [(linearise(g, hull, at, case.lags, case.loads.gust_time), at) for hull, at in motions]
    slowest = max(float(poles(each).real.max()) for each, _ in linear)
    decay = 1.0 - slowest / g.c
    clauses.append(Clause("1 + slowest decay/c", Interval(decay, decay)))
    if slowest >= 0.0:
        return Part(tuple(clauses))
    found = [error(g, each, at, case.loads) for each, at in linear]
    for what, shares in zip(("surge force", "yaw moment"), zip(*(each.shares for each in found), strict=True), strict=True):
        clauses.append(_within(f"limit/largest {what}", shares))
    if case.speed and motions[0][1].speed:
        sizes = [(each.heading[0] + SIGMAS * each.heading[1]) / SMALL for each in found]
        clauses.append(_within("0.5 rad/largest heading error", sizes))
    if not all(each.holds for each in clauses):
        return Part(tuple(clauses))
    largest, time = bound(found)
    times = [settling(each, at) for each, at in linear]
    return Part(tuple(clauses), largest, max(time, *(each for each, _ in times)), max(each for _, each in times))


class Limits(NamedTuple):
    """What bounds any use of the law on the box, and what no law beats on the hull as given.

    Attributes:
        rate: Lowest control rate, Hz.
        dead_time: That the law tolerates besides lag and dead time of the actuators, s; nan where a hull is unstable without it.
        turn: Radius of the tightest turn at the speed of the reference, m; nan for a reference at rest.
        current: Largest current across a leg at that speed, m/s; nan for a reference at rest.
        circle: Smallest circle at rest under the sway force that is fixed to the hull, d_v/(a·r_max), m.
    """

    rate: float
    dead_time: float
    turn: float
    current: float
    circle: float


def limits_of(case: Case) -> Limits:
    """The limits of the case."""
    hull, U = hull_at(case.ship.coefficients(), 0.0), case.speed
    force, moment, push = case.g.tau_1max, case.g.tau_2max, PEAK * abs(case.loads.wrench[1])
    fastest = _steady_velocity(hull, U_, (force, 0.0, 0.0))
    turn_rate, drift = _steady_velocity(hull, R_, (0.0, 0.0, moment)), _steady_velocity(hull, V_, (0.0, push, 0.0))
    across = math.sqrt(max(fastest * fastest - U * U, 0.0)) if U else math.nan
    return Limits(lowest_rate(case), spare_dead_time(case), tightest_turn(case) if U else math.nan, across, drift / turn_rate)


def _steady_velocity(hull: Hull, axis: int, wrench: tuple[float, float, float]) -> float:
    """The steady velocity along an axis under a wrench, the other two being held at zero; infinite without damping."""

    def driven(size: float) -> bool:
        velocity = [0.0] * 6
        velocity[axis] = size
        return hull(Motion(*velocity), wrench, (0.0, 0.0))[axis - U_] <= 0.0

    return _smallest(driven, 1e-9, 1e3) if any(wrench) else 0.0


def _within(name: str, shares: Sequence[float]) -> Clause:
    """The clause that shares of a limit are below 1."""
    return Clause(name, 1.0 / Interval(max(min(shares), NEGLIGIBLE), max(*shares, NEGLIGIBLE)))


def spare_dead_time(case: Case) -> float:
    """The dead time that the law tolerates at every corner of the box, besides lag and dead time of the actuators, s."""
    g, still = case.g, Mean()
    weak = Mean((WEAK * g.tau_1max, 0.0))
    motions = [
        (hull, at)
        for hull in case.hulls(case.known.ahead if case.speed else 0.0)
        for at in ([steady(hull, case.speed, case.turn, still)] if case.speed else at_rest(hull, weak))
    ]
    found = [linearise(g, hull, at, case.lags, case.loads.gust_time) for hull, at in motions]
    if max(float(poles(each).real.max()) for each in found) >= 0.0:
        return math.nan
    return min(dead_time(g, each, command) for each in found for command in (0, 1))


def lowest_rate(case: Case) -> float:
    """The lowest control rate that the law tolerates on every hull of the box, Hz."""

    def tolerated(rate_hz: float) -> bool:
        try:
            return _sampled(gains(case.parameters, case.known, 1.0 / rate_hz)).holds
        except InstabilityError:
            return False

    return _smallest(tolerated, 1e-3, 1e4)


def tightest_turn(case: Case) -> float:
    """The smallest radius that every hull of the box can sail at the speed of the reference, m."""
    g, hulls = case.g, case.hulls(case.known.ahead)

    def sailed(radius: float) -> bool:
        motions = [steady(hull, case.speed, case.speed / radius, Mean()) for hull in hulls]
        return all(
            abs(at.wrench[0]) <= g.tau_1max and abs(at.wrench[1]) <= g.tau_2max and abs(at.motion.v) < 0.69 * case.speed
            for at in motions
        )

    return _smallest(sailed, 0.01 * case.known.length, 1e4 * case.known.length)


def _smallest(holds: Callable[[float], bool], low: float, high: float) -> float:
    """The smallest number from which on a condition holds, by bisection of its logarithm; infinite where it never does."""
    if not holds(high):
        return math.inf
    for _ in range(30):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high

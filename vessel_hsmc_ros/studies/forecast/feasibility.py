"""Whether any law could keep a ship on its reference: inverse dynamics of the true ship in the true current and mean wind.

| symbol | meaning | unit |
|---|---|---|
| p | position of the reference, and p', p'' its derivatives over ground | m, m/s, m/s² |
| c | current | m/s |
| q | p' - c, velocity through the water | m/s |
| e, n | unit vectors ahead and to port of a ship with the heading psi | - |
| u, v, r | q·e, q·n, psi': velocities relative to the water | m/s, m/s, rad/s |
| W | mean force of the wind | N |
| X, N | surge force and yaw moment that the motion takes | N, N·m |
| T | sqrt(m33/largest yaw moment) | s |

A ship that is on its reference has q and p'', but it has no force in sway, so its heading follows from the sway equation of (6)

    m22·(p''·n - r·u) + m23·r' + m11·u·r + (D·nu)_Y = W·n

The heading is an internal motion: for m11 < m22 it is stable forwards in time and is integrated so; for m11 > m22 it is stable
backwards, and a law that knows the future of the reference can take it; near m11 = m22 the equation is algebraic. The implicit
Euler method in the stable direction solves all three. r' is that of the last iterate, as m23 is small. The equations of surge
and yaw then give X and N. |X| and |N|, their rates, and what has to be commanded through a lag must be within MAX_LIMIT_SHARE of
the limits for MIN_FEASIBLE_SHARE of the time. Gusts, noise and dead times are not considered.

Each leg is judged in a steady motion on its course. The surge force must give the velocity through the water that the leg takes
against the wind. Force and moment must be within their share of the limits at the heading at which no sway force is left over.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.metrics import NO_LEG, NOISE_PEAK, Run, position_error
from vessel_hsmc_ros.core.quantities import in_noise, number, quantity
from vessel_hsmc_ros.guidance import curve_motion
from vessel_hsmc_ros.guidance.curve_motion import LARGEST_DRIFT, Pace
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack
from vessel_hsmc_ros.plant.devices import ActuatorParameters
from vessel_hsmc_ros.plant.dynamics import Vessel, damping_force
from vessel_hsmc_ros.plant.simulator import within
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, scale_of
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.simulation.offline import simulate

MAX_LIMIT_SHARE = 0.9  # largest share of the limits that a feasible motion takes
REST_SHARE = 0.8  # largest share of the surge force that station keeping takes
MIN_FEASIBLE_SHARE = 0.99  # share of the samples of the last half that must be within
SAMPLE = 0.05  # period of the samples, in T
ITERATES = 3  # number of solutions of the sway equation, each with the yaw acceleration of the last one
MIN_WAY = 0.01  # surge speed through the water below which a heading has no way, relative to the speed of the reference


class Demand(NamedTuple):
    """What a motion takes: heading [rad], surge speed through the water [m/s], X [N] and N [N·m], (n,) each."""

    psi: Array
    u: Array
    X: Array
    N: Array


def exceeded(needed: Demand, a: ActuatorParameters, h: float) -> str:
    """The first of forces, rates and commands that is above its share of a limit too often; empty if none is."""
    for name, load, limit, rate, lag in (
        ("surge force", needed.X, a.surge_force_limit, a.surge_force_rate, a.surge_lag),
        ("yaw moment", needed.N, a.yaw_moment_limit, a.yaw_moment_rate, a.yaw_lag),
    ):
        change = np.gradient(load, h)
        for what, share in (
            (name, np.abs(load) / limit),
            (f"rate of the {name}", np.abs(change) / rate),
            (f"command of the {name}", np.abs(load + lag * change) / limit),
        ):
            if not np.mean(share <= MAX_LIMIT_SHARE) >= MIN_FEASIBLE_SHARE:
                return f"the {what} needs {np.quantile(share, MIN_FEASIBLE_SHARE):.3g} of its limit"
    return ""


def demand(rows: Array, current: Array, wind: Array, vessel: Vessel, h: float) -> Demand:
    """What a ship takes to be on a reference.

    `rows`: x, y, psi, u, v, r, du, dv, dr of the reference over ground, (n, 9). `current`: its components east and north, (2,)
    m/s. `wind`: mean force of the wind, (2,) N. `h`: period of the rows, s.
    """
    q, acceleration = _through_water(rows, current)
    forward = vessel.m11 <= vessel.m22
    begin = q[0 if forward else -1]
    start = math.atan2(begin[1], begin[0])
    r_rate, psi = np.zeros(len(rows)), np.zeros(len(rows))
    for _ in range(ITERATES if vessel.m23 else 1):
        compiled(solve_heading)(q, acceleration, wind, r_rate, vessel, h if forward else -h, start, psi)
        r_rate = np.gradient(np.gradient(psi, h), h)
    c, s, r = np.cos(psi), np.sin(psi), np.gradient(psi, h)
    u, v = q[:, 0] * c + q[:, 1] * s, q[:, 1] * c - q[:, 0] * s
    ahead, abeam = acceleration[:, 0] * c + acceleration[:, 1] * s, acceleration[:, 1] * c - acceleration[:, 0] * s
    du, dv = ahead + r * v, abeam - r * u
    lost_X, _, lost_N = _lost(u, v, r, vessel)
    X = vessel.m11 * du - (vessel.m22 * v + vessel.m_c * r) * r + lost_X - (wind[0] * c + wind[1] * s)
    N = vessel.m33 * r_rate + vessel.m32 * dv + ((vessel.m22 - vessel.m11) * v + vessel.m_c * r) * u + lost_N
    return Demand(psi, u, X, N)


def _through_water(rows: Array, current: Array) -> tuple[Array, Array]:
    """Q and p'' in the earth-fixed frame, (n, 2) each."""
    psi, u, v, r, du, dv = rows[:, 2:8].T
    c, s = np.cos(psi), np.sin(psi)
    q = np.column_stack([u * c - v * s, u * s + v * c]) - current
    ahead, abeam = du - r * v, dv + r * u
    return q, np.column_stack([ahead * c - abeam * s, ahead * s + abeam * c])


def _lost(u: Array, v: Array, r: Array, vessel: Vessel) -> tuple[Array, Array, Array]:
    """`damping_force` of arrays of velocities, element by element."""
    element_by_element: Any = damping_force
    X, Y, N = element_by_element(u, v, r, vessel)
    return X, Y, N


@kernel
def sway_residual(
    psi: float, last: float, h: float, flow: tuple[float, float, float, float, float, float], m23_force: float, vessel: Vessel
) -> float:
    """What the sway equation lacks at a heading, N."""
    s = vessel
    qx, qy, ax, ay, wx, wy = flow
    c, sine = math.cos(psi), math.sin(psi)
    u, v, r = qx * c + qy * sine, qy * c - qx * sine, (psi - last) / h
    _, lost, _ = damping_force(u, v, r, vessel)
    return s.m22 * (ay * c - ax * sine - r * u) + m23_force + s.m11 * u * r + lost - (wy * c - wx * sine)


@kernel
def solve_heading(
    q: Array, acceleration: Array, wind: Array, r_rate: Array, vessel: Vessel, h: float, start: float, psi: Array
) -> None:
    """Write the heading that the sway equation gives, by Newton's method in every step.

    `wind`: W, (2,). `r_rate`: r', (n,). `psi`: Headings, (n,); written.
    """
    n, last = len(psi), start
    for step in range(n):
        k = step if h > 0.0 else n - 1 - step
        flow = (q[k, 0], q[k, 1], acceleration[k, 0], acceleration[k, 1], wind[0], wind[1])
        force, x = vessel.m23 * r_rate[k], last
        for _ in range(30):
            found = sway_residual(x, last, h, flow, force, vessel)
            slope = (sway_residual(x + 1e-6, last, h, flow, force, vessel) - found) * 1e6
            change = found / slope if slope != 0.0 else 0.0
            change = min(max(change, -0.2), 0.2)
            x = x - change
            if abs(change) < 1e-10:
                break
        psi[k] = last = x


def infeasible_rest(current: Array, wind: Array, a: ActuatorParameters, vessel: Vessel) -> str:
    """Why a ship cannot keep its position: whether a heading without a force in sway takes too much force or moment."""
    psi = np.linspace(-math.pi, math.pi, 721)
    c, s = np.cos(psi), np.sin(psi)
    u, v = -(current[0] * c + current[1] * s), -(current[1] * c - current[0] * s)
    lost_X, lost_Y, lost_N = _lost(u, v, np.zeros(len(psi)), vessel)
    across = lost_Y - (wind[1] * c - wind[0] * s)
    X = lost_X - (wind[0] * c + wind[1] * s)
    N = (vessel.m22 - vessel.m11) * v * u + lost_N
    balanced = np.flatnonzero(across[:-1] * across[1:] <= 0.0)
    share = np.maximum(
        np.where(X >= 0.0, X, math.inf) / (REST_SHARE * a.surge_force_limit), np.abs(N) / (MAX_LIMIT_SHARE * a.yaw_moment_limit)
    )
    smallest = float(np.min(share[balanced], initial=math.inf)) if len(balanced) else math.inf
    return "" if smallest <= 1.0 or not (np.any(current) or np.any(wind)) else "the loads at rest need too much force"


SAMPLES = 1200  # of the steady motion on a leg, in steps of T/20; the heading settles in the first and the last third
SPEEDS = 50  # places of a leg at which its speed is read


class Leg(NamedTuple):
    """The straight part of a leg."""

    number: int  # from 0 on
    way: float  # arc length at which it begins, from the last stop on, m
    # begin, end: its ends, m
    begin: complex
    end: complex
    course: float  # rad
    speed: float  # the largest over ground, m/s


def legs_of(track: PlannedTrack) -> list[Leg]:
    """The legs of a plan in their order; of one in several parts, the whole."""
    found: dict[int, Leg] = {}
    for one in track.stretches:
        end = 0.0
        for element in one.route.elements:
            begin, end = end, end + element.length
            if element.leg == NO_LEG or (element.turn and element.leg in found):
                continue
            last = begin if element.turn else end  # of a leg that its corners take whole, the turn alone is left
            speed = float(one.profile.at(one.profile.time_at(np.linspace(begin, last, SPEEDS)))[1].max())
            a, b = map(complex, one.route.position(np.array([begin, last])))
            leg = found.get(element.leg, Leg(element.leg, begin, a, b, float(one.route.course(begin)), speed))
            found[element.leg] = leg._replace(end=b, speed=max(leg.speed, speed))
    return list(found.values())


def infeasible_legs(scenario: Scenario, legs: Sequence[Leg]) -> list[str]:
    """A line for each leg that cannot be sailed in the mean wind and the current of a scenario, and for holds."""
    scale_of(scenario.vessel_sim.vessel)  # checks the limits
    reasons = {f"leg {leg.number + 1}": _why_not(scenario, leg) for leg in legs}
    path = scenario.reference_ship
    if path.mode == "path" and any(path.path.holds):
        sim = scenario.vessel_sim
        reasons["a hold"] = infeasible_rest(*mean_loads(scenario), within(sim.actuators, sim.vessel), sim.vessel.coefficients())
    return [f"infeasible on {what}: {why}" for what, why in reasons.items() if why]


def mean_loads(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Current [m/s] and mean force of the wind [N], east and north."""
    disturbance = scenario.vessel_sim.disturbance
    current, wind = disturbance.current, disturbance.earth_fixed
    return np.array([current.east, current.north]), np.array([wind.east_force, wind.north_force])


def _why_not(scenario: Scenario, leg: Leg) -> str:
    """Why a leg cannot be sailed; empty if it can."""
    sim, (current, wind) = scenario.vessel_sim, mean_loads(scenario)
    along = np.array([math.cos(leg.course), math.sin(leg.course)])
    limits = within(sim.actuators, sim.vessel)
    push = MAX_LIMIT_SHARE * limits.surge_force_limit + float(wind @ along)
    most = scale_of(replace(sim.vessel, surge_force_limit=push)).U if push > 0.0 else 0.0
    cross = abs(float(current[1] * along[0] - current[0] * along[1]))
    through = float(np.hypot(*(leg.speed * along - current)))
    has = f"the boat has {quantity(most, 'm/s')}{' in this wind' if np.any(wind) else ''}"
    if cross > most:
        return f"{quantity(cross, 'm/s')} of cross current, {has}"
    if through > most:
        return f"{quantity(leg.speed, 'm/s')} over ground takes {quantity(through, 'm/s')} through the water, {has}"
    vessel = sim.vessel.coefficients()
    h = SAMPLE * math.sqrt(vessel.m33 / limits.yaw_moment_limit)
    rows = np.zeros((SAMPLES, 9))
    rows[:, 2], rows[:, 3] = leg.course, leg.speed
    middle = slice(SAMPLES // 3, 2 * SAMPLES // 3)
    needed = demand(rows, current, wind, vessel, h)
    steady = needed._replace(**{name: getattr(needed, name)[middle] for name in needed._fields})
    if not np.all(steady.u > MIN_WAY * leg.speed):
        return "the wind turns the boat off its course"
    return exceeded(steady, limits, h)


TRACKED = 0.02  # largest position error on the circle, in lengths of the ship, with which it counts as tracked
NEGLIGIBLE = 1e-4  # position error in lengths of the ship below which its digits mean nothing
CALM: dict[str, object] = {
    "vessel_sim.disturbance.earth_fixed.east_force": 0.0,
    "vessel_sim.disturbance.earth_fixed.north_force": 0.0,
    "vessel_sim.disturbance.earth_fixed.gust_deviation": 0.0,
    "vessel_sim.disturbance.current.east": 0.0,
    "vessel_sim.sensors.position_noise": 0.0,
    "vessel_sim.sensors.position_rate_hz": 0.0,
    "controller.observer.enabled": False,
}


class ShipCheck(NamedTuple):
    """What a ship can do, and how it follows the circle of its scenario."""

    speed: float  # steady speed straight ahead under the full surge force, m/s
    fastest: float  # speed up to which the hull data are valid, m/s
    # turn_rate, turn_diameter: steady yaw rate, and diameter of the turning circle, m, under full force and moment
    turn_rate: float
    turn_diameter: float
    demand: curve_motion.Demand  # drift angle, surge force and yaw moment that the circle takes in calm water
    # surge_share, yaw_share: the last two as shares of the limits
    surge_share: float
    yaw_share: float
    error: float  # largest position error in the last quarter of the run, m
    error_lengths: float  # the same in lengths of the ship
    duration: float  # duration of that run, s
    noise: float = 0.0  # standard deviation of the measured positions, in lengths; the error may be as large as theirs

    @property
    def tracked(self) -> bool:
        """Whether the ship follows its circle."""
        return self.error_lengths <= max(TRACKED, NOISE_PEAK * self.noise)


def check_ship(scenario: Scenario) -> ShipCheck:
    """Simulate a run straight ahead, a turning circle, and the scenario itself."""
    known, circle = scenario.controller.vessel, scenario.reference_ship.circle
    # The limits that the law knows: the paper's ship has no others.
    limits = {"surge_force_limit": known.surge_force_limit, "yaw_moment_limit": known.yaw_moment_limit}
    ship = replace(scenario.vessel_sim.vessel, **limits)  # type: ignore[arg-type]
    scale = scale_of(ship)
    straight = steady(scenario, scale, 0.0)
    speed, rate = _mean_speed(turn := steady(scenario, scale, scale.N)), float(np.mean(turn.state[_last(turn, 0.1), 5]))
    needed = curve_motion.demand(circle.shape().curve, Pace(circle.speed, circle.rise_time), ship.coefficients(), LARGEST_DRIFT)
    run = simulate(scenario)
    error = float(np.max(position_error(run.state, run.reference)[_last(run, 0.25)]))
    return ShipCheck(
        speed=_mean_speed(straight),
        fastest=ship.surge_speed_range[1],
        turn_rate=rate,
        turn_diameter=2.0 * speed / abs(rate) if rate else math.inf,
        demand=needed,
        surge_share=needed.surge_force / scale.F,
        yaw_share=needed.yaw_moment / scale.N,
        error=error,
        error_lengths=error / ship.length,
        duration=float(run.time[-1]),
        noise=scenario.vessel_sim.sensors.position_noise / ship.length,
    )


def steady(scenario: Scenario, scale: Scale, yaw_moment: float) -> Run:
    """A run in calm water under the full surge force and a constant yaw moment, until the motion is steady."""
    duration = max(40.0 * scale.T, 8.0 * scale.m11 * scale.U / scale.F)
    changes = CALM | {
        "controller.law": "open_loop",
        "controller.open_loop.surge_force": [scale.F],
        "controller.open_loop.yaw_moment": [yaw_moment],
        "vessel_sim.duration": float(math.ceil(duration)),
    }
    return simulate(scenario.changed(changes))


def verdict(check: ShipCheck) -> list[str]:
    """The check in sentences."""
    c = check
    beyond = f", beyond {quantity(c.fastest, 'm/s')}, up to which its hull data hold" if c.speed > c.fastest else ""
    lines = [
        f"full surge force: {quantity(c.speed, 'm/s')}{beyond}; with the full yaw moment a turning circle of"
        f" {quantity(c.turn_diameter, 'm')} at {quantity(math.degrees(c.turn_rate), '°/s')}",
        f"the circle needs {100.0 * c.surge_share:.0f} % of the surge force, {100.0 * c.yaw_share:.0f} % of the yaw moment and a"
        f" drift angle of {math.degrees(c.demand.drift):.1f}° in calm water",
    ]
    error = f"below {100.0 * NEGLIGIBLE:g} % of the ship's length"
    if c.error_lengths >= NEGLIGIBLE:
        noise = c.noise * c.error / c.error_lengths
        relative = in_noise(c.error, noise) if noise else f"{number(100.0 * c.error_lengths)} % of the ship's length"
        error = f"at most {quantity(c.error, 'm')}, {relative},"
    result = f"position error {error} in the last quarter of {c.duration:g} s"
    return [*lines, f"{'follows its circle' if c.tracked else 'does NOT follow its circle'}: {result}"]


def _last(run: Run, share: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """The samples in the last share of a run."""
    late: np.ndarray[tuple[int], np.dtype[np.bool_]] = run.time >= (1.0 - share) * run.time[-1]
    return late


def _mean_speed(run: Run) -> float:
    """Mean speed over the last tenth of a run."""
    return float(np.mean(np.hypot(*run.state[_last(run, 0.1), 3:5].T)))

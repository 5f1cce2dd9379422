"""A family of ships on which no law was tuned: dimensionless numbers, and the scenario of one ship that they make.

A ship of the family is the paper's ship, Froude-scaled to a length, with other proportions of its inertias, damping, limits and
actuators. What its owner declares of it, its reference, its loads, sensors and rates are numbers of the family too, in the ship's
own units: length L, top speed U, T = sqrt(yaw inertia / largest yaw moment), and the largest surge force F. A campaign draws
them by the names `ship.<number>`; docs/campaigns.md explains the file. Its references have turns that the ship can make in calm
water with a reserve. With the scale lambda of the length, Froude's law keeps all motions similar: times and speeds scale with
lambda^0.5, masses and forces with lambda^3, moments with lambda^4, yaw inertia with lambda^5, and damping coefficients so that
damping scales as forces do: linear lambda^2.5, quadratic lambda^2, cubic lambda^1.5; in yaw lambda^4.5, lambda^5, lambda^5.5.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from ship_references import MAKERS, MAX_TURN_TIMES, Changes, Course, course_for

from vessel_hsmc_ros.control.interface.known_vessel import NOT_DECLARED
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.factory import trajectory
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, circle_for, coriolis_ratio, scale_of, sway_damping_rate
from vessel_hsmc_ros.simulation.compilation import compiled
from vessel_hsmc_ros.studies.forecast.feasibility import (
    MIN_FEASIBLE_SHARE,
    MIN_WAY,
    SAMPLE,
    Demand,
    demand,
    exceeded,
    infeasible_rest,
    mean_loads,
)

REFERENCES = tuple(MAKERS)

KNOWLEDGE = ("declared", "nothing", "everything", "true_values")


def _factor(what: str) -> float:
    return parameter(1.0, f"{what}, relative to the scaled ship of the paper.", low=0.01, high=100.0)


def _delay(default: float, what: str) -> float:
    return parameter(default, f"{what}, if there is any.", unit="T", low=0.0, high=10.0)


def _error(what: str) -> float:
    return parameter(1.0, f"Declared {what}, relative to the true one.", low=0.01, high=100.0)


def _switch(description: str) -> bool:
    return parameter(False, description)


def _angle(description: str) -> float:
    return parameter(0.0, description, unit="rad", low=-2.0 * math.pi, high=2.0 * math.pi)


@dataclass(frozen=True)
class ShipFamily:
    """The numbers of one ship, its owner's declarations and its day; by default the paper's ship on a circle in calm water."""

    length: float = parameter(32.0, "Length of the hull; everything else is scaled with it.", unit="m", low=0.1, high=1000.0)
    surge_to_sway_inertia: float = parameter(0.675, "m11/m22; m11 is that of the scaled ship.", low=0.1, high=2.0)
    yaw_inertia: float = _factor("Yaw inertia")
    coupled: bool = _switch("Whether sway and yaw are coupled in the inertia matrix.")
    percussion_point: float = parameter(0.0, "m23/m22, if coupled.", unit="L", low=-0.2, high=0.2)
    surge_damping: float = _factor("Damping in surge")
    sway_damping: float = _factor("Damping in sway")
    yaw_damping: float = _factor("Damping in yaw")
    surge_force_limit: float = _factor("Largest surge force")
    yaw_moment_limit: float = _factor("Largest yaw moment")

    has_lag: bool = _switch("Whether the actuators have a first-order lag.")
    has_rate: bool = _switch("Whether the actuators have a limited rate.")
    has_dead_time: bool = _switch("Whether the actuators have a dead time.")
    lag: float = _delay(0.1, "Time constant of the lag")
    time_to_full: float = _delay(1.0, "Time from zero to the limit")
    dead_time: float = _delay(0.05, "Dead time")
    surge_delays: float = parameter(1.0, "Factor on all delays in surge.", low=0.1, high=10.0)
    yaw_delays: float = parameter(1.0, "Factor on all delays in yaw.", low=0.1, high=10.0)

    knowledge: str = parameter(
        "declared",
        "What the law is given besides inertias and limits: what is declared with its errors; nothing; everything, exactly; or"
        " the true values of what is declared.",
        choices=KNOWLEDGE,
    )
    declares_lag: bool = _switch("Whether the lags are declared.")
    declares_rate: bool = _switch("Whether the rates are declared.")
    declares_dead_time: bool = _switch("Whether the dead times are declared.")
    declares_coupling: bool = _switch("Whether the coupling of sway and yaw is declared.")
    declares_sway_damping: bool = _switch("Whether sway damping rate and Coriolis ratio are declared if the hull needs them.")
    declared_lag: float = _error("lag")
    declared_rate: float = _error("rate")
    declared_dead_time: float = _error("dead time")
    declared_coupling: float = _error("coupling of sway and yaw")
    declared_sway_damping_rate: float = _error("sway damping rate")
    declared_coriolis_ratio: float = _error("Coriolis ratio")
    declared_surge_inertia: float = _error("surge inertia")
    declared_sway_inertia: float = _error("sway inertia")
    declared_yaw_inertia: float = _error("yaw inertia")

    reference: str = parameter("circle", "What the ship follows.", choices=REFERENCES)
    radius: float = parameter(6.0, "Radius of turns; an arc has four times that.", unit="L", low=0.5, high=1000.0)
    speed: float = parameter(0.5, "Speed of the reference.", unit="U", low=0.01, high=1.0)
    to_port: bool = parameter(True, "Whether the reference turns to port first.")

    has_current: bool = _switch("Whether there is a current.")
    has_wind: bool = _switch("Whether there is a wind, with gusts of a tenth of its force.")
    current: float = parameter(0.1, "Speed of the current, if there is any.", unit="U", low=0.0, high=1.0)
    current_direction: float = _angle("Direction to which the current flows; the reference begins eastward.")
    wind: float = parameter(0.1, "Force of the wind, if there is any.", unit="F", low=0.0, high=1.0)
    wind_direction: float = _angle("Direction of the force of the wind.")

    noisy: bool = _switch("Whether pose alone is measured, with noise, and the observer is on.")
    position_noise: float = parameter(0.005, "Standard deviation of a position, if noisy.", unit="L", low=1e-6, high=1.0)
    heading_noise: float = parameter(0.01, "Standard deviation of a heading, if noisy.", unit="rad", low=1e-6, high=1.0)

    control_rate_hz: float = parameter(50.0, "Rate of the control law.", unit="Hz", low=0.1, high=1000.0)
    start_distance: float = parameter(0.2, "Distance of the start from that of the reference.", unit="L", low=0.0, high=100.0)
    start_direction: float = _angle("Direction of the start from that of the reference.")
    start_heading: float = _angle("Heading at the start; that of the reference is 0.")

    def changes(self) -> Changes:
        """The changes to a scenario that make it that of the ship; always the same names."""
        return expand(self)

    @staticmethod
    def infeasible(scenario: Scenario) -> str:
        """Why no law can keep the ship of a scenario on its reference; empty if one can."""
        return infeasible(scenario)


PAPER = ShipParameters()

PAPER_LIMITS = (2e5, 3e6)  # largest surge force [N] and yaw moment [N·m] of the paper's ship; the paper itself has none
POWERS = {"": (2.5, 4.5), "_quadratic": (2.0, 5.0), "_cubic": (1.5, 5.5)}
"""Froude's powers of damping coefficients, of forces and of moments."""

STEP, SHORTEST_STEP = 0.02, 0.004  # largest period of the plant, and the shortest that a dead time makes necessary, in T
POSITION_RATE, HEADING_RATE = 5.0, 10.0  # sampling rates of noisy sensors, Hz
GUST_TIME = 4.3  # correlation time of the gusts, in T: 20 s for the paper's ship
GUSTS = 0.1  # standard deviation of the gusts relative to the mean force
SHORTEST = 120.0  # duration of a run after the start at least, in T
PERIODS = 2.0  # number of periods of the reference in a run, as far as the durations allow


class Delays(NamedTuple):
    """The true delays of an actuator: lag [s], rate [N/s or N·m/s, infinite for no limit], dead time [s]."""

    lag: float
    rate: float
    dead_time: float


class Ship(NamedTuple):
    """A ship of the family with its units, delays of surge and yaw, period of the plant [s], and its reference."""

    hull: ShipParameters
    scale: Scale
    surge: Delays
    yaw: Delays
    period: float
    course: Course


def expand(family: ShipFamily) -> Changes:
    """The changes to a scenario that make it that of a ship of the family; always the same names."""
    ship = ship_of(family)
    T, course = ship.scale.T, ship.course
    duration = min(max(SHORTEST * T, PERIODS * course.period), MAX_TURN_TIMES * T) + course.rise_time
    return {
        **_hull(ship),
        **_start(family, ship, duration),
        **_loads(family, ship),
        **_sensors(family),
        **_declared(family, ship),
        **ship.course.changes,
    }


def ship_of(family: ShipFamily) -> Ship:
    """The ship of the numbers. Raises ParameterError if no reference of this kind is feasible for it."""
    hull = hull_of(family)
    scale = scale_of(hull)
    period = _plant_period(family, scale.T)
    surge = _delays(family, family.surge_delays, scale.F, scale.T, period)
    yaw = _delays(family, family.yaw_delays, scale.N, scale.T, period)
    return Ship(hull, scale, surge, yaw, period, course_for(family, hull, scale))


def _plant_period(family: ShipFamily, T: float) -> float:
    """The period of the plant, s: a whole part of that of the law, not above STEP and the dead times."""
    dead_time = min(family.surge_delays, family.yaw_delays) * family.dead_time
    longest = T * (min(STEP, max(dead_time, SHORTEST_STEP)) if family.has_dead_time else STEP)
    rate = family.control_rate_hz
    return 1.0 / (rate * math.ceil(round(1.0 / (rate * longest), 6)))


def hull_of(family: ShipFamily) -> ShipParameters:
    """The true hull data."""
    k = family.length / PAPER.length
    force, moment = PAPER_LIMITS
    m11 = k**3 * PAPER.surge_inertia
    m22 = m11 / family.surge_to_sway_inertia
    damping = {
        f"{axis}_damping{order}": getattr(family, f"{axis}_damping") * k**power * getattr(PAPER, f"{axis}_damping{order}")
        for order, powers in POWERS.items()
        for axis, power in (("surge", powers[0]), ("sway", powers[0]), ("yaw", powers[1]))
    }
    return ShipParameters(
        length=family.length,
        beam=max(k * PAPER.beam, 0.1),
        draught=k * PAPER.draught,
        surge_inertia=m11,
        sway_inertia=m22,
        yaw_inertia=family.yaw_inertia * k**5 * PAPER.yaw_inertia,
        sway_yaw_inertia=family.percussion_point * family.length * m22 if family.coupled else 0.0,
        surge_force_limit=family.surge_force_limit * k**3 * force,
        yaw_moment_limit=family.yaw_moment_limit * k**4 * moment,
        **damping,
    )


def _delays(family: ShipFamily, own: float, limit: float, T: float, period: float) -> Delays:
    """The true delays of an actuator."""
    full = own * family.time_to_full * T
    dead = own * family.dead_time * T
    return Delays(
        own * family.lag * T if family.has_lag else 0.0,
        limit / full if family.has_rate and full > 0.0 else math.inf,
        round(dead / period) * period if family.has_dead_time else 0.0,
    )


HULL = (
    *("length", "beam", "draught", "surge_inertia", "sway_inertia", "yaw_inertia", "sway_yaw_inertia"),
    *("surge_force_limit", "yaw_moment_limit"),
    *(f"{axis}_damping{order}" for axis in ("surge", "sway", "yaw") for order in POWERS),
)
"""Names of the hull data of the family."""


def _hull(ship: Ship) -> Changes:
    hull = {f"vessel.{name}": getattr(ship.hull, name) for name in HULL}
    actuators: Changes = {}
    for axis, quantity, limit, own in (("surge", "force", ship.scale.F, ship.surge), ("yaw", "moment", ship.scale.N, ship.yaw)):
        actuators |= {f"{axis}_{quantity}_limit": limit, f"{axis}_{quantity}_rate": own.rate}
        actuators |= {f"{axis}_lag": own.lag, f"{axis}_dead_time": own.dead_time}
    return hull | {f"vessel_sim.actuators.{name}": value for name, value in actuators.items()}


def _start(family: ShipFamily, ship: Ship, duration: float) -> Changes:
    distance = family.start_distance * ship.scale.L
    x, y = distance * math.cos(family.start_direction), distance * math.sin(family.start_direction)
    rate = round(1.0 / ship.period, 9)
    return {
        "vessel_sim.rate_hz": rate,
        "reference_ship.rate_hz": rate,
        "controller.rate_hz": family.control_rate_hz,
        "vessel_sim.duration": duration,
        "vessel_sim.initial_pose": (x, y, family.start_heading),
        "reference_ship.initial_pose": (0.0, 0.0, 0.0),
    }


def _loads(family: ShipFamily, ship: Ship) -> Changes:
    current = family.current * ship.scale.U if family.has_current else 0.0
    force = family.wind * ship.scale.F if family.has_wind else 0.0
    wind = force * math.cos(family.wind_direction), force * math.sin(family.wind_direction)
    disturbance = "vessel_sim.disturbance"
    return {
        **{f"{disturbance}.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")},
        f"{disturbance}.earth_fixed.east_force": wind[0],
        f"{disturbance}.earth_fixed.north_force": wind[1],
        f"{disturbance}.earth_fixed.gust_deviation": GUSTS * math.hypot(*wind),
        f"{disturbance}.earth_fixed.gust_time_constant": GUST_TIME * ship.scale.T,
        f"{disturbance}.current.east": current * math.cos(family.current_direction),
        f"{disturbance}.current.north": current * math.sin(family.current_direction),
    }


def _sensors(family: ShipFamily) -> Changes:
    position, heading = family.position_noise * family.length, family.heading_noise
    noisy = family.noisy
    return {
        "vessel_sim.sensors.position_noise": position if noisy else 0.0,
        "vessel_sim.sensors.heading_noise": heading if noisy else 0.0,
        "vessel_sim.sensors.position_rate_hz": POSITION_RATE if noisy else 0.0,
        "vessel_sim.sensors.heading_rate_hz": HEADING_RATE if noisy else 0.0,
        "vessel_sim.sensors.measures_velocity": not noisy,
        "controller.observer.enabled": noisy,
        "controller.observer.position_noise": position,
        "controller.observer.heading_noise": heading,
    }


class Declared(NamedTuple):
    """Which optional properties are declared, and whether with their errors."""

    lag: bool
    rate: bool
    dead_time: bool
    coupling: bool
    drift: bool
    errors: bool


def declared_of(f: ShipFamily) -> Declared:
    """What the law is given by its knowledge."""
    if f.knowledge == "nothing":
        return Declared(False, False, False, False, False, True)
    if f.knowledge == "everything":
        return Declared(True, True, True, True, True, False)
    chosen = (f.declares_lag, f.declares_rate, f.declares_dead_time, f.declares_coupling, f.declares_sway_damping)
    return Declared(*chosen, f.knowledge == "declared")


def _declared(f: ShipFamily, ship: Ship) -> Changes:
    """What the law is given of the ship; limits and length are always exact."""
    d, hull = declared_of(f), ship.hull

    def given(value: float, error: float) -> float:
        return value * (error if d.errors else 1.0)

    def actuator(value: float, error: float, is_declared: bool) -> float:
        return given(value, error) if is_declared else NOT_DECLARED

    decay, ratio = _sway_dynamics(ship)
    known = d.drift and decay >= 0.0
    values = {
        "surge_inertia": given(hull.surge_inertia, f.declared_surge_inertia),
        "sway_inertia": given(hull.sway_inertia, f.declared_sway_inertia),
        "yaw_inertia": given(hull.yaw_inertia, f.declared_yaw_inertia),
        "sway_yaw_inertia": given(hull.sway_yaw_inertia, f.declared_coupling) if d.coupling else 0.0,
        "surge_lag": actuator(ship.surge.lag, f.declared_lag, d.lag),
        "yaw_lag": actuator(ship.yaw.lag, f.declared_lag, d.lag),
        "surge_force_rate": actuator(ship.surge.rate, f.declared_rate, d.rate),
        "yaw_moment_rate": actuator(ship.yaw.rate, f.declared_rate, d.rate),
        "surge_dead_time": actuator(ship.surge.dead_time, f.declared_dead_time, d.dead_time),
        "yaw_dead_time": actuator(ship.yaw.dead_time, f.declared_dead_time, d.dead_time),
        "sway_damping_rate": actuator(decay, f.declared_sway_damping_rate, known),
        "coriolis_ratio": actuator(ratio, f.declared_coriolis_ratio, known),
    }
    return {f"controller.vessel.{name}": value for name, value in values.items()}


def _sway_dynamics(ship: Ship) -> tuple[float, float]:
    """Sway damping rate and Coriolis ratio as `vessel-hsmc init` states them; the first is -1 where the hull needs neither."""
    circle = circle_for(ship.hull, ship.scale)
    return sway_damping_rate(ship.hull, ship.scale, circle), coriolis_ratio(ship.hull, circle)


BEYOND = 10.0  # time beyond the end from which the heading is integrated backwards, in T


def infeasible(scenario: Scenario) -> str:
    """Why no law can keep the ship of a scenario on its reference; empty if one can.

    The motion is feasible if |X| and |N|, their rates, and what has to be commanded through a lag are within their shares of the
    limits in the last half of the run. Gusts, noise and dead times are not considered.
    """
    sim = scenario.vessel_sim
    a, vessel = sim.actuators, sim.vessel.coefficients()
    h = SAMPLE * math.sqrt(vessel.m33 / a.yaw_moment_limit)
    samples = math.ceil(sim.duration / h)
    rows = trajectory(scenario.reference_ship, 1.0 / h, samples + math.ceil(BEYOND / SAMPLE), compiled)
    current, wind = mean_loads(scenario)
    if not np.any(rows[:, 3:5]):
        return infeasible_rest(current, wind, a, vessel)
    # From the second quarter on: at the start from rest the heading is not determined.
    needed = demand(rows[samples // 4 :], current, wind, vessel, h)
    half = slice(samples // 2 - samples // 4, samples - samples // 4)
    if np.mean(needed.u[half] > MIN_WAY * np.max(rows[:, 3])) < MIN_FEASIBLE_SHARE:
        return "the ship has no way through the water"
    return exceeded(Demand(*(column[half] for column in needed)), a, h)

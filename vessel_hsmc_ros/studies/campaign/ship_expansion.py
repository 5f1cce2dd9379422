"""The scenario of one ship of the family: hull, actuators, declarations, loads, sensors and rates as `node.parameter: value`.

With the scale lambda of the length, Froude's law keeps all motions similar: times and speeds scale with lambda^0.5, masses and
forces with lambda^3, moments with lambda^4, yaw inertia with lambda^5, and damping coefficients so that damping scales as
forces do:

    linear lambda^2.5, quadratic lambda^2, cubic lambda^1.5; in yaw lambda^4.5, lambda^5, lambda^5.5
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.known_vessel import NOT_DECLARED
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.plant.dynamics import ShipParameters
from vessel_hsmc_ros.scenario.ship_rules import Scale, circle_for, coriolis_ratio, scale_of, sway_damping_rate
from vessel_hsmc_ros.studies.campaign.ship_family import MAX_TURN_TIMES, SHIP, Course, Request, ShipFamily, course_for

Changes = dict[str, object]

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


def resolved(*layers: Mapping[str, object]) -> Changes:
    """Layers of changes in one, the later ones over the earlier ones, with the numbers of a ship of the family expanded."""
    merged = {name: value for layer in layers for name, value in layer.items()}
    numbers = {name.removeprefix(SHIP): merged.pop(name) for name in list(merged) if name.startswith(SHIP)}
    # What is changed by name stays so, whatever the expansion contains.
    return {**expand(schema.build(ShipFamily, numbers, "ship")), **merged} if numbers else merged


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
    request = Request(family.reference, family.radius * scale.L, family.speed * scale.U, 1.0 if family.to_port else -1.0)
    return Ship(hull, scale, surge, yaw, period, course_for(request, hull, scale))


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
    actuators = "vessel_sim.actuators"
    return {
        **hull,
        f"{actuators}.surge_force_limit": ship.scale.F,
        f"{actuators}.yaw_moment_limit": ship.scale.N,
        f"{actuators}.surge_force_rate": ship.surge.rate,
        f"{actuators}.yaw_moment_rate": ship.yaw.rate,
        f"{actuators}.surge_lag": ship.surge.lag,
        f"{actuators}.yaw_lag": ship.yaw.lag,
        f"{actuators}.surge_dead_time": ship.surge.dead_time,
        f"{actuators}.yaw_dead_time": ship.yaw.dead_time,
    }


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


def current_of(family: ShipFamily, scale: Scale) -> tuple[float, float]:
    """The current towards east and north, m/s."""
    speed = family.current * scale.U if family.has_current else 0.0
    return speed * math.cos(family.current_direction), speed * math.sin(family.current_direction)


def wind_of(family: ShipFamily, scale: Scale) -> tuple[float, float]:
    """The mean force of the wind towards east and north, N."""
    force = family.wind * scale.F if family.has_wind else 0.0
    return force * math.cos(family.wind_direction), force * math.sin(family.wind_direction)


def _loads(family: ShipFamily, ship: Ship) -> Changes:
    current, wind = current_of(family, ship.scale), wind_of(family, ship.scale)
    disturbance = "vessel_sim.disturbance"
    return {
        **{f"{disturbance}.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")},
        f"{disturbance}.earth_fixed.east_force": wind[0],
        f"{disturbance}.earth_fixed.north_force": wind[1],
        f"{disturbance}.earth_fixed.gust_deviation": GUSTS * math.hypot(*wind),
        f"{disturbance}.earth_fixed.gust_time_constant": GUST_TIME * ship.scale.T,
        f"{disturbance}.current.east": current[0],
        f"{disturbance}.current.north": current[1],
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

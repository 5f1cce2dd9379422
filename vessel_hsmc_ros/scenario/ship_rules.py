"""Rules that scale references to a ship, and its drift in turns: its own units of length, speed, force and time, for any hull.

| symbol | meaning | unit |
|---|---|---|
| L | length | m |
| F, N | largest surge force, largest yaw moment | N, N·m |
| m11, m22, m33 | inertia with added mass, as in (6) | kg, kg, kg·m² |
| U | top speed, at which F equals the surge damping | m/s |
| r_max | yaw rate of a turn on the spot, at which N equals the yaw damping | rad/s |
| T | unit of time of the ship's turns, sqrt(m33/N) | s |
| a | decay rate of the sway velocity, -df_v/dv at the centre of percussion | 1/s |
| rho | sway acceleration of a turn beside the centripetal one, -df_v/dr/u at the centre of percussion | - |

A turn of a hull with rho < 1 carries its course along at once, by the share 1 - rho, and all the way when the drift has
decayed. With rho near 1 it does so only then, and with rho > 1 the course turns the other way first: the law must be slower than
the decay.

The template in `config/templates/ship.yaml` states the rule beside each number.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import NOT_DECLARED
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.guidance.curve_motion import Demand, Pace, demand
from vessel_hsmc_ros.guidance.curves import Arc, Curve
from vessel_hsmc_ros.guidance.sailing import LARGEST_DRIFT, LARGEST_SHARE
from vessel_hsmc_ros.plant.dynamics import unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters

AIR_DENSITY = 1.2

LARGEST_FROUDE = 1.5  # largest Froude number U/sqrt(g·L) that is believed of the damping of a hull
LARGEST_RHO = 0.8  # largest rho with which the law may be faster than the decay of the drift
SLOW_RHO, SLOW_DECAY = 0.6, 1.0
"""The same where the decay is slow beside the ship's turns, and the a·T below which it counts as slow."""

STRAIGHT = 2.0  # largest decay rate in terms of that on a straight line, where a faster law would oscillate about it
ADJUSTMENTS = 60

SETTLED = 50.0  # duration of a run at least, in T, or in terms of 1/a where the law must be slower than the decay of the drift


class Scale(NamedTuple):
    """A ship in its own units, by the symbols above."""

    L: float
    F: float
    N: float
    U: float
    r_max: float
    m11: float
    m33: float
    T: float


class Sway(NamedTuple):
    """How a hull drifts: a, 1/s, and rho."""

    a: float
    rho: float


class Circle(NamedTuple):
    """A circle for a ship: radius, m, speed, m/s, duration of the start, s, and what it takes in calm water."""

    radius: float
    speed: float
    rise_time: float
    demand: Demand


def scale_of(ship: ShipParameters) -> Scale:
    """The units of a ship. Raises ParameterError if its propulsion has no limits, so that it has no top speed."""
    s = ship
    for name in ("surge_force_limit", "yaw_moment_limit"):
        if math.isinf(getattr(s, name)):
            raise ParameterError(f"vessel.{name} is missing: a scenario is scaled by the limits of the propulsion")
    top = steady_velocity(s.surge_force_limit, s.surge_damping, s.surge_damping_quadratic, s.surge_damping_cubic)
    turn = steady_velocity(s.yaw_moment_limit, s.yaw_damping, s.yaw_damping_quadratic, s.yaw_damping_cubic)
    T = math.sqrt(s.yaw_inertia / s.yaw_moment_limit)
    top = min(top, LARGEST_FROUDE * math.sqrt(GRAVITY * s.length), s.surge_speed_range[1])
    turn = min(turn, 1.0 / T, s.yaw_rate_range[1])
    return Scale(s.length, s.surge_force_limit, s.yaw_moment_limit, top, turn, s.surge_inertia, s.yaw_inertia, T)


def steady_velocity(load: float, linear: float, quadratic: float, cubic: float) -> float:
    """The smallest velocity at which damping equals a load, infinite if there is none."""
    roots = np.roots((cubic, quadratic, linear, -load))
    real = roots.real[(abs(roots.imag) <= 1e-9 * abs(roots)) & (roots.real > 0.0)]
    return float(min(real, default=math.inf))


def circle_for(ship: ShipParameters, scale: Scale) -> Circle:
    """A circle that a ship follows with a reserve: 5·L at U/3, wider or slower where that takes too much."""

    def rise_time(speed: float) -> float:
        return max(speed * scale.m11 / (0.25 * scale.F), 10.0)

    return feasible_turn("circle", lambda radius: Arc(1.0 / radius), (5.0 * scale.L, scale.U / 3.0), rise_time, ship, scale)


def feasible_turn(
    kind: str,
    curve: Callable[[float], Curve],
    size: tuple[float, float],
    rise_time: Callable[[float], float],
    ship: ShipParameters,
    scale: Scale,
) -> Circle:
    """The turn of a curve that a ship follows with a reserve: as tight and fast as wanted, or wider or slower.

    `curve`: makes the curve of a radius, m. `size`: radius and speed wanted, m and m/s. `rise_time`: duration of the start up
    to a speed, s.
    """
    (radius, speed), vessel = size, ship.coefficients()
    for _ in range(ADJUSTMENTS):
        needed = demand(curve(radius), Pace(speed, rise_time(speed)), vessel, LARGEST_DRIFT)
        if needed.drift > LARGEST_DRIFT or needed.yaw_moment > LARGEST_SHARE * scale.N:
            radius *= 1.25
        elif needed.surge_force > LARGEST_SHARE * scale.F:
            speed *= 0.9
        else:
            return Circle(radius, speed, rise_time(speed), needed)
    tried = f"{radius:.3g} m at {speed:.3g} m/s"
    raise ParameterError(f"no {kind} is feasible for this ship: {tried} needs more than {LARGEST_SHARE:g} of its propulsion")


def sway_damping_rate(ship: ShipParameters, scale: Scale, circle: Circle) -> float:
    """The decay rate of the drift if the law must be slower than it, else -1, 1/s.

    On a circle, quadratic damping makes the drift decay faster than on a straight line at the same speed: this is the geometric
    mean of the two, and at most STRAIGHT times the latter. With rho > 1 it is divided by rho².
    """
    turning, straight = _sways(ship, circle)
    a, rho = min(math.sqrt(turning.a * straight.a), STRAIGHT * straight.a), max(turning.rho, straight.rho)
    if rho <= (LARGEST_RHO if a * scale.T > SLOW_DECAY else SLOW_RHO):
        return NOT_DECLARED
    # With rho > 1 the course turns the other way first: a zero in the right half-plane at a/(rho - 1).
    return a / max(1.0, rho) ** 2


def coriolis_ratio(ship: ShipParameters, circle: Circle) -> float:
    """The share rho of a turn that carries the hull sideways: the larger of those on a circle and on a straight line."""
    return max(each.rho for each in _sways(ship, circle))


def _sways(ship: ShipParameters, circle: Circle) -> tuple[Sway, Sway]:
    """How a hull drifts on a circle, and on a straight line at the same speed."""
    beta = circle.demand.drift
    u, v = circle.speed * math.cos(beta), -circle.speed * math.sin(beta)
    return sway_at(ship, u, v, circle.speed / circle.radius), sway_at(ship, circle.speed, 0.0, 0.0)


def sway_at(ship: ShipParameters, u: float, v: float, r: float) -> Sway:
    """How a hull drifts near a motion with these body velocities; a and rho by central differences."""
    vessel = ship.coefficients()
    # The law controls the centre of percussion: its sway velocity is v + x_p·r, which the yaw moment does not accelerate.
    x_p = ship.sway_yaw_inertia / ship.sway_inertia

    def acceleration(dv: float, dr: float) -> float:
        _, f_v, f_r = unforced_acceleration(u, v + dv - x_p * dr, r + dr, vessel)
        return float(f_v + x_p * f_r)

    dv, dr = 1e-4 * u, 1e-4 * u / ship.length
    a = (acceleration(-dv, 0.0) - acceleration(dv, 0.0)) / (2.0 * dv)
    return Sway(a, (acceleration(0.0, -dr) - acceleration(0.0, dr)) / (2.0 * dr * u))


def loads(length: float, wind: float) -> dict[str, float]:
    """The wind: rho/2·c·A·V² on an area of 0.15·L² with c = 1, by the names of the template."""
    factor = 0.5 * AIR_DENSITY * 0.15 * length**2
    force = factor * wind**2
    return {"wind_factor": factor, "wind_force": force, "gust_deviation": 0.1 * force}


def motion_limits(s: Scale) -> dict[str, float]:
    """The limits of motions to goals and along routes, by their names in `reference_ship.motion`."""
    return {"acceleration": 0.25 * s.F / s.m11, "yaw_rate": s.r_max / 3.0, "yaw_acceleration": 0.25 * s.N / s.m33}


def references(circle: Circle, s: Scale, decay: float) -> dict[str, float]:
    """Circle and other references, and the limits of motions to goals, by the names of the template.

    A run lasts until the error of the start has decayed, and the law knows the ship. `decay`: rate at which the drift decays if
    the law must be slower than it, else -1, 1/s.
    """
    time = s.T if decay < 0.0 else max(s.T, 1.0 / decay)
    return {
        "radius": circle.radius,
        "cruise": circle.speed,
        "rise_time": circle.rise_time,
        "duration": max(4.0 * math.pi * circle.radius / circle.speed, SETTLED * time),
        "eight": 3.0 * circle.radius,
        "side": 2.0 * circle.radius,
        "leg": 20.0 * s.L,
        "spacing": 4.0 * s.L,
        "run_in": 15.0 * s.L,
        **{f"motion_{name}": value for name, value in motion_limits(s).items()},
    }

"""The gains of the guided law for any ship: dimensionless numbers times its units, slower where its actuators are slow.

| symbol | meaning | unit |
|---|---|---|
| L | length of the hull | m |
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_l, T_d | largest lag and dead time of the two inputs | s |
| T_f | longest time from zero to the limit, limit/rate | s |
| s | slowness of the actuators, from 0 to 1 | - |
| q | stretch of the time unit for actuators beyond s = 1 | - |
| a | declared sway damping rate | 1/s |

A gain is its number for instant actuators to the power 1 - s times that for slow ones to the power s. Where only some of lag,
rate and dead time are declared, it is a third number, with which the others may be slow, late or limited in rate; where none is,
a fourth. What is not declared counts as slow in the gains, whatever else is declared; the model that predicts the ship contains
only what is declared. Where the course follows the heading only as the sway decays, a bounds the gains. docs/guided.md states
where the numbers come from.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.law.known_vessel import ControlledVessel, KnownVessel

DERIVED = -1.0
"""The value of a gain that follows from the declared vessel."""

ASSUMED_LAG = 0.22
"""The lag in the model of inputs of which nothing is declared, in units of T."""

SLOWEST, LONGEST, LATEST = 0.8, 4.0, 0.17
"""Lag and dead time, time to full and dead time in units of T beyond which the unit of time is stretched."""


class Rule(NamedTuple):
    """The number of a gain and its unit, L^length·T^time.

    Attributes:
        fast, slow: The number for instant and for slow actuators.
        partly: The number for a ship of which some of lag, rate and dead time are declared.
        unknown: The number for a ship of which nothing is declared but inertia and limits.
        length, time: Powers of the units.
        stretches: Whether the unit of time is stretched for very slow actuators.
    """

    fast: float
    slow: float
    partly: float
    unknown: float
    length: int = 0
    time: int = 0
    stretches: bool = False


RULES = {
    "position_gain": Rule(1.23, 0.648, 0.328, 0.523, 0, -1, True),
    "approach_speed": Rule(0.173, 0.173, 0.173, 0.173, 1, -1),
    "integral_gain": Rule(0.206, 0.09, 0.026, 0.12, 0, -2, True),
    "integral_limit": Rule(0.0144, 0.0144, 0.0144, 0.0144, 1, -1),
    "heading_surface_slope": Rule(1.13, 0.828, 0.623, 0.639, 0, -1, True),
    "sway_share": Rule(0.64, 0.569, 0.265, 0.62),
    "sway_bandwidth": Rule(2.43, 0.196, 0.207, 0.1, 0, -1, True),
    "turn_acceleration_share": Rule(0.465, 0.051, 0.072, 0.05),
    "turn_rate_limit": Rule(1.15, 0.48, 1.35, 0.28, 0, -1, True),
    "command_bandwidth": Rule(43.0, 7.6, 3.86, 1.32, 0, -1, True),
    "command_integral": Rule(0.078, 0.0735, 0.071, 0.082),
    "yaw_reaching_gain": Rule(10.3, 8.7, 4.23, 8.8, 0, -1, True),
    "surge_reaching_gain": Rule(6.45, 6.45, 3.33, 7.1, 0, -1, True),
    "surge_learning_rate": Rule(9.2, 9.2, 5.83, 9.2, 0, -1, True),
    "sway_learning_rate": Rule(14.0, 10.1, 8.58, 20.0, 0, -1, True),
    "yaw_learning_rate": Rule(12.0, 7.9, 1.6, 8.5, 0, -1, True),
    "forecast_bandwidth": Rule(0.78, 0.756, 0.1, 0.1, 0, -1, True),
    "position_filter": Rule(6.9, 6.9, 4.19, 6.9, 0, -1),
    "heading_filter": Rule(13.8, 13.8, 48.3, 13.8, 0, -1),
    "slew_time": Rule(0.195, 0.0, 0.0, 0.0, 0, 1),
    "station_keeping_lever": Rule(0.0056, 0.0041, 0.00343, 0.0045, 1, 0),
    "station_keeping_lever_time": Rule(0.65, 0.65, 0.65, 0.65, 0, 1),
    "station_keeping_heading_gain": Rule(0.14, 0.14, 0.14, 0.14, 0, -1),
    "station_keeping_speed": Rule(0.0029, 0.0029, 0.0029, 0.0029, 1, -1),
    "station_keeping_disturbance": Rule(0.0033, 0.0033, 0.0033, 0.0033, 1, -2),
    "backing_distance": Rule(1.6, 1.6, 1.6, 1.6, 1, 0),
}
"""The rule of each gain of the guided law, by its name."""


POSITION_BOUND, SURFACE_BOUND = 0.5, 2.0
"""Largest position gain and slope of the heading surface in terms of a."""

INTEGRAL_SHARE = 0.25
"""Integral gain on the position error in terms of the position gain squared, where a bounds it."""


class Input(NamedTuple):
    """What the law takes an input for.

    Attributes:
        lag: T_l, s.
        remaining: The lag that remains with the lead against it, s.
        rate: Largest rate of change, N/s or N·m/s, or infinity.
        dead_time: Dead time, s.
        full: Time from zero to the limit, s.
    """

    lag: float
    remaining: float
    rate: float
    dead_time: float
    full: float


class Dynamics(NamedTuple):
    """The dynamics of the two inputs.

    Attributes:
        surge, yaw: Of surge force and yaw moment.
        s, q: Slowness and stretch.
        declared: Whether lag, rate and dead time of both inputs are.
        partly: Whether any of them is.
    """

    surge: Input
    yaw: Input
    s: float
    q: float
    declared: bool
    partly: bool


def unit_time(vessel: KnownVessel) -> float:
    """T, s."""
    return math.sqrt(vessel.yaw_inertia / vessel.yaw_moment_limit)


def dynamics(vessel: KnownVessel) -> Dynamics:
    """The dynamics of the inputs as the model has them, and how slow the gains must be."""
    T = unit_time(vessel)
    of_surge = vessel.surge_lag, vessel.surge_force_rate, vessel.surge_dead_time
    of_yaw = vessel.yaw_lag, vessel.yaw_moment_rate, vessel.yaw_dead_time
    given = [value >= 0.0 for value in (*of_surge, *of_yaw)]
    assumed = 0.0 if any(given) else ASSUMED_LAG * T
    surge = _input(*of_surge, vessel.surge_force_limit, assumed, T)
    yaw = _input(*of_yaw, vessel.yaw_moment_limit, assumed, T)
    latest = max(surge.dead_time, yaw.dead_time) / T
    slowest = max(surge.lag + surge.dead_time, yaw.lag + yaw.dead_time) / T
    longest = max(surge.full, yaw.full) / T
    # Where the pivot is known within a fifth, the moment accelerates the controlled point by a fifth of x_p.
    x_p = vessel.ahead if isinstance(vessel, ControlledVessel) else 0.0
    s = max(_ramp(slowest, 0.04, 0.1), _ramp(longest, 0.25, 0.6), _ramp(x_p / vessel.length, 0.12, 0.2))
    q = max(1.0, slowest / SLOWEST, longest / LONGEST, latest / LATEST)
    return Dynamics(surge, yaw, s if all(given) else 1.0, q, all(given), any(given))


def _input(lag: float, rate: float, dead_time: float, limit: float, assumed: float, T: float) -> Input:
    """What the law takes an input for.

    Args:
        lag, rate, dead_time: As declared, negative where they are not.
        limit: Largest magnitude.
        assumed: Lag where it is not declared, s.
        T: Unit of time, s.
    """
    if lag < 0.0:
        # A lag that is not known is not led against: what is missing may be a dead time, and lead against that oscillates.
        lag = remaining = assumed
    else:
        remaining = max(0.2 * lag, min(lag, 0.05 * T))
    fastest = rate if rate > 0.0 else math.inf
    return Input(lag, remaining, fastest, max(dead_time, 0.0), limit / fastest)


def _ramp(value: float, low: float, high: float) -> float:
    """0 below `low`, 1 above `high`, and linear between."""
    return min(max((value - low) / (high - low), 0.0), 1.0)


def derived(name: str, vessel: KnownVessel, d: Dynamics) -> float:
    """A gain by the rule.

    Args:
        name: Name of the gain.
        vessel: What is declared of the ship.
        d: The dynamics of its inputs.
    """
    rule = RULES[name]
    T = unit_time(vessel) * (d.q if rule.stretches else 1.0)
    number = rule.partly if d.partly else rule.unknown
    if d.declared:
        number = rule.fast ** (1.0 - d.s) * rule.slow**d.s
    gain = number * vessel.length**rule.length * T**rule.time
    return min(gain, bound(name, vessel)) if vessel.sway_damping_rate >= 0.0 else gain


def bound(name: str, vessel: KnownVessel) -> float:
    """The largest value of a gain for the declared sway damping rate: the law has to wait until the course has followed."""
    k_p, c = POSITION_BOUND * vessel.sway_damping_rate, SURFACE_BOUND * vessel.sway_damping_rate
    bounds = {"position_gain": k_p, "heading_surface_slope": c, "integral_gain": INTEGRAL_SHARE * k_p**2}
    # Fed forward, the sway would come back about once as large, faster than it decays; a forecast makes slow hulls turn in wind.
    bounds |= {"sway_share": 0.0, "sway_bandwidth": 0.0, "forecast_bandwidth": 0.0}
    return bounds.get(name, math.inf)


def derived_gains(vessel: KnownVessel) -> dict[str, float]:
    """All gains of the rule for a ship, by their names."""
    d = dynamics(vessel)
    return {name: derived(name, vessel, d) for name in RULES}

"""The gains of the guided law for any ship: dimensionless numbers times the units of the ship, slower where its actuators are slow.

| symbol | meaning | unit |
|---|---|---|
| L | length of the hull | m |
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_l, T_d | largest lag and dead time of the two inputs | s |
| T_f | longest time from zero to the limit, limit/rate | s |
| s | slowness of the actuators, from 0 to 1 | - |
| q | stretch of the time unit for actuators beyond s = 1 | - |

A gain is its number for instant actuators to the power 1 - s times that for slow ones to the power s. What is not declared counts
as slow. docs/guided.md states where the numbers come from.
"""

import dataclasses
import math
from typing import NamedTuple

from vessel_hsmc_ros.laws.known_vessel import KnownVessel

DERIVED = -1.0
"""The value of a gain that follows from the declared vessel."""

ASSUMED_LAG = 0.22
"""The lag of an input of which none is declared, in units of T."""


class Rule(NamedTuple):
    """The number of a gain and its unit, L^length·T^time.

    Attributes:
        fast, slow: The number for instant and for slow actuators.
        unknown: The number for a ship of which nothing is declared but inertia and limits.
        length, time: Powers of the units.
        stretches: Whether the unit of time is stretched for very slow actuators.
    """

    fast: float
    slow: float
    unknown: float
    length: int = 0
    time: int = 0
    stretches: bool = False


RULES = {
    "position_gain": Rule(1.52, 0.69, 0.51, 0, -1, True),
    "approach_speed": Rule(0.173, 0.173, 0.173, 1, -1),
    "drift_gain": Rule(0.233, 0.233, 0.233, 0, -2, True),
    "drift_limit": Rule(0.0144, 0.0144, 0.0144, 1, -1),
    "heading_surface_slope": Rule(1.93, 1.29, 0.645, 0, -1, True),
    "sway_share": Rule(0.62, 0.62, 0.85),
    "turn_acceleration_share": Rule(0.4, 0.05, 0.05),
    "turn_rate_limit": Rule(1.15, 0.37, 0.37, 0, -1, True),
    "command_bandwidth": Rule(9.2, 4.6, 1.34, 0, -1, True),
    "command_integral": Rule(0.1, 0.1, 0.1),
    "yaw_reaching_gain": Rule(8.3, 8.3, 8.3, 0, -1, True),
    "surge_reaching_gain": Rule(6.45, 6.45, 6.45, 0, -1, True),
    "surge_learning_rate": Rule(9.2, 9.2, 9.2, 0, -1, True),
    "sway_learning_rate": Rule(13.8, 13.8, 13.8, 0, -1, True),
    "yaw_learning_rate": Rule(8.3, 8.3, 8.3, 0, -1, True),
    "position_filter": Rule(6.9, 6.9, 6.9, 0, -1),
    "heading_filter": Rule(13.8, 13.8, 13.8, 0, -1),
    "slew_time": Rule(0.0, 0.0, 0.0, 0, 1),
    "resting_lever": Rule(0.0056, 0.0056, 0.0056, 1, 0),
    "resting_lever_time": Rule(0.65, 0.65, 0.65, 0, 1),
    "resting_heading_gain": Rule(0.14, 0.14, 0.14, 0, -1),
    "resting_speed": Rule(0.0029, 0.0029, 0.0029, 1, -1),
    "resting_push": Rule(0.0033, 0.0033, 0.0033, 1, -2),
    "backing_distance": Rule(1.6, 1.6, 1.6, 1, 0),
}
"""The rule of each gain of the guided law, by its name."""


class Dynamics(NamedTuple):
    """What the law takes the two inputs for: surge first, then yaw.

    Attributes:
        lag, remaining: T_l, and the lag that remains with the lead, s.
        rate: Largest rates of change, N/s and N·m/s, or infinity.
        dead_time: Dead times, s.
        s, q: Slowness and stretch.
        declared: Whether anything is declared of them.
    """

    lag: tuple[float, float]
    remaining: tuple[float, float]
    rate: tuple[float, float]
    dead_time: tuple[float, float]
    s: float
    q: float
    declared: bool


def unit_time(vessel: KnownVessel) -> float:
    """T, s."""
    return math.sqrt(vessel.yaw_inertia / vessel.yaw_moment_limit)


def dynamics(vessel: KnownVessel) -> Dynamics:
    """The dynamics of the inputs with assumptions for what is not declared."""
    T = unit_time(vessel)
    lags, dead = (vessel.surge_lag, vessel.yaw_lag), (vessel.surge_dead_time, vessel.yaw_dead_time)
    rates, limits = (vessel.surge_force_rate, vessel.yaw_moment_rate), (vessel.surge_force_limit, vessel.yaw_moment_limit)
    declared = any(value >= 0.0 for value in (*lags, *rates))
    lag = tuple(each if each >= 0.0 else ASSUMED_LAG * T for each in lags)
    dead_time = tuple(max(each, 0.0) for each in dead)
    rate = tuple(each if each > 0.0 else math.inf for each in rates)
    # Of a lag that is not known no more than half is led against: too much lead would be worse than none.
    left = tuple(
        max(0.2 * each, min(each, 0.065 * T)) if known >= 0.0 else 0.5 * each for each, known in zip(lag, lags, strict=True)
    )
    full = max(limit / each for limit, each in zip(limits, rate, strict=True))
    slowest = max(lag) + max(dead_time)
    s = max(_ramp(slowest / T, 0.04, 0.1), _ramp(full / T, 0.25, 0.6))
    q = max(1.0, slowest / (0.45 * T), full / (2.2 * T))
    return Dynamics(lag, left, rate, dead_time, s if declared else 1.0, q, declared)


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
    number = rule.fast ** (1.0 - d.s) * rule.slow**d.s if d.declared else rule.unknown
    return number * vessel.length**rule.length * T**rule.time


def with_derived(parameters: object, vessel: KnownVessel) -> dict[str, float]:
    """The gains of a law by their names, with the rule's values for those that are not set by hand.

    Args:
        parameters: A dataclass with a field for each rule.
        vessel: What is declared of the ship.
    """
    d = dynamics(vessel)
    given = {field.name: getattr(parameters, field.name) for field in dataclasses.fields(parameters) if field.name in RULES}  # type: ignore[arg-type]
    return {name: derived(name, vessel, d) if value < 0.0 else value for name, value in given.items()}

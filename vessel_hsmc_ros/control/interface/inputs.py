"""The dynamics of surge force and yaw moment, as a law takes them: declared, or assumed where nothing is.

| symbol | meaning | unit |
|---|---|---|
| T | time of the ship's turns, sqrt(m33/tau_2max) | s |
| T_l, T_d | lag and dead time of an input | s |
| T_r | lag that remains with the lead against it | s |
| T_f | time from zero to the limit, limit/rate | s |
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel

ASSUMED_LAG = 0.22  # the lag in the model of inputs of which nothing is declared, in units of T


class Input(NamedTuple):
    """What the law takes an input for."""

    lag: float  # T_l, s
    remaining: float  # T_r, s
    rate: float  # largest rate of change, N/s or N·m/s, or infinity
    dead_time: float  # T_d, s
    full: float  # T_f, s


class Dynamics(NamedTuple):
    """The dynamics of the two inputs."""

    # surge, yaw: of surge force and yaw moment
    surge: Input
    yaw: Input
    declared: bool  # whether lag, rate and dead time of both inputs are


def unit_time(vessel: KnownVessel) -> float:
    """T, s."""
    return math.sqrt(vessel.yaw_inertia / vessel.yaw_moment_limit)


def dynamics(vessel: KnownVessel) -> Dynamics:
    """The dynamics of the inputs as the model has them."""
    T = unit_time(vessel)
    of_surge = vessel.surge_lag, vessel.surge_force_rate, vessel.surge_dead_time
    of_yaw = vessel.yaw_lag, vessel.yaw_moment_rate, vessel.yaw_dead_time
    given = [value >= 0.0 for value in (*of_surge, *of_yaw)]
    assumed = 0.0 if any(given) else ASSUMED_LAG * T
    surge = _input(*of_surge, vessel.surge_force_limit, assumed, T)
    yaw = _input(*of_yaw, vessel.yaw_moment_limit, assumed, T)
    return Dynamics(surge, yaw, all(given))


def _input(lag: float, rate: float, dead_time: float, limit: float, assumed: float, T: float) -> Input:
    """What the law takes an input for.

    `lag`, `rate`, `dead_time`: as declared, negative where they are not. `assumed`: lag where it is not declared, s. `T`: unit
    of time, s.
    """
    if lag < 0.0:
        # A lag that is not known is not led against: what is missing may be a dead time, and lead against that oscillates.
        lag = remaining = assumed
    else:
        remaining = max(0.2 * lag, min(lag, 0.05 * T))
    fastest = rate if rate > 0.0 else math.inf
    return Input(lag, remaining, fastest, max(dead_time, 0.0), limit / fastest)

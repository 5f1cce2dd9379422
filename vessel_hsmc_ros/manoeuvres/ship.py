"""The ship of a scenario in still water, and the scales by which its manoeuvres are planned.

| symbol | meaning | unit |
|---|---|---|
| L | length | m |
| X_max, N_max | largest surge force and yaw moment | N, N·m |
| X(u) | surge force of a steady straight run at the speed u | N |
| U, V | top speed, X(U) = X_max; test speed, X(V)·V = 0.85·X_max·U | m/s |
| r_N | yaw rate of a steady turn on the spot under N_max | rad/s |
| T | unit of time: the largest of m11·V/X(V), m33·r_N/N_max and L/V | s |

The resolution defines the test speed as at least 90 % of the speed at 85 % of the largest engine output; V is the latter, with the
power of the surge force as the output. X(u) and r_N are roots of the equations of motion, so they hold for every hull.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.report.record import limits
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_sim_node.plant import derivative

OUTPUT = 0.85
"""Share of the largest output at which the manoeuvres begin."""

FASTEST = 1e3
"""A ship has no steady speed below this: its hull data contain no damping, m/s or rad/s."""

PER_LENGTH = 500.0
"""Steps while the ship travels its length: the zig-zag reverses the rudder at a step."""

RATES_HZ = (10.0, 20.0, 50.0, 100.0, 200.0)

CALM: dict[str, object] = {
    f"vessel_sim.disturbance.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")
}
"""What the empty scenario lacks to still water: by default the disturbance is the paper's."""

SHIP = {"vessel_sim": ("vessel.", "actuators."), "reference_ship": ("vessel.",), "controller": ("vessel.",)}
"""The parameters of a scenario that describe its ship, by node and prefix."""


@dataclass(frozen=True)
class Ship:
    """A ship in still water with its scales.

    Attributes:
        name: Of the vessel or scenario.
        scenario: The ship without disturbances, sensors perfect, at rest at the origin.
        length, largest_force, largest_moment, top_speed, speed, approach_force: L, X_max, N_max, U, V, X(V).
        turn_rate: r_N.
        time: T.
        delay: Time in which the actuators reach their limits: lags and rates, s.
        rate_hz: Rate of plant and law.
    """

    name: str
    scenario: Scenario
    length: float
    largest_force: float
    largest_moment: float
    top_speed: float
    speed: float
    approach_force: float
    turn_rate: float
    time: float
    delay: float
    rate_hz: float


def ship_named(name: str | Path, changes: dict[str, object] | None = None) -> Ship:
    """The ship of a scenario, of which nothing else is taken.

    Args:
        name: A scenario or a parameters file.
        changes: Values by `node.parameter`, or `vessel.parameter` for all nodes.

    Raises:
        ScenarioError: the scenario is unknown or unreadable.
        ParameterError: a parameter is unknown, or the ship has no limits or no damping.
    """
    return ship_of(load_scenario(name, changes))


def ship_of(scenario: Scenario) -> Ship:
    """The ship of a scenario in still water.

    Raises:
        ParameterError: it has no limits or no damping.
    """
    given = {
        f"{node}.{name}": value
        for node, prefixes in SHIP.items()
        for name, value in schema.flatten(getattr(scenario, node)).items()
        if name.startswith(prefixes)
    }
    calm = parse_scenario("{}", scenario.name, CALM | given)
    surge, yaw = (min(limit.value for limit in found) for found in limits(calm))
    hull = calm.vessel_sim.vessel
    m11, m33 = hull.surge_inertia, hull.yaw_inertia
    U = _root(lambda u: surge - _resistance(calm, u), "surge")
    V = _root(lambda u: OUTPUT * surge * U - _resistance(calm, u) * u, "surge")
    r_N = _root(lambda r: yaw - _yaw_resistance(calm, r), "yaw")
    X = _resistance(calm, V)
    T = max(m11 * V / X, m33 * r_N / yaw, hull.length / V)
    return Ship(
        scenario.name, calm, hull.length, surge, yaw, U, V, X, r_N, T, _delay(calm, surge, yaw), _rate(hull.length / V)
    )


def _resistance(scenario: Scenario, u: float) -> float:
    """X(u), N."""
    return -scenario.vessel_sim.vessel.surge_inertia * _acceleration(scenario, u, 0.0, 3)


def _yaw_resistance(scenario: Scenario, r: float) -> float:
    """The yaw moment of a steady turn on the spot, N·m."""
    return -scenario.vessel_sim.vessel.yaw_inertia * _acceleration(scenario, 0.0, r, 5)


def _acceleration(scenario: Scenario, u: float, r: float, index: int) -> float:
    """An element of the unforced rate of the state."""
    state = np.array([0.0, 0.0, 0.0, u, 0.0, r])
    return float(derivative(state, np.zeros(2), np.zeros(3), scenario.vessel_sim.vessel.coefficients())[index])


def _root(surplus: Callable[[float], float], direction: str) -> float:
    """The lowest speed at which the surplus of force is no longer positive."""
    high = 1e-3
    while surplus(high) > 0.0:
        high *= 1.2
        if high > FASTEST:
            raise ParameterError(
                f"the ship has no steady speed in {direction} under its limit: its damping there is too small, or the limit too large"
            )
    return float(brentq(surplus, 0.0, high, xtol=1e-14, rtol=1e-14))


def _delay(scenario: Scenario, force: float, moment: float) -> float:
    """Time for the actuators to go from one limit to the other by their rates, and five time constants of their lags, s."""
    a = scenario.vessel_sim.actuators
    return max(2.0 * force / a.surge_force_rate + 5.0 * a.surge_lag, 2.0 * moment / a.yaw_moment_rate + 5.0 * a.yaw_lag)


def _rate(passage: float) -> float:
    """The rate for a ship that passes its length in a time, s."""
    wanted = PER_LENGTH / passage
    return next((rate for rate in RATES_HZ if rate >= wanted), RATES_HZ[-1])

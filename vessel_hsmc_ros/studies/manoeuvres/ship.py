"""The ship of a scenario in still water, and the scales by which its manoeuvres are planned.

| symbol | meaning | unit |
|---|---|---|
| L | length | m |
| X_max, N_max | largest surge force and yaw moment | N, N·m |
| X(u) | surge force of a steady straight run at the speed u | N |
| U | top speed, X(U) = X_max, or the end of the range of the hull data | m/s |
| V | test speed, X(V)·V = 0.85·X(U)·U | m/s |
| r_N | yaw rate of a steady turn on the spot under N_max | rad/s |
| T | unit of time: the largest of m11·V/X(V), m33·r_N/N_max and L/V | s |

The resolution defines the test speed as at least 90 % of the speed at 85 % of the largest engine output; V is the latter, with
the power of the surge force as the output. U, V and r_N are roots of the hull's damping, so they scale with every hull.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, Thruster, ThrusterLayout
from vessel_hsmc_ros.plant.dynamics import damping_force
from vessel_hsmc_ros.report.record import limits
from vessel_hsmc_ros.scenario.ros_yaml import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.vessels import vessel_names

OUTPUT = 0.85  # share of the largest output at which the manoeuvres begin
MAX_STEADY_SPEED = 1e3  # a ship has no steady speed below this: its hull data contain no damping, m/s or rad/s
SUFFIXES = (".yaml", ".yml")

CALM: dict[str, object] = {
    "controller.law": "manoeuvre",
    "reference_ship.surge_force": 0.0,
    "reference_ship.yaw_moment": 0.0,
    **{f"vessel_sim.disturbance.periodic.{name}": 0.0 for name in ("surge_force", "sway_force", "yaw_moment")},
}
"""What the empty scenario lacks: by default, disturbance and virtual ship are the paper's. The manoeuvres follow no reference."""

SHIP = {"vessel_sim": ("vessel.", "actuators."), "reference_ship": ("vessel.",), "controller": ("vessel.",)}
"""The parameters of a scenario that describe its ship, by node and prefix."""


@dataclass(frozen=True)
class Ship:
    """A ship in still water with its scales."""

    name: str  # of the vessel or scenario
    scenario: Scenario  # the ship without disturbances, sensors perfect, at rest at the origin
    # length, largest_force, largest_moment, top_speed, speed: L, X_max, N_max, U, V
    length: float
    largest_force: float
    largest_moment: float
    top_speed: float
    speed: float
    # top_force, approach_force: X(U), X(V)
    top_force: float
    approach_force: float
    astern_force: float  # largest surge force astern, at most X_max; without a layout of thrusters X_max
    turn_rate: float  # r_N
    time: float  # T
    delay: float  # time in which the actuators reach their limits: lags and rates, s


def ship_named(name: str | Path, changes: Mapping[str, object] | None = None) -> Ship:
    """A vessel, or the ship of a scenario, of which nothing else is taken.

    Args:
        name: A vessel of the library, a scenario, or the path of a vessel file or a parameters file.
        changes: Values by `node.parameter`, or `vessel.parameter` for all nodes.

    Raises:
        ScenarioError: there is no such vessel or scenario, or its file is unreadable.
        ParameterError: a parameter is unknown, or the ship has no limits or no damping.
    """
    if is_vessel(name):
        return ship_of(in_still_water(Path(name).stem, {"vessel": str(name), **(changes or {})}))
    if Path(name).suffix not in SUFFIXES and name not in scenario_names():
        known = ", ".join((*vessel_names(), *scenario_names()))
        raise ScenarioError(f"{name} is neither a vessel nor a scenario: it must be one of {known} or the path of a YAML file")
    return ship_of(load_scenario(name, changes))


def in_still_water(name: str, ship: Mapping[str, object]) -> Scenario:
    """A scenario with a ship at rest in still water, which follows no reference.

    `ship`: the parameters of the ship, by `node.parameter`, or `vessel.parameter` for all nodes. Raises ScenarioError,
    ParameterError as `load_scenario`.
    """
    return parse_scenario("{}", name, {**CALM, **ship})


def is_vessel(name: str | Path) -> bool:
    """Whether a name is that of a vessel of the library, or of a file with a section `vessel` at its top level."""
    path = Path(name)
    if path.suffix not in SUFFIXES or not path.is_file():
        return str(name) in vessel_names()
    try:
        document = read_yaml(read_text(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return False  # the reader of scenarios reports it
    return isinstance(document, dict) and "vessel" in document


def ship_of(scenario: Scenario) -> Ship:
    """The ship of a scenario in still water. Raises ParameterError if it has no limits or no damping."""
    given = {
        f"{node}.{name}": value
        for node, prefixes in SHIP.items()
        for name, value in schema.flatten(getattr(scenario, node)).items()
        if name.startswith(prefixes)
    }
    calm = in_still_water(scenario.name, given)
    surge, yaw = (min(limit.value for limit in found) for found in limits(calm))
    hull = calm.vessel_sim.vessel
    coefficients = hull.coefficients()

    def resistance(u: float) -> float:
        return damping_force(u, 0.0, 0.0, coefficients)[0]

    U = min(_root(lambda u: surge - resistance(u), "surge"), hull.surge_speed_range[1])
    V = _root(lambda u: OUTPUT * resistance(U) * U - resistance(u) * u, "surge")
    r_N = _root(lambda r: yaw - damping_force(0.0, 0.0, r, coefficients)[2], "yaw")
    X = resistance(V)
    T = max(hull.surge_inertia * V / X, hull.yaw_inertia * r_N / yaw, hull.length / V)
    name, delay = hull.name or scenario.name, _delay(calm, surge, yaw)
    return Ship(name, calm, hull.length, surge, yaw, U, V, resistance(U), X, _astern(hull.thrusters, surge), r_N, T, delay)


def _root(surplus: Callable[[float], float], direction: str) -> float:
    """The lowest speed at which the surplus of force is no longer positive."""
    high = 1e-3
    while surplus(high) > 0.0:
        high *= 1.2
        if high > MAX_STEADY_SPEED:
            raise ParameterError(
                f"the ship has no steady speed in {direction} under its limit: the damping is too small or the limit too large"
            )
    from scipy.optimize import brentq  # SciPy's import takes time

    return float(brentq(surplus, 0.0, high, xtol=1e-14, rtol=1e-14))


def _astern(layout: ThrusterLayout, limit: float) -> float:
    """The surge force of all thrusters at full thrust astern, N, within the limit ahead, N."""
    if not (thrusters := layout.thrusters()):
        return limit
    return min(limit, sum(map(_thrust_astern, thrusters)))


def _thrust_astern(thruster: Thruster) -> float:
    """The largest force astern of a thruster, N; an azimuth that turns all the way round points its thrust ahead there."""
    if thruster.kind == AZIMUTH and thruster.angle_limit >= ALL_ROUND:
        return max(thruster.thrust_ahead, thruster.thrust_astern)
    share = math.cos(thruster.angle) if thruster.kind == FIXED else 1.0
    return share * thruster.thrust_astern if share >= 0.0 else -share * thruster.thrust_ahead


def _delay(scenario: Scenario, force: float, moment: float) -> float:
    """Time for the actuators to go from one limit to the other by their rates, and five time constants of their lags, s."""
    a = scenario.vessel_sim.actuators
    return max(2.0 * force / a.surge_force_rate + 5.0 * a.surge_lag, 2.0 * moment / a.yaw_moment_rate + 5.0 * a.yaw_lag)

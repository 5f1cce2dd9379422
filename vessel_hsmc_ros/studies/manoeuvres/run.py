"""The manoeuvres of a ship in still water: the scales by which they are planned, their scenarios, their runs.

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
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, ScenarioError, SimulationError
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, Thruster, ThrusterLayout
from vessel_hsmc_ros.plant.dynamics import damping_force
from vessel_hsmc_ros.report.record import limits
from vessel_hsmc_ros.scenario.ros_yaml import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.vessels import vessel_names
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.manoeuvres.metrics import METRICS, Metrics, Track, is_complete, track_of

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
    """A vessel, or the ship of a scenario, of which nothing else is taken."""
    if is_vessel(name):
        return ship_of(in_still_water(Path(name).stem, {"vessel": str(name), **(changes or {})}))
    if Path(name).suffix not in SUFFIXES and name not in scenario_names():
        known = ", ".join((*vessel_names(), *scenario_names()))
        raise ScenarioError(f"{name} is neither a vessel nor a scenario: it must be one of {known} or the path of a YAML file")
    return ship_of(load_scenario(name, changes))


def in_still_water(name: str, ship: Mapping[str, object]) -> Scenario:
    """A scenario with a ship at rest in still water, which follows no reference."""
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


MOORED = 1e12  # surge inertia of the ship of the bollard pull, which keeps it from moving, kg
SETTLING = 5.0  # time to settle in units of T
STEPS_PER_LENGTH, STEPS_WHEN_STEADY = 500.0, 50.0
"""Control steps while the ship travels its length: many, because a zig-zag reverses the rudder at a step; fewer where only steady
states count."""

RATES_HZ = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)

SPIRAL_STEPS, SPEED_STEPS = 15, 8


class Plan(NamedTuple):
    """What a manoeuvre needs."""

    settings: dict[str, object]  # parameters of the law
    duration: float  # estimated time from the execute to the end, s
    hold: float = 0.0  # estimated time of each step, s; 0 for manoeuvres without steps
    moored: bool = False  # whether the ship is kept at rest


def _zigzag(ship: Ship, angle_deg: float) -> Plan:
    settings: dict[str, object] = {"kind": "zigzag", "rudder_deg": angle_deg, "switch_heading_deg": angle_deg}
    return Plan(settings, 4.0 * (ship.time + ship.delay + 4.0 / ship.turn_rate))


def _spiral(ship: Ship) -> Plan:
    hold = SETTLING * ship.time + ship.delay
    return Plan({"kind": "spiral", "steps": SPIRAL_STEPS}, (2 * SPIRAL_STEPS - 1) * hold, hold)


def _speed_run(ship: Ship) -> Plan:
    hold = SETTLING * ship.time + ship.delay
    return Plan({"kind": "speed_run", "steps": SPEED_STEPS}, SPEED_STEPS * hold, hold)


PLANS: dict[str, Callable[[Ship], Plan]] = {
    "turning_circle": lambda ship: Plan(
        {"kind": "turning_circle"}, 3.0 * math.pi / ship.turn_rate + SETTLING * ship.time + ship.delay
    ),
    "zigzag_10": lambda ship: _zigzag(ship, 10.0),
    "zigzag_20": lambda ship: _zigzag(ship, 20.0),
    "spiral": _spiral,
    "crash_stop": lambda ship: Plan({"kind": "crash_stop"}, 2.0 * ship.time + ship.delay),
    "speed_run": _speed_run,
    "bollard_pull": lambda ship: Plan({"kind": "bollard_pull"}, ship.time + 2.0 * ship.delay, moored=True),
}
"""The manoeuvres by their names."""


def approach_time(ship: Ship, name: str) -> float:
    """Duration of the approach, which begins at the test speed: the actuators settle, and with them the speed, s."""
    return 0.0 if name in ("speed_run", "bollard_pull") else SETTLING * ship.time + ship.delay


def rate(ship: Ship, plan: Plan) -> float:
    """Rate of plant and law, Hz: the lowest of RATES_HZ with enough steps while the ship travels its length."""
    needed = (STEPS_WHEN_STEADY if plan.hold else STEPS_PER_LENGTH) * ship.speed / ship.length
    return next((each for each in RATES_HZ if each >= needed), RATES_HZ[-1])


def scenario_of(ship: Ship, name: str, stretch: float = 1.0, side: str = "starboard") -> Scenario:
    """The scenario of a manoeuvre."""
    plan = PLANS[name](ship)
    approach, rate_hz = approach_time(ship, name), rate(ship, plan)
    settings: dict[str, object] = {
        **plan.settings,
        "side": side,
        "approach_time": approach,
        "astern_share": ship.astern_force / ship.largest_force,
        "approach_share": ship.approach_force / ship.largest_force,
    }
    if plan.hold:
        settings["hold_time"] = stretch * plan.hold
    changes: dict[str, object] = {
        **{f"{node}.rate_hz": rate_hz for node in ("vessel_sim", "reference_ship", "controller")},
        "vessel_sim.duration": math.ceil(rate_hz * (approach + stretch * plan.duration)) / rate_hz,
        **{f"{node}.initial_pose": (0.0, 0.0, 0.0) for node in ("vessel_sim", "reference_ship")},
        "vessel_sim.initial_velocity": (ship.speed if approach else 0.0, 0.0, 0.0),
        "controller.law": "manoeuvre",
        **{f"controller.manoeuvre.{key}": value for key, value in settings.items()},
        # The law commands shares of the smallest of all limits.
        "controller.vessel.surge_force_limit": ship.top_force if name == "speed_run" else ship.largest_force,
        "controller.vessel.yaw_moment_limit": ship.largest_moment,
    }
    if plan.moored:
        changes["vessel_sim.vessel.surge_inertia"] = MOORED
    return ship.scenario.changed(changes)


Progress = Callable[[str, int, int], None]

STRETCHES = (1.0, 2.0, 4.0, 8.0)
"""A manoeuvre that is not complete in its estimated time is simulated again with these factors of it."""


@dataclass(frozen=True)
class Manoeuvre:
    """A simulated manoeuvre."""

    name: str
    scenario: Scenario  # its scenario, which the nodes can run as well
    track: Track  # from the execute on
    metrics: Metrics  # by their names; NaN for what was not reached
    complete: bool  # whether all metrics were reached, and the steady ones are steady
    failure: str = ""  # why the simulation ended early, in one line; empty if it did not


@dataclass(frozen=True)
class Results:
    """The manoeuvres of a ship by their names."""

    ship: Ship
    manoeuvres: dict[str, Manoeuvre]

    @property
    def metrics(self) -> dict[str, Metrics]:
        """The metrics by manoeuvre and name."""
        return {name: each.metrics for name, each in self.manoeuvres.items()}


def run(
    ship: Ship | Scenario, kinds: Iterable[str] = tuple(PLANS), progress: Progress | None = None, side: str = "starboard"
) -> Results:
    """Simulate manoeuvres of a ship in still water, each for as long as it takes."""
    names = list(kinds)
    for name in names:
        if name not in PLANS:
            raise ParameterError(f"manoeuvre {name} is unknown: it must be any of {', '.join(PLANS)}")
    scaled = ship_of(ship) if isinstance(ship, Scenario) else ship
    found = {}
    for number, name in enumerate(names):
        if progress:
            progress(name, number, len(names))
        found[name] = perform(scaled, name, side)
    return Results(scaled, found)


def perform(ship: Ship, name: str, side: str = "starboard") -> Manoeuvre:
    """Simulate a manoeuvre until it is complete, at most for the last of STRETCHES times the estimated duration."""
    for stretch in STRETCHES[:-1]:
        done = _once(scenario_of(ship, name, stretch, side), name)
        if done.complete or done.failure:
            return done
    return _once(scenario_of(ship, name, STRETCHES[-1], side), name)


def _once(scenario: Scenario, name: str) -> Manoeuvre:
    settings = scenario.controller.manoeuvre
    try:
        track = track_of(simulate(scenario), scenario)
    except (ControlError, SimulationError) as error:
        return Manoeuvre(name, scenario, Track(*np.full((len(Track._fields), 1), np.nan)), {}, False, str(error))
    metrics = METRICS[settings.kind](track, settings)
    return Manoeuvre(name, scenario, track, metrics, is_complete(track, settings, metrics))

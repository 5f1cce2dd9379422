"""The manoeuvres of a ship: their scenarios in its own units of time, simulated offline on the compiled loop, and evaluated."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, SimulationError
from vessel_hsmc_ros.scenario.scenario import Scenario
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.manoeuvres.metrics import METRICS, Metrics, Track, is_complete, track_of
from vessel_hsmc_ros.studies.manoeuvres.ship import Ship, ship_of

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
    """The scenario of a manoeuvre.

    `stretch`: factor of the estimated durations.
    """
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
    """Simulate manoeuvres of a ship in still water, each for as long as it takes.

    Args:
        ship: The ship, as `ship_named` gives it, or a scenario, of which only the ship is taken.
        kinds: Names of manoeuvres, of PLANS.
        progress: Called before each manoeuvre with its name, its number and their count.
        side: Side of the first turn.

    Raises:
        ParameterError: a manoeuvre is unknown, or the ship has no limits or no damping.
    """
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

"""The manoeuvres of a ship, simulated offline on the compiled loop and evaluated."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, SimulationError
from vessel_hsmc_ros.manoeuvres.metrics import METRICS, Metrics, Track, is_complete, track_of
from vessel_hsmc_ros.manoeuvres.plan import PLANS, scenario_of
from vessel_hsmc_ros.manoeuvres.ship import Ship, ship_of
from vessel_hsmc_ros.runs.offline import simulate
from vessel_hsmc_ros.scenario.scenario import Scenario

Progress = Callable[[str, int, int], None]

STRETCHES = (1.0, 2.0, 4.0, 8.0)
"""A manoeuvre that is not complete in its estimated time is simulated again with these factors of it."""


@dataclass(frozen=True)
class Manoeuvre:
    """A simulated manoeuvre.

    Attributes:
        name: One of PLANS.
        scenario: Its scenario, which the nodes can run as well.
        track: From the execute on.
        metrics: By their names; NaN for what was not reached.
        complete: Whether all metrics were reached, and the steady ones are steady.
        failure: Why the simulation ended early, in one line; empty if it did not.
    """

    name: str
    scenario: Scenario
    track: Track
    metrics: Metrics
    complete: bool
    failure: str = ""


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
            raise ParameterError(f"manoeuvre {name} is unknown: it takes any of {', '.join(PLANS)}")
    scaled = ship_of(ship) if isinstance(ship, Scenario) else ship
    found = {}
    for number, name in enumerate(names):
        if progress:
            progress(name, number, len(names))
        found[name] = perform(scaled, name, side)
    return Results(scaled, found)


def perform(ship: Ship, name: str, side: str = "starboard") -> Manoeuvre:
    """Simulate a manoeuvre until it is complete, at most for the last of STRETCHES times the estimated duration.

    Args:
        ship: The ship.
        name: Of the manoeuvre, one of PLANS.
        side: Side of the first turn.
    """
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

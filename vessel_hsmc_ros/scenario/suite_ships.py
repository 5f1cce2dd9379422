"""Ships of a suite, given by their main data: their scenarios are those of `vessel-hsmc init`, and numbers may be in their units.

    ships:
      dinghy: {length: 5.0, mass: 900.0, surge_force_limit: 1.5e+3, yaw_moment_limit: 1.8e+3}
    rows:
      - {name: circle, ships: [dinghy], set: {vessel_sim.disturbance.current.north: {U: 0.15}}, at_most: {L: 0.05}}

The units are L, the length; U, the top speed; T, the time of the ship's turns; and L/U.
"""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of

UNITS = ("L", "U", "T", "L/U")


class SuiteShip(NamedTuple):
    """A ship of a suite: its scenario as changes by `node.parameter`, and its units in m, m/s and s."""

    changes: Mapping[str, object]
    units: Mapping[str, float]


def ship_of(name: str, data: Any, where: str) -> SuiteShip:
    """The ship of main data.

    Args:
        name: Its name.
        data: Main data by their names, those of `vessel-hsmc init`.
        where: The file, for error messages.

    Raises:
        ScenarioError: the data are no numbers by name.
        ParameterError: a datum is unknown or out of range.
    """
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ScenarioError(f"{where}: ship {name} = {data} is not allowed: it takes main data such as {{length: 5.0}}")
    try:
        return _ship(name, schema.build(MainData, data, "ships"))
    except ParameterError as error:
        raise ParameterError(f"{where}: ship {name}: {error}") from None


@lru_cache(maxsize=32)
def _ship(name: str, data: MainData) -> SuiteShip:
    scenario = parse_scenario(scenario_text(name, data), name, source=f"the scenario of {name}")
    changes: dict[str, object] = {}
    for node in ("vessel_sim", "reference_ship", "controller"):
        values = schema.flatten(getattr(scenario, node))
        changes |= {f"{node}.{key}": value for key, value in values.items() if f"{node}.{key}" in scenario.given}
    scale = scale_of(scenario.vessel_sim.vessel)
    return SuiteShip(changes, {"L": scale.L, "U": scale.U, "T": scale.T, "L/U": scale.L / scale.U})


def in_numbers(value: Any, units: Mapping[str, float], where: str) -> Any:
    """A value whose number or numbers may be in a unit of a ship, such as `{L: 0.02}`.

    Args:
        value: As in the file.
        units: Those of the ship; empty where there is none.
        where: What the value belongs to, for error messages.

    Raises:
        ScenarioError: there is no such unit, or it is not one of numbers.
    """
    if not isinstance(value, dict):
        return value
    unit, given = next(iter(value.items()), ("", 0.0))
    numbers: list[Any] = given if isinstance(given, list) else [given]
    known = unit in units and len(value) == 1
    if not known or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
        takes = f"{{{'|'.join(units)}: number or list of numbers}}" if units else "no unit without a ship"
        raise ScenarioError(f"{where}: {value} is not allowed: it takes {takes}")
    found = [x * units[unit] for x in numbers]
    return found if isinstance(given, list) else found[0]

"""A suite: a list of cases with limits of their position error, and the evaluation of a run against these limits.

A suite is a YAML file with the parameters to `set` for all of its rows, and the rows:

    set: {vessel_sim.duration: 400.0, controller.rate_hz: 50.0}
    rows:
      - {name: straight, set: {reference_ship.yaw_moment: 0.0}, over: last_quarter, at_most: 0.01}

A row may name its `scenario` (default: case2_tracking) and limits: `at_most` of the rms position error over a window at the end
of the run, `largest` of the largest position error in that window, and `excursion` of the largest position error of the entire
run as a multiple of the initial one. A path or a survey may limit the rms cross-track error on its planned legs by
`legs_at_most`. A row with `variants` stands for a row for each of these named changes:

    variants:
      slow rudder: {vessel_sim.actuators.yaw_lag: 2.0}
    rows:
      - {name: circle, variants: [slow rudder], at_most: 0.01}

A row with `ships` stands for a row for each of these ships, given by their main data: their scenarios are those of
`vessel-hsmc init`, and numbers may be in their units, L, the length; U, the top speed; T, the time of the ship's turns; and L/U:

    ships:
      dinghy: {length: 5.0, mass: 900.0, surge_force_limit: 1.5e+3, yaw_moment_limit: 1.8e+3}
    rows:
      - {name: circle, ships: [dinghy], set: {vessel_sim.disturbance.current.north: {U: 0.15}}, at_most: {L: 0.05}}
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.metrics import Run, position_error, rms, summarise
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.guidance.planned_track import PlannedTrack, clock, track_errors
from vessel_hsmc_ros.scenario.named_files import SUITES
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_text
from vessel_hsmc_ros.scenario.parameters_file import parsed
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import scale_of

SCENARIO = "case2_tracking"

WINDOWS = {"last_quarter": 0.75, "last_half": 0.5}  # the windows at the end of a run, and the fraction of the run before each


@dataclass(frozen=True)
class Row:
    """One case of a suite."""

    name: str  # name of the row in tables
    scenario: str = SCENARIO  # scenario it is derived from
    changes: Mapping[str, object] = field(default_factory=dict)  # changed values by `node.parameter`
    over: str = "last_quarter"  # window in which the limits hold, one of WINDOWS
    at_most: float | None = None  # limit of the rms position error in the window, m; None for no limit
    largest: float | None = None  # limit of the largest position error in the window, m
    excursion: float | None = None  # limit of the largest position error of the entire run, as a multiple of the initial one
    legs_at_most: float | None = None  # limit of the rms cross-track error on the planned legs, m


class Verdict(NamedTuple):
    """Evaluation of a run against the limits of its row."""

    # rms, largest: position errors in the window of the row, m
    rms: float
    largest: float
    excursion: float  # largest position error of the run as a multiple of the initial one
    legs: float  # cross-track error on the planned legs, rms, m; infinite where there are none
    hit: bool  # whether every limit holds


def judge(row: Row, run: Run, track: PlannedTrack | None = None) -> Verdict:
    """Evaluate a run against the limits of its row; without limits every finite run is a hit.

    `track`: its planned legs; None where there are none.
    """
    distance = position_error(run.state, run.reference)
    begin = run.time[0] + WINDOWS[row.over] * (run.time[-1] - run.time[0])
    late = distance[run.time >= begin]
    # The lower bound prevents a division by zero for a run that starts on its reference.
    excursion = float(distance.max() / max(distance[0], 1e-9))
    planned = clock(track, run.time, run.reference) if track else run.time
    legs = summarise(track_errors(track, planned, run.state[:, :2])).leg_cross_track_rms if track else None
    values = rms(late), float(late.max()), excursion, math.inf if legs is None else legs
    limits = row.at_most, row.largest, row.excursion, row.legs_at_most
    # NaN compares as false, so a run that is not finite misses every limit.
    hit = all(limit is None or value <= limit for value, limit in zip(values, limits, strict=True))
    return Verdict(*values, hit)


def load_suite(name: str | Path) -> tuple[Row, ...]:
    """Read the rows of a suite.

    `name`: a suite of the package, such as `guided`, or the path of a YAML file.
    """
    path = SUITES.find(name)
    document = parsed(SUITES.read(path), f"suite file {path}")
    if not isinstance(document, dict) or not document.keys() <= set(PARTS) or not isinstance(document.get("rows"), list):
        raise ScenarioError(f"suite file {path} is not a suite: its keys must be {', '.join(PARTS)}")
    shared, variants = _changes(document, f"suite file {path}"), document.get("variants") or {}
    if not isinstance(variants, dict) or not all(isinstance(changes, dict) for changes in variants.values()):
        raise ScenarioError(f"variants of suite file {path} are malformed: each must be changes by name")
    ships = document.get("ships") or {}
    if not isinstance(ships, dict):
        raise ScenarioError(f"ships of suite file {path} are malformed: each must be main data by name")
    entries = (each for entry in document["rows"] for each in _expanded(entry, variants, path))
    return tuple(_row(each, shared, path, ship) for entry in entries for each, ship in _on_ships(entry, ships, path))


def _expanded(entry: Any, variants: Mapping[str, Mapping[str, object]], path: Path) -> list[Any]:
    """The rows that an entry stands for: one for each of its variants, whose changes override its own."""
    if not isinstance(entry, dict) or "variants" not in entry:
        return [entry]
    rest = {key: value for key, value in entry.items() if key != "variants"}
    name, rows = rest.get("name"), []
    changes = _changes(rest, f"row {name} of {path}")
    if not isinstance(entry["variants"], list):
        raise ScenarioError(f"{path}: variants of row {name} must be a list of names (got {entry['variants']})")
    for variant in entry["variants"]:
        if not isinstance(variant, str) or variant not in variants:
            known = ", ".join(map(str, variants)) or "none"
            raise ScenarioError(f"{path}: variant {variant} of row {name} is unknown: the suite has {known}")
        rows.append({**rest, "name": f"{name}, {variant}", "set": {**changes, **variants[variant]}})
    return rows


UNITS = ("L", "U", "T", "L/U")


class SuiteShip(NamedTuple):
    """A ship of a suite: its scenario as changes by `node.parameter`, and its units in m, m/s and s."""

    changes: Mapping[str, object]
    units: Mapping[str, float]


def ship_of(name: str, data: Any, where: str) -> SuiteShip:
    """The ship of main data.

    `data`: main data by their names, those of `vessel-hsmc init`.
    """
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise ScenarioError(f"{where}: ship {name} must be main data such as {{length: 5.0}} (got {data})")
    try:
        return _ship(name, schema.build(MainData, data, "ships"))
    except ParameterError as error:
        raise ParameterError(f"{where}: ship {name}: {error}") from None


@lru_cache(maxsize=32)
def _ship(name: str, data: MainData) -> SuiteShip:
    scenario = parse_scenario(scenario_text(name, data), name, source=f"the scenario of {name}")
    changes: dict[str, object] = {}
    for node in (PLANT, REFERENCE, CONTROLLER):
        values = schema.flatten(getattr(scenario, node))
        changes |= {f"{node}.{key}": value for key, value in values.items() if f"{node}.{key}" in scenario.given}
    scale = scale_of(scenario.vessel_sim.vessel)
    return SuiteShip(changes, {"L": scale.L, "U": scale.U, "T": scale.T, "L/U": scale.L / scale.U})


def in_numbers(value: Any, units: Mapping[str, float], where: str) -> Any:
    """A value whose number or numbers may be in a unit of a ship, such as `{L: 0.02}`.

    `units`: those of the ship; empty where there is none.
    """
    if not isinstance(value, dict):
        return value
    unit, given = next(iter(value.items()), ("", 0.0))
    numbers: list[Any] = given if isinstance(given, list) else [given]
    known = unit in units and len(value) == 1
    if not known or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers):
        allowed = f"{{{'|'.join(units)}: number or list of numbers}}" if units else "without a unit, as the row has no ship"
        raise ScenarioError(f"{where} must be {allowed} (got {value})")
    found = [x * units[unit] for x in numbers]
    return found if isinstance(given, list) else found[0]


def _on_ships(entry: Any, ships: Mapping[str, object], path: Path) -> list[tuple[Any, SuiteShip]]:
    """The rows that an entry stands for: one for each of its ships, or itself without one."""
    if not isinstance(entry, dict) or "ships" not in entry:
        return [(entry, NO_SHIP)]
    rest = {key: value for key, value in entry.items() if key != "ships"}
    name, names = rest.get("name"), entry["ships"]
    if not isinstance(names, list) or not all(isinstance(ship, str) and ship in ships for ship in names):
        known = ", ".join(map(str, ships)) or "none"
        raise ScenarioError(f"{path}: ships of row {name} must be a list of the suite's ships, {known} (got {names})")
    where = f"suite file {path}"
    return [({**rest, "name": f"{name}, {ship}"}, ship_of(ship, ships[ship], where)) for ship in names]


def _changes(holder: Mapping[str, Any], where: str) -> dict[str, object]:
    """The changes `set` of a suite, or of one of its rows."""
    changes = holder.get("set") or {}
    if not isinstance(changes, dict) or not all(isinstance(name, str) for name in changes):
        raise ScenarioError(f"set of {where} must be values by node.param (got {changes})")
    return changes


PARTS = ("set", "variants", "ships", "rows")
KEYS = ("name", "scenario", "set", "over", "at_most", "largest", "excursion", "legs_at_most")
_LIMITS = ("at_most", "largest", "excursion", "legs_at_most")


NO_SHIP = SuiteShip({}, {})


def _row(entry: Any, shared: Mapping[str, object], path: Path, ship: SuiteShip = NO_SHIP) -> Row:
    """Make a row; its own changes override the shared ones, and these those of its ship."""
    if not isinstance(entry, dict) or "name" not in entry or not entry.keys() <= set(KEYS):
        raise ScenarioError(f"{path}: row must have a name and any of {', '.join(KEYS[1:])}, variants, ships (got {entry})")
    name = str(entry["name"])
    over = entry.get("over", "last_quarter")
    if not isinstance(over, str) or over not in WINDOWS:
        raise ScenarioError(f"{path}: over of row {name} must be one of {', '.join(WINDOWS)} (got {over})")
    limits: dict[str, float] = {}
    for key in _LIMITS:
        if entry.get(key) is not None:
            # YAML reads `on` and `yes` as flags, and bool is a subclass of int: `at_most: yes` would pass as 1.
            limit = in_numbers(entry[key], ship.units, f"{path}: {key} of row {name}")
            if isinstance(limit, bool) or not isinstance(limit, int | float) or not 0.0 < limit < math.inf:
                raise ScenarioError(f"{path}: {key} of row {name} must be a number above 0 (got {entry[key]})")
            limits[key] = float(limit)
    # Later entries of a dict display win: the changes of the row override the shared ones.
    given = {**shared, **_changes(entry, f"row {name} of {path}")}
    changes = {
        **ship.changes,
        **{key: in_numbers(value, ship.units, f"{path}: {key} of row {name}") for key, value in given.items()},
    }
    return Row(name, str(entry.get("scenario", SCENARIO)), changes, over, **limits)

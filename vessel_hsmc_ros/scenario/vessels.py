"""The library of vessels: hull data, inputs and thrusters of published ships, each in a YAML file with its source.

A vessel file has the hull data in a section `vessel`, by the names that they have in a scenario, and optionally name,
description, source, checks and published figures. Coefficients that it leaves out are zero; the limits, lags and rates of its
inputs serve as the plant's actuators too.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.control.interface.known_vessel import NOT_DECLARED, KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.schema import Entry, Value
from vessel_hsmc_ros.plant.devices import ActuatorParameters
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.named_files import VESSELS
from vessel_hsmc_ros.scenario.parameters_file import VESSEL, VESSEL_NAME, flat, parsed

ACTUATORS = "actuators."  # prefix of the plant's actuators
PAPERS_SHIP = "paper_ship"

PERIODIC_FORCES = tuple(f"disturbance.periodic.{force}" for force in ("surge_force", "sway_force", "yaw_moment"))

SECTIONS = ("name", "description", "source", "checks", "published", "vessel")

REQUIRED = (
    "length",
    "beam",
    "surge_inertia",
    "sway_inertia",
    "yaw_inertia",
    "surge_damping",
    "sway_damping",
    "yaw_damping",
)
"""What a vessel file must give; the paper's values would be wrong for another ship."""

DRAUGHT_FACTOR = 0.2  # draught in terms of the beam, where a vessel file leaves it out; only waves use it


@dataclass(frozen=True)
class LibraryVessel:
    """A vessel of the library, or of a file of one's own."""

    key: str  # the name of its file without the ending, by which scenarios refer to a vessel of the library
    name: str  # its name in words
    description: str
    values: Mapping[str, Value]  # hull data by their names in a scenario, `vessel.length` and so on
    mass: float | None  # mass without added mass, kg; None where the file does not state it
    source: Mapping[str, str]  # citation, doi, url, table, licence
    verified: tuple[str, ...]  # what agrees with the source
    unverified: tuple[str, ...]  # what could not be checked
    published: Mapping[str, float]  # figures that the source states
    path: Path = field(repr=False)

    def hull(self) -> ShipParameters:
        """The hull data as parameters of the plant."""
        entries = schema.entries(ShipParameters, VESSEL)
        own = {name.removeprefix(VESSEL): value for name, value in _of_hull(self, entries).items()}
        return schema.build(ShipParameters, own, f"vessel file {self.path}: vessel")


vessel_names = VESSELS.names


def read_vessel(name: str | Path, folder: Path = Path()) -> LibraryVessel:
    """Read a vessel.

    `name`: a vessel of the library, such as `otter`, or the path of a vessel file. `folder`: where a relative path starts, if
    a file is there; else in the working directory.
    """
    path = VESSELS.find(name, folder)
    return _parsed(VESSELS.read(path), path)


def with_vessel(values: Mapping[str, object], entries: Mapping[str, Entry], folder: Path = Path()) -> dict[str, object]:
    """The values of a node, preceded by those of the vessel that they name.

    `values`: values by their dotted names; those given override those of the vessel. `folder`: where the path of a vessel
    file starts.
    """
    name = values.get(VESSEL_NAME)
    # Flags describe no hull: they are choices of the scenario.
    hull = [each for each, entry in entries.items() if each.startswith(VESSEL) and entry.type is not bool]
    # A resolved scenario states every value, and needs the file no more.
    if not isinstance(name, str) or not name or all(each in values for each in hull):
        return dict(values)
    vessel = read_vessel(name, folder)
    own: dict[str, object] = {**_of_hull(vessel, {each: entries[each] for each in hull}), **values}
    own[VESSEL_NAME] = vessel.key if vessel.path == VESSELS.path(vessel.key) else str(vessel.path.resolve())
    # The default periodic forces are scaled to the paper's ship, and would throw a boat out of the water.
    calm = {name: 0.0 for name in PERIODIC_FORCES if name in entries and vessel.key != PAPERS_SHIP}
    return _of_actuators(own, vessel, entries) | calm | own


def _of_actuators(own: Mapping[str, object], vessel: LibraryVessel, entries: Mapping[str, Entry]) -> dict[str, object]:
    """The plant's actuators, by dotted names: the limits that the node was given for the hull, the others of the vessel."""
    declared = {name: entries[f"{ACTUATORS}{name}"] for name in _inputs() if f"{ACTUATORS}{name}" in entries}
    theirs = {name: vessel.values.get(f"{VESSEL}{name}", _neutral(entry)) for name, entry in declared.items()}
    return {f"{ACTUATORS}{name}": own.get(f"{VESSEL}{name}", value) for name, value in theirs.items()}


def _of_hull(vessel: LibraryVessel, entries: Mapping[str, Entry]) -> dict[str, Value]:
    """What a node declares of the hull, by dotted names, with neutral values for what the file leaves out."""
    return {name: vessel.values.get(name, _neutral(entry)) for name, entry in entries.items()}


def _inputs() -> list[str]:
    """The limits, rates and lags of surge force and yaw moment, which hull and actuators share."""
    return [name for name in schema.entries(ActuatorParameters) if name.startswith(("surge_", "yaw_"))]


@cache
def hull_data() -> dict[str, tuple[Entry, ...]]:
    """The hull data that a vessel file may give, as declared by plant, laws and actuators."""
    groups = [schema.entries(ShipParameters), schema.entries(KnownVessel)]
    groups.append({name: schema.entries(ActuatorParameters)[name] for name in _inputs()})
    data = (name for group in groups for name, entry in group.items() if entry.type is not bool and name != "name")
    names = dict.fromkeys(data)
    return {name: tuple(group[name] for group in groups if name in group) for name in names}


def _neutral(entry: Entry) -> Value:
    """The value of what a vessel file leaves out: no damping and no coupling, and the node's default for all else."""
    return 0.0 if "_damping" in entry.name and entry.default != NOT_DECLARED else entry.default


# Read again only when its text has changed: a campaign names the same vessel in thousands of runs.
@cache
def _parsed(text: str, path: Path) -> LibraryVessel:
    place = f"vessel file {path}"
    document = parsed(text, place)
    if not isinstance(document, dict) or not isinstance(document.get("vessel"), dict):
        raise ScenarioError(f"{place} is not a vessel: it needs a section `vessel` with hull data")
    for section in document:
        if section not in SECTIONS:
            raise ScenarioError(f"{place}: {section} is not a section: {schema.suggestion(str(section), SECTIONS)}")
    try:
        given = flat(document["vessel"])
    except ParameterError as error:
        raise ScenarioError(f"{place}: {error}") from None
    mass = given.pop("mass", None)
    checks = _section(document, "checks", place)
    return LibraryVessel(
        key=path.stem,
        name=str(document.get("name", path.stem)),
        description=str(document.get("description", "")),
        values={f"{VESSEL}{name}": value for name, value in _checked(given, place).items()},
        mass=None if mass is None else _mass(mass, place),
        source={key: str(value) for key, value in _section(document, "source", place).items()},
        verified=tuple(map(str, checks.get("verified") or ())),
        unverified=tuple(map(str, checks.get("unverified") or ())),
        published={name: _figure(name, value, place) for name, value in _section(document, "published", place).items()},
        path=path,
    )


def _section(document: Mapping[str, Any], name: str, place: str) -> Mapping[str, Any]:
    """A section of names and values, which may be left out."""
    section = document.get(name) or {}
    if not isinstance(section, dict):
        raise ScenarioError(f"{place}: {name} must be names and values (got {section})")
    return section


def _figure(name: str, value: object, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or not value:
        raise ParameterError(f"{place}: published.{name} must be a finite number other than 0 (got {value})")
    return float(value)


def _checked(given: Mapping[str, Any], place: str) -> dict[str, Value]:
    """The hull data of a vessel file in their declared types."""
    allowed = hull_data()
    owner = f"{place}: vessel"
    for name in given:
        if name not in allowed:
            raise ParameterError(f"{owner}.{name} is not a hull datum: {schema.suggestion(name, allowed)}")
    for name in REQUIRED:
        if name not in given:
            raise ParameterError(f"{owner}.{name} is missing: it must be {allowed[name][0].allowed}")
    # Several nodes declare the same datum; each has limits of its own.
    checked: dict[str, Value] = {}
    for name, value in given.items():
        for entry in allowed[name]:
            checked[name] = schema.check(entry, value, owner)
    return {"draught": DRAUGHT_FACTOR * float(given["beam"])} | checked


def _mass(mass: object, place: str) -> float:
    if isinstance(mass, bool) or not isinstance(mass, int | float) or not mass > 0.0:
        raise ParameterError(f"{place}: vessel.mass must be a number above 0 kg (got {mass})")
    return float(mass)

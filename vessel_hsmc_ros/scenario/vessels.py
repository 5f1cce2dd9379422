"""The library of vessels: hull data, inputs and thrusters of published ships, each in a YAML file with its source.

A vessel file has the hull data in a section `vessel`, by the names that they have in a scenario, and optionally name,
description, source, checks and published figures. Coefficients that it leaves out are zero; the limits, lags and rates of its
inputs serve as the plant's actuators too.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vessel_hsmc_ros.control.interface.known_vessel import NOT_DECLARED, KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.schema import Entry, Value, shown, suggestion
from vessel_hsmc_ros.plant.devices import ActuatorParameters
from vessel_hsmc_ros.plant.dynamics import Vessel, damping_force, derivative
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters, largest_gain
from vessel_hsmc_ros.scenario.parameters_file import VESSEL, VESSEL_NAME, flat, in_one_line, read_text, read_yaml

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


def vessel_names() -> list[str]:
    """The vessels that come with the package."""
    return sorted(path.stem for path in (share_directory() / "config" / "vessels").glob("*.yaml"))


def read_vessel(name: str | Path, folder: Path = Path()) -> LibraryVessel:
    """Read a vessel.

    `name`: a vessel of the library, such as `otter`, or the path of a vessel file. `folder`: where a relative path starts, if
    a file is there; else in the working directory.
    """
    path = _find(name, folder)
    try:
        text = read_text(path)
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"vessel file {path} cannot be read: {in_one_line(error)}") from None
    return _parsed(text, path)


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
    own[VESSEL_NAME] = vessel.key if vessel.path == _in_library(vessel.key) else str(vessel.path.resolve())
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


def _find(name: str | Path, folder: Path) -> Path:
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        for candidate in (folder / path, path):
            if candidate.is_file():
                return candidate
        raise ScenarioError(f"vessel file {path} does not exist")
    known = vessel_names()
    if str(name) not in known:
        near = schema.meant(str(name), known)
        raise ScenarioError(f"vessel {name} is unknown: it must be one of {', '.join(known)} or the path of a YAML file{near}")
    return _in_library(str(name))


def _in_library(key: str) -> Path:
    return share_directory() / "config" / "vessels" / f"{key}.yaml"


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
    try:
        document = read_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{place} cannot be read: {in_one_line(error)}") from None
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


CALM = (0.0, 0.0, 0.0)

AGREEMENT = 0.05  # largest relative difference from a published figure that counts as agreement
COARSE = {"towing_surge_damping": 0.3, "towing_sway_damping": 0.3}
"""The same for figures that come from measurements of another loading condition."""

TOWING = 0.2  # largest speed of the towing tests, m/s


def figure(unit: str, words: str) -> Any:
    """Declare a figure with its unit and meaning, for tables."""
    return field(metadata={"unit": unit, "words": words})


@dataclass(frozen=True)
class Figures:
    """Figures of a vessel in calm water; NaN where a limit that they need is not given."""

    surge_force: float = figure("N", "largest surge force")
    yaw_moment: float = figure("N·m", "largest yaw moment")
    top_speed: float = figure("m/s", "steady speed at the largest surge force")
    half_speed: float = figure("m/s", "steady speed at half of it")
    start_acceleration: float = figure("m/s²", "acceleration at rest by the largest surge force")
    turning_rate: float = figure("rad/s", "steady yaw rate on the spot by the largest yaw moment")
    turn_radius: float = figure(
        "lengths", "radius of the steady turn at the largest surge force and a quarter of the largest yaw moment"
    )
    turn_speed: float = figure("m/s", "speed in this turn")
    turn_drift: float = figure("rad", "drift angle in this turn, positive with the stern outward")
    sway_time_constant: float = figure("s", "m22/d_v")
    yaw_time_constant: float = figure("s", "m33/d_r")
    towing_surge_damping: float = figure("kg/s", f"linear fit of the surge damping up to {TOWING:g} m/s")
    towing_sway_damping: float = figure("kg/s", f"linear fit of the sway damping up to {TOWING:g} m/s")
    percussion_point: float = figure("m", "centre of percussion m23/m22 ahead of the origin")
    mass_ratio: float = figure("", "m11/m22")
    energy_gain: float = figure("1/s", "largest rate at which damping adds energy in the range of validity; 0: it removes energy")


def figures(vessel: LibraryVessel) -> Figures:
    """Compute the figures of a vessel."""
    hull = vessel.hull()
    v = hull.coefficients()
    X, N = (limit if math.isfinite(limit) else math.nan for limit in (hull.surge_force_limit, hull.yaw_moment_limit))
    turn = steady_motion(v, X, 0.25 * N)
    speed = math.hypot(turn[0], turn[1])
    return Figures(
        surge_force=X,
        yaw_moment=N,
        top_speed=steady_speed(v, X),
        half_speed=steady_speed(v, 0.5 * X),
        start_acceleration=X / v.m11,
        turning_rate=steady_motion(v, 0.0, N)[2],
        turn_radius=_ratio(speed, abs(turn[2])) / hull.length,
        turn_speed=speed,
        turn_drift=-math.atan2(turn[1], turn[0]),
        sway_time_constant=_ratio(v.m22, v.d_v),
        yaw_time_constant=_ratio(v.m33, v.d_r),
        towing_surge_damping=_linear_fit(v.d_u, v.d_u2, v.d_u3),
        towing_sway_damping=_linear_fit(v.d_v, v.d_v2, v.d_v3),
        percussion_point=v.m23 / v.m22,
        mass_ratio=v.m11 / v.m22,
        energy_gain=gain.rate if (gain := largest_gain(hull)) else 0.0,
    )


def steady_speed(vessel: Vessel, force: float) -> float:
    """The speed ahead at which damping balances a surge force [N], m/s: the root of d_u·u + d_u2·u² + d_u3·u³ = X."""
    from scipy.optimize import brentq  # loading it takes longer than reading a vessel

    if math.isnan(force):
        return math.nan
    high = 1.0
    while damping_force(high, 0.0, 0.0, vessel)[0] < force:
        high *= 2.0
    return float(brentq(lambda u: damping_force(u, 0.0, 0.0, vessel)[0] - force, 0.0, high))


def steady_motion(vessel: Vessel, force: float, moment: float) -> tuple[float, float, float]:
    """The velocities u, v, r that a surge force [N] and a yaw moment [N·m] lead to from rest; NaN where none is reached."""
    from scipy.integrate import solve_ivp

    if math.isnan(force + moment):
        return math.nan, math.nan, math.nan

    def rates(_time: float, velocity: Any) -> Any:
        return derivative(np.array([0.0, 0.0, 0.0, *velocity]), (force, 0.0, moment), CALM, vessel)[3:]

    # Damping is weak in some hulls: a hundred time constants of the slowest motion, or of a turn on the spot.
    decays = (_ratio(vessel.m11, vessel.d_u), _ratio(vessel.m22, vessel.d_v), _ratio(vessel.m33, vessel.d_r))
    slowest = max(time for time in (*decays, math.sqrt(abs(_ratio(vessel.m33, moment))), 1.0) if math.isfinite(time))
    solution = solve_ivp(rates, (0.0, 100.0 * slowest), CALM, method="LSODA", rtol=1e-8, atol=1e-10)
    u, v, r = map(float, solution.y[:, -1])
    settled = np.allclose(solution.y[:, -1], solution.y[:, len(solution.t) * 9 // 10], rtol=1e-3, atol=1e-6)
    return (u, v, r) if settled else (math.nan, math.nan, math.nan)


def agreement(vessel: LibraryVessel, computed: Figures) -> dict[str, float]:
    """The relative differences of computed figures from the published ones, by name."""
    known = [each.name for each in fields(Figures)]
    for name in vessel.published:
        if name not in known:
            raise ParameterError(f"vessel file {vessel.path}: published.{name} is not a figure: {suggestion(name, known)}")
    return {name: getattr(computed, name) / value - 1.0 for name, value in vessel.published.items()}


def agrees(name: str, difference: float) -> bool:
    """Whether a relative difference of a figure counts as agreement."""
    return abs(difference) <= COARSE.get(name, AGREEMENT)


def _ratio(a: float, b: float) -> float:
    return a / b if b else math.inf


def _linear_fit(linear: float, quadratic: float, cubic: float) -> float:
    """The coefficient k of least squares k·w = d·w + d_2·w² + d_3·w³ on 0 <= w <= TOWING, by the integrals of w^n."""
    w = TOWING
    return linear + quadratic * 0.75 * w + cubic * 0.6 * w * w


Row = Sequence[str]

HEAD = ("vessel", "name", "inputs", "length m", "mass kg", "top m/s", "turn rad/s", "x_p m", "m11/m22", "verified", "open")

COMPARED = ("vessel", "figure", "computed", "published", "difference")

INFORMATION = {each.name: each.metadata for each in fields(Figures)}  # unit and meaning of each figure


def published_vessels() -> list[LibraryVessel]:
    """The vessels that come with the package."""
    return [read_vessel(name) for name in vessel_names()]


def overview(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """Vessels with their main figures; the columns are those of HEAD."""
    return [_summary(vessel) for vessel in vessels]


def comparison(vessels: Iterable[LibraryVessel]) -> list[Row]:
    """The published figures of vessels beside the computed ones; the columns are those of COMPARED."""
    rows: list[Row] = []
    for vessel in vessels:
        computed = figures(vessel)
        for name, difference in agreement(vessel, computed).items():
            verdict = "" if agrees(name, difference) else ", not verified"
            values = number(getattr(computed, name)), number(vessel.published[name])
            rows.append((vessel.key, _with_unit(name), *values, f"{100.0 * difference:+.1f} %{verdict}"))
    return rows


def details(vessel: LibraryVessel) -> list[Row]:
    """Figures and hull data of one vessel: name with unit, value, meaning."""
    computed, entries = figures(vessel), hull_data()
    rows: list[Row] = [(_with_unit(name), number(getattr(computed, name)), each["words"]) for name, each in INFORMATION.items()]
    for key, value in vessel.values.items():
        name = key.removeprefix(VESSEL)
        entry = entries[name][0]
        rows.append((f"{name} {entry.unit}".strip(), shown(value), entry.description))
    return rows


def markdown() -> str:
    """Overview and comparison as tables of Markdown, for the docs."""
    tables = ((HEAD, overview(published_vessels())), (COMPARED, comparison(published_vessels())))
    return "\n\n".join(
        "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)) for head, rows in tables
    )


def number(value: float) -> str:
    """A number with three digits; empty for NaN."""
    return "" if math.isnan(value) else f"{float(f'{value:.3g}'):g}"


def _summary(vessel: LibraryVessel) -> Row:
    computed, hull = figures(vessel), vessel.hull()
    inputs = ", ".join(dict.fromkeys(hull.thrusters.kinds)) if hull.thrusters else "wrench"
    verified = sum(agrees(name, difference) for name, difference in agreement(vessel, computed).items())
    published = f"{verified} of {len(vessel.published)}" if vessel.published else ""
    sizes = (hull.length, vessel.mass or math.nan)
    speeds = (computed.top_speed, computed.turning_rate, computed.percussion_point, computed.mass_ratio)
    return (vessel.key, vessel.name, inputs, *map(number, (*sizes, *speeds)), published, str(len(vessel.unverified)))


def _with_unit(name: str) -> str:
    return f"{name} {INFORMATION[name]['unit']}".strip()

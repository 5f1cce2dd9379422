"""A scenario for any ship: one of which only the main data are known, the rest by rules of thumb, or one with known hull data.

The scenario is the same for a ship whose hull data are known: references follow from these by `ship_rules`. The
templates in `config/templates` state the rule beside each number.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from string import Template
from types import MappingProxyType
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import another_ship
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.core.quantities import number_of
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.guidance.factory import travel_limits
from vessel_hsmc_ros.guidance.lawnmower import plan_survey
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.scenario.parameters_file import VESSEL
from vessel_hsmc_ros.scenario.scenario import Scenario, parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import circle_for, coriolis_ratio, loads, references, scale_of, sway_damping_rate

WATER_DENSITY = 1025.0

COMMENT_COLUMN = 40

HULL_NAMES = (
    "length",
    "beam",
    "draught",
    "surge_force_limit",
    "yaw_moment_limit",
    "surge_inertia",
    "sway_inertia",
    "yaw_inertia",
    *(f"{axis}_damping{power}" for axis in ("surge", "sway", "yaw") for power in ("", "_quadratic", "_cubic")),
)
"""The hull data of the template."""

LIMITS = ("surge_force_limit", "yaw_moment_limit")

OVERRIDES = ("length", "beam", *LIMITS)  # the main data that are hull data too, so that they can differ from those of a vessel
OF_A_VESSEL = """Hull, propulsion and thrusters are those of vessel {vessel}; single values can be changed here, as in
vessel: {{name: {vessel}, length: 2.1}}. References are scaled to it by the rules beside the numbers."""


def datum(what: str, unit: str, high: float, rule: str) -> float:
    """Declare a datum of the ship that is estimated where it is zero; the rule completes the description."""
    return parameter(0.0, f"{what}; by default {rule}.", unit=unit, low=0.0, high=high)


@dataclass(frozen=True)
class MainData:
    """What is known of a ship; zero for what is to be estimated."""

    length: float = parameter(4.0, "Length; by default 4 m.", unit="m", low=0.1, high=1e3)
    beam: float = datum("Beam", "m", 1e3, "0.53·length^0.75")
    mass: float = datum("Mass", "kg", 1e12, "8·length³")
    surge_force_limit: float = datum("Largest surge force", "N", 1e12, "5 % of the weight")
    yaw_moment_limit: float = datum("Largest yaw moment", "N·m", 1e15, "the surge force at a lever of a fifth of the length")
    speed: float = datum("Top speed", "m/s", 100.0, "0.4·sqrt(g·length)")
    wind: float = parameter(0.0, "Speed of a wind from the west, with gusts; by default none.", unit="m/s", low=0.0, high=60.0)
    current: float = parameter(0.0, "Speed of a current towards the east; by default none.", unit="m/s", low=0.0, high=10.0)
    lag: float = parameter(0.0, "Time constant of the thrust; by default not declared.", unit="s", low=0.0, high=60.0)
    gps_noise: float = parameter(
        0.0, "Standard deviation of the measured x and y, for the observer; by default none.", unit="m", low=0.0, high=100.0
    )
    gps_rate: float = parameter(
        5.0, "Rate of the measured x and y where they have noise; by default 5 Hz.", unit="Hz", low=0.1, high=100.0
    )
    power: float = datum("Electric power at full thrust", "W", 1e9, "estimated in forecasts")
    battery: float = datum("Usable capacity of the battery", "W·h", 1e12, "not declared")

    def completed(self) -> "MainData":
        """The data with estimates for those that are zero."""
        mass = self.mass or _rounded(8.0 * self.length**3)
        force = self.surge_force_limit or _rounded(0.05 * mass * GRAVITY)
        return replace(
            self,
            beam=self.beam or _rounded(0.53 * self.length**0.75),
            mass=mass,
            surge_force_limit=force,
            yaw_moment_limit=self.yaw_moment_limit or _rounded(0.2 * force * self.length),
            speed=self.speed or _rounded(0.4 * math.sqrt(GRAVITY * self.length)),
        )


THRUSTERS = """
    actuators: {kind: thrusters}        # driven by the thrusters of the vessel; wrench: by surge force and yaw moment"""

LAGS = """
    actuators: {{surge_lag: {lag}, yaw_lag: {lag}}}  # s"""

SENSORS = """
    sensors: {{position_noise: {noise}, position_rate_hz: {rate}}}  # m, Hz"""

OBSERVER = """true
      position_noise: {noise}           # m, of a sample of x and of y"""

LOW_SWAY_DAMPING = """
    vessel:
      sway_damping_rate: {a}        # 1/s; low: the course of this hull follows its heading late, and the law waits for it
      coriolis_ratio: {rho}         # sway acceleration in a turn per surge velocity times yaw rate"""


def scenario_text(name: str, data: MainData, layout: ThrusterLayout | None = None) -> str:
    """Write the scenario of a ship of which the main data are known.

    `layout`: its thrusters, which then drive it; their forces are its limits where the data have none. Returns a commented
    ROS parameters file: hull, calm water or wind, a circle as reference, and the guided law.
    """
    if layout is not None:
        force, moment = layout.limits()
        given_limits = data.surge_force_limit or force, data.yaw_moment_limit or moment
        data = replace(data, surge_force_limit=given_limits[0], yaw_moment_limit=given_limits[1])
    d = data.completed()
    if d.current >= d.speed:
        raise ParameterError(f"init.current must be less than the top speed, {d.speed:g} m/s (got {d.current:g} m/s)")
    given, hull = {key: _number(value) for key, value in vars(d).items()}, hull_of(d)
    written = given | {key: _number(value) for key, value in hull.items()}
    values = {f"vessel.{key}": float(written[key]) for key in HULL_NAMES}
    about = f"a ship of {given['length']} m and {given['mass']} kg"
    section = _template("hull").substitute(written).rstrip() + _declared(d) + (_thrusters(layout, d.lag) if layout else "")
    data_lines = _template("data").substitute(given)
    return _filled(name, about, data_lines, section, values | _further(d), d, layout is not None)


def scenario_for(
    values: Mapping[str, object],
    vessel: str,
    name: str = "any_ship",
    changes: Mapping[str, float] = MappingProxyType({}),
    around: MainData = MainData(),
    thrusters: bool = False,
) -> str:
    """Write the scenario of a ship whose hull data are known, such as one of the library or an identified one.

    `values`: its hull data by their dotted names in a scenario, `vessel.surge_inertia`; other names are not used. `vessel`:
    the name of the vessel in the library, or the path of its file, to which the scenario refers. `changes`: single hull data
    of the scenario that differ from the vessel's, by their names. `around`: all of it but its main data counts. Returns a
    commented ROS parameters file: reference to the hull, calm water or wind, a circle as reference, and the guided law.
    """
    data = "\n".join(f"# {line}" for line in OF_A_VESSEL.format(vessel=vessel).splitlines())
    changes = {**changes, **{key.removeprefix(VESSEL): value for key, value in _further(around).items()}}
    changed = "".join(f", {key}: {_number(value)}" for key, value in changes.items())
    section = f"    vessel: {{name: {json.dumps(vessel)}{changed}}}" if changes else f"    vessel: {json.dumps(vessel)}"
    own = {f"{VESSEL}{key}": value for key, value in changes.items()}
    return _filled(name, f"vessel {vessel}", data, section, {**values, **own}, around, thrusters)


def ship_of(values: Mapping[str, object]) -> ShipParameters:
    """The ship of hull data by their dotted names in a scenario, such as `vessel.length`; other names are not used."""
    own = {name.removeprefix(VESSEL): value for name, value in values.items() if name.startswith(VESSEL)}
    known = schema.entries(ShipParameters)
    # Damping that is left out is zero, not that of the paper's ship.
    hull = {name: 0.0 for name in known if "_damping" in name} | {name: own[name] for name in own if name in known}
    ship = schema.build(ShipParameters, hull, "vessel")
    # The paper states no limits; laws assume some for its ship.
    assumed = {} if another_ship(ship) else {name: getattr(KnownVessel(), name) for name in LIMITS if name not in own}
    return replace(ship, **assumed)


def _filled(
    name: str,
    about: str,
    data: str,
    vessel: str,
    values: Mapping[str, object],
    around: MainData,
    thrusters: bool = False,
) -> str:
    """The scenario from its template, with references scaled to a ship.

    `name`, `about`: name of the ship, and what it is, for the headline. `data`: what the head of the file states about its
    data, as comments. `values`: hull data by their dotted names. `around`: all of it but its main data counts.
    """
    ship = ship_of(values)
    scale = scale_of(ship)
    circle = circle_for(ship, scale)
    decay = _rounded(sway_damping_rate(ship, scale, circle))
    estimates = {**loads(scale.L, around.wind), **references(circle, scale, decay), "turn_rate": scale.r_max}
    numbers = {key: _number(_rounded(value)) for key, value in estimates.items()}
    radius, speed = f"{_rounded(circle.radius / scale.L):g} lengths", f"{_rounded(circle.speed / scale.U):g} of the top speed"
    text = _template("ship").substitute(
        numbers,
        name=name,
        about=about,
        data=data.rstrip(),
        vessel=vessel.rstrip(),
        wind=_number(around.wind),
        current=_number(around.current),
        sensors=SENSORS.format(noise=_number(around.gps_noise), rate=_number(around.gps_rate)) if around.gps_noise else "",
        observer=OBSERVER.format(noise=_number(around.gps_noise)) if around.gps_noise else "false",
        radius_rule=radius,
        cruise_rule=speed,
        actuators=THRUSTERS if thrusters else LAGS.format(lag=_number(around.lag)) if around.lag else "",
        drift=LOW_SWAY_DAMPING.format(a=_number(decay), rho=_number(_rounded(coriolis_ratio(ship, circle))))
        if decay >= 0.0
        else "",
    )
    return "\n".join(map(_aligned, text.splitlines())) + "\n"


def thruster_layout(texts: Sequence[str], length: float) -> ThrusterLayout:
    """The fixed thrusters of a boat, each as `x,y,ahead,astern`: its place, m, and its largest thrusts, N.

    `length`: of the boat, m, within which they are.
    """
    rows = [_thruster(text, length) for text in texts]
    sides = ["port" if y > 0.0 else "starboard" for _, y, *_ in rows]
    names = sides if sorted(sides) == ["port", "starboard"] else [f"thruster_{i}" for i in range(1, len(rows) + 1)]
    x, y, ahead, astern = zip(*rows, strict=True)
    return ThrusterLayout(names=tuple(names), x=x, y=y, thrust_ahead=ahead, thrust_astern=astern)


def _thruster(text: str, length: float) -> tuple[float, ...]:
    numbers = [_finite(part) for part in text.split(",")]
    if len(numbers) == 4:
        x, y, ahead, astern = numbers
        if max(abs(x), abs(y)) <= length and 0.0 < ahead <= 1e9 and 0.0 <= astern <= 1e9:
            return x, y, ahead, astern
    allowed = (
        f"x,y,ahead,astern: x and y from {-length:g} to {length:g} m, thrust ahead above 0 and astern from 0, both up to 1e9 N"
    )
    raise ParameterError(f"--thruster must be {allowed}, such as -1.5,0.5,100,60 (got {text})")


def _finite(text: str) -> float:
    try:
        return number_of(text)
    except ValueError:
        return math.nan


def _further(data: MainData) -> dict[str, float]:
    """The hull data that are only there where they are declared."""
    given = {"surge_lag": data.lag, "yaw_lag": data.lag, "power.full_thrust": data.power, "power.battery_wh": data.battery}
    return {f"{VESSEL}{name}": value for name, value in given.items() if value}


def _declared(data: MainData) -> str:
    """The lines of the hull that declare them."""
    units = {f"{VESSEL}power.full_thrust": "W", f"{VESSEL}power.battery_wh": "W·h"}
    return "".join(
        f"\n      {name.removeprefix(VESSEL)}: {_number(value)}  # {units.get(name, 's')}"
        for name, value in _further(data).items()
    )


def _thrusters(layout: ThrusterLayout, lag: float) -> str:
    """The lines of the hull with its thrusters."""
    lists = {"x": layout.x, "y": layout.y, "thrust_ahead": layout.thrust_ahead, "thrust_astern": layout.thrust_astern}
    if lag:
        lists["lag"] = (lag,)
    comments = {"x": "m ahead of the origin", "y": "m to port", "thrust_ahead": "N", "thrust_astern": "N", "lag": "s"}
    lines = [f"        names: [{', '.join(layout.names)}]", "        kinds: [fixed]"]
    lines += [f"        {key}: [{', '.join(map(_number, values))}]  # {comments[key]}" for key, values in lists.items()]
    return "\n      thrusters:\n" + "\n".join(lines)


def _template(name: str) -> Template:
    return Template((share_directory() / "config" / "templates" / f"{name}.yaml").read_text(encoding="utf-8"))


def hull_of(d: MainData) -> dict[str, float]:
    """Draught, inertia and damping by rules of thumb, with three digits."""
    draught = d.mass / (WATER_DENSITY * 0.5 * d.length * d.beam)
    m22, m33, decay = 1.5 * d.mass, 1.5 * d.mass * (0.25 * d.length) ** 2, d.speed / d.length
    hull = {
        "draught": draught,
        "surge_inertia": 1.05 * d.mass,
        "sway_inertia": m22,
        "yaw_inertia": m33,
        "surge_damping": 0.2 * d.surge_force_limit / d.speed,
        "surge_damping_quadratic": 0.8 * d.surge_force_limit / d.speed**2,
        "sway_damping": m22 * decay,
        "sway_damping_quadratic": 0.5 * WATER_DENSITY * d.length * draught,
        "yaw_damping": m33 * decay,
        "yaw_damping_quadratic": WATER_DENSITY * draught * d.length**4 / 64.0,
        "surge_damping_cubic": 0.0,
        "sway_damping_cubic": 0.0,
        "yaw_damping_cubic": 0.0,
    }
    return {key: _rounded(value) for key, value in hull.items()}


def _rounded(value: float) -> float:
    """An estimate with three digits: more would pretend a precision that it does not have."""
    return float(f"{value:.3g}")


def _number(value: float) -> str:
    """A number with the decimal point by which ROS recognises a floating-point number."""
    text = f"{value:.12g}"
    return text if "." in text else f"{value:.1e}" if "e" in text else f"{text}.0"


def _aligned(line: str) -> str:
    """A line with its comment, if it has a value as well, in the column of comments."""
    found = re.fullmatch(r"(\s*[^#\s][^#]*?)\s*(#.*)", line)
    return f"{found[1]:<{COMMENT_COLUMN - 2}}  {found[2]}" if found else line


MARGIN = 1.1
"""Duration of the run relative to the planned time of the survey: the ship comes to its end a little later than the plan."""

TAKES = "legs,length,spacing,speed: a whole number, m, m (negative to starboard) and m/s, such as 4,80,16,1"


class NewSurvey(NamedTuple):
    """Number of legs, their length and spacing, m, and the speed on them, m/s."""

    legs: int
    length: float
    spacing: float
    speed: float


def survey_of(text: str) -> NewSurvey:
    """Read a survey, `legs,length,spacing,speed`."""
    try:
        legs, *others = map(number_of, text.split(","))
        if legs.is_integer() and len(others) == 3:
            return NewSurvey(int(legs), *others)
    except (ValueError, AttributeError):
        pass
    raise ParameterError(f"--survey must be {TAKES} (got {text})")


def with_survey(text: str, survey: NewSurvey) -> str:
    """A scenario that `own_ship` has written, with a survey for its reference.

    Returns the scenario; its duration is the planned time of the survey and a tenth of it.
    """
    names = dict(zip(("legs", "leg_length", "spacing", "speed"), survey, strict=True))
    try:
        planned = parse_scenario(text, "new", {f"reference_ship.lawnmower.{name}": value for name, value in names.items()})
        duration = math.ceil(MARGIN * planned_time(planned) / 10.0) * 10.0
    except ParameterError as error:
        raise ParameterError(f"--survey: {error}") from None
    own = planned.reference_ship.lawnmower
    values = ", ".join(f"{name}: {getattr(own, name)}" for name in ("legs", "leg_length", "spacing", "run_in", "speed"))
    for pattern, new in (
        (r"mode: circle   ", "mode: lawnmower"),
        (r"or straight, figure_eight, square, lawnmower,", "or circle, straight, figure_eight, square,"),
        (r"lawnmower: \{.*", f"lawnmower: {{{values}}}"),
        (r"duration: .*", f"duration: {duration}                     # the time that the survey takes, and a tenth of it"),
        (r" on a circle\. Written", " on a survey. Written"),
    ):
        text = re.sub(pattern, new, text, count=1)
    return text


def planned_time(scenario: Scenario) -> float:
    """The time that the survey of a scenario takes, s, whatever the mode of its reference is."""
    p = scenario.reference_ship
    x, y, course = p.initial_pose
    return float(plan_survey(p.lawnmower, p.vessel.coefficients(), travel_limits(p), (x, y, course)).table.times[-1])

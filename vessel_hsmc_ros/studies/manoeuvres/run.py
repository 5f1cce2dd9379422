"""The metrics of the manoeuvres, as IMO resolution MSC.137(76) and its explanatory notes, MSC/Circ.1053, define them.

Lengths in m, times in s, speeds in m/s; angles in degrees and their rates in °/s, as the resolution gives them. A metric that the
manoeuvre has not reached is NaN; what grows without a bound is infinite. They are taken from the track from the execute on, seen
from the side of the first turn. The resolution measures from the midship point; here it is the origin of the hull's coordinates.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from vessel_hsmc_ros.control.laws.manoeuvre import ManoeuvreParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ControlError, ParameterError, ScenarioError, SimulationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.core.thruster_layout import ALL_ROUND, AZIMUTH, FIXED, Thruster
from vessel_hsmc_ros.plant.dynamics import damping_force
from vessel_hsmc_ros.report.record import limits
from vessel_hsmc_ros.scenario.named_files import SUFFIXES
from vessel_hsmc_ros.scenario.parameters_file import read_text, read_yaml
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.vessels import vessel_names
from vessel_hsmc_ros.simulation.offline import simulate


class Track(NamedTuple):
    """A manoeuvre; components to the side of the first turn are positive, so that a turn to starboard equals one to port."""

    time: Array  # since the execute, (n,) s
    # ahead, aside: distance along the original course and perpendicular to it, (n,) m
    ahead: Array
    aside: Array
    turned: Array  # change of heading, not wrapped, (n,) rad
    # u, v, r: velocities, (n,)
    u: Array
    v: Array
    r: Array
    # force, moment: the applied wrench, (n,)
    force: Array
    moment: Array
    command: Array  # the commanded yaw moment, (n,)

    def at(self, index: float) -> "Track":
        """The point between two rows, by linear interpolation, as arrays without dimension; NaN for an index of NaN."""
        rows = np.arange(len(self.time))
        return Track(*(np.asarray(np.interp(index, rows, values)) for values in self))

    @property
    def travelled(self) -> Array:
        """Length of the path, (n,) m."""
        steps = np.hypot(np.diff(self.ahead), np.diff(self.aside))
        return np.concatenate(([0.0], np.cumsum(steps)))


def track_of(run: Run, scenario: Scenario) -> Track:
    """The track of a simulated manoeuvre."""
    settings = scenario.controller.manoeuvre
    begin = round(settings.approach_time * scenario.controller.rate_hz)
    side = 1.0 if settings.side == "port" else -1.0
    x, y, _, u, v, r = run.state[begin:].T
    psi = np.unwrap(run.state[:, 2])
    course = psi[0]
    c, s = np.cos(course), np.sin(course)
    x, y = x - x[0], y - y[0]
    return Track(
        run.time[begin:] - run.time[begin],
        c * x + s * y,
        side * (c * y - s * x),
        side * (psi[begin:] - course),
        u.copy(),
        side * v,
        side * r,
        run.wrench[begin:, 0].copy(),
        side * run.wrench[begin:, -1],
        side * run.control["commanded"][begin:, 1],
    )


def crossing(values: Array, level: float) -> float:
    """The fractional index at which values first reach a level from below; NaN if they do not."""
    reached = np.flatnonzero(values >= level)
    if not len(reached):
        return np.nan
    i = int(reached[0])
    return float(i) if i == 0 else i - 1 + (level - values[i - 1]) / (values[i] - values[i - 1])


Metrics = dict[str, float]

STEADY_CHANGE = 0.01
"""A turn or a step is steady if the yaw rate or speed changes by less than this share of the largest one over its last fifth."""

RISEN = 0.95  # the rise time of the force ends at this share of its last value


def turning_circle(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """Advance and transfer at a change of heading of 90°, tactical diameter at 180°, and the steady turn at the end."""
    quarter, half, whole = (track.at(crossing(track.turned, np.radians(angle))) for angle in (90.0, 180.0, 360.0))
    u, v, r = track.u[-1], track.v[-1], track.r[-1]
    speed = float(np.hypot(u, v))
    found = {
        "advance": quarter.ahead,
        "transfer": quarter.aside,
        "tactical_diameter": half.aside,
        "steady_diameter": 2.0 * speed / r,
        "time_90": quarter.time,
        "time_180": half.time,
        "time_360": whole.time,
        "steady_speed": speed,
        "speed_loss": 100.0 * (1.0 - speed / np.hypot(track.u[0], track.v[0])),
        "steady_yaw_rate": np.degrees(r),
        # The angle from the velocity to the bow: positive where the bow points into the turn.
        "drift_angle": np.degrees(np.arctan2(-v, u)),
    }
    return {name: float(value) for name, value in found.items()}


def zigzag(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """Overshoot angles after the second and third execute, the times to check the yaw, and the initial turning ability.

    They are infinite for a ship that goes on turning against its rudder.
    """
    executes = [0, *(np.flatnonzero(np.diff(np.sign(track.command))) + 1)]
    # Without a check of the yaw the ship makes a full turn after the last execute.
    missing = np.inf if abs(track.turned[-1] - track.turned[executes[-1]]) > 2.0 * np.pi else np.nan
    overshoots, checks = [missing, missing], [missing, missing]
    # Between an execute and the next the ship turns back; without a next one the overshoot may not be complete.
    for k, (begin, end) in enumerate(pairwise(executes[1:4])):
        turned = track.turned[begin:end] * (1.0 if k == 0 else -1.0)
        furthest = int(np.argmax(turned))
        overshoots[k] = float(np.degrees(turned[furthest] - turned[0]))
        checks[k] = float(track.time[begin + furthest] - track.time[begin])
    first = crossing(track.turned, np.radians(settings.switch_heading_deg))
    return {
        "first_overshoot": overshoots[0],
        "second_overshoot": overshoots[1],
        "first_yaw_check_time": checks[0],
        "second_yaw_check_time": checks[1],
        "initial_turning_distance": float(np.interp(first, np.arange(len(track.time)), track.travelled)),
        "initial_turning_time": float(track.at(first).time),
        "period": float(track.time[executes[3]] - track.time[executes[1]]) if len(executes) > 3 else missing,
    }


def spiral_curve(track: Track, settings: ManoeuvreParameters) -> Array:
    """Rudder angle [°] and yaw rate [°/s] at the end of each step of a spiral, (2·n - 1, 2); the first is positive."""
    n, rows = settings.steps, step_ends(track, settings.hold_time, 2 * settings.steps - 1)
    share = 1.0 - 2.0 * np.array([*range(n), *range(n - 2, -1, -1)]) / (n - 1)
    return np.column_stack((settings.rudder_deg * share[: len(rows)], np.degrees(track.r[rows])))


def spiral(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """The width of the loop in which an unstable ship turns against its rudder, and the yaw rate with the rudder amidships."""
    curve, n = spiral_curve(track, settings), settings.steps
    out, back = curve[:n], curve[n - 1 :]
    # The rudder angle at which the yaw rate changes its sign, on the way out and on the way back.
    zero = [float(np.interp(0.0, branch[:, 1], branch[:, 0])) for branch in (out[::-1], back)]
    middle = np.abs(np.interp(0.0, out[::-1, 0], out[::-1, 1])), np.abs(np.interp(0.0, back[:, 0], back[:, 1]))
    return {
        # A ship that turns on against the whole rudder has no such angle.
        "loop_width": abs(zero[1] - zero[0]) if out[0, 1] * out[-1, 1] < 0.0 else np.inf,
        "residual_yaw_rate": float(max(middle)),
        "largest_yaw_rate": float(np.abs(curve[:, 1]).max()),
    }


def crash_stop(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """Track reach along the path, head reach along the course, side reach across it, and the time, until the ship has stopped."""
    index = crossing(-track.u, 0.0)
    end = track.at(index)
    return {
        "track_reach": float(np.interp(index, np.arange(len(track.time)), track.travelled)),
        "head_reach": float(end.ahead),
        "side_reach": float(abs(end.aside)),
        "stopping_time": float(end.time),
    }


def speed_curve(track: Track, settings: ManoeuvreParameters) -> Array:
    """Share of the surge force and speed at the end of each speed run, (n, 2)."""
    rows = step_ends(track, settings.hold_time, settings.steps)
    return np.column_stack((np.arange(1, len(rows) + 1) / settings.steps, track.u[rows]))


def speed_run(track: Track, settings: ManoeuvreParameters) -> Metrics:
    """The speeds at the whole and at half of the surge force."""
    share, speed = speed_curve(track, settings).T
    return {"top_speed": float(speed[-1]), "half_force_speed": float(np.interp(0.5, share, speed))}


def bollard_pull(track: Track, _settings: ManoeuvreParameters) -> Metrics:
    """The surge force of a ship that is kept at rest, and the time in which it is reached."""
    return {
        "bollard_pull": float(track.force[-1]),
        "force_rise_time": float(track.at(crossing(track.force, RISEN * track.force[-1])).time),
    }


METRICS: dict[str, Callable[[Track, ManoeuvreParameters], Metrics]] = {
    each.__name__: each for each in (turning_circle, zigzag, spiral, crash_stop, speed_run, bollard_pull)
}
"""The metrics of each kind of manoeuvre."""


def is_complete(track: Track, settings: ManoeuvreParameters, found: Metrics) -> bool:
    """Whether a manoeuvre has come to its end: every metric is known, and what is to be steady is."""
    if np.isnan(list(found.values())).any():
        return False
    if settings.kind == "turning_circle":
        return _is_steady(track.r, track.r[-1]) and _is_steady(track.u, track.u[0])
    if settings.kind in ("spiral", "speed_run"):
        values = track.r if settings.kind == "spiral" else track.u
        count = 2 * settings.steps - 1 if settings.kind == "spiral" else settings.steps
        ends = step_ends(track, settings.hold_time, count)
        length = ends[0]
        return all(_is_steady(values[end - length + 1 : end + 1], np.abs(values).max()) for end in ends)
    return True


def step_ends(track: Track, hold: float, count: int) -> list[int]:
    """The last row of each step of a duration, s."""
    rows = round(hold / (track.time[1] - track.time[0]))
    return [min((k + 1) * rows, len(track.time)) - 1 for k in range(count)]


def _is_steady(values: Array, largest: float) -> bool:
    return bool(np.ptp(values[-max(len(values) // 5, 2) :]) <= STEADY_CHANGE * abs(largest))


OUTPUT = 0.85  # share of the largest output at which the manoeuvres begin
MAX_STEADY_SPEED = 1e3  # a ship has no steady speed below this: its hull data contain no damping, m/s or rad/s

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
    thrusters = hull.thrusters.thrusters()
    astern = min(surge, sum(map(_thrust_astern, thrusters))) if thrusters else surge
    return Ship(name, calm, hull.length, surge, yaw, U, V, resistance(U), X, astern, r_N, T, delay)


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


def _stepped(ship: Ship, kind: str, steps: int, holds: int) -> Plan:
    hold = SETTLING * ship.time + ship.delay
    return Plan({"kind": kind, "steps": steps}, holds * hold, hold)


PLANS: dict[str, Callable[[Ship], Plan]] = {
    "turning_circle": lambda ship: Plan(
        {"kind": "turning_circle"}, 3.0 * math.pi / ship.turn_rate + SETTLING * ship.time + ship.delay
    ),
    "zigzag_10": lambda ship: _zigzag(ship, 10.0),
    "zigzag_20": lambda ship: _zigzag(ship, 20.0),
    "spiral": lambda ship: _stepped(ship, "spiral", SPIRAL_STEPS, 2 * SPIRAL_STEPS - 1),
    "crash_stop": lambda ship: Plan({"kind": "crash_stop"}, 2.0 * ship.time + ship.delay),
    "speed_run": lambda ship: _stepped(ship, "speed_run", SPEED_STEPS, SPEED_STEPS),
    "bollard_pull": lambda ship: Plan({"kind": "bollard_pull"}, ship.time + 2.0 * ship.delay, moored=True),
}
"""The manoeuvres by their names."""


def scenario_of(ship: Ship, name: str, stretch: float = 1.0, side: str = "starboard") -> Scenario:
    """The scenario of a manoeuvre."""
    plan = PLANS[name](ship)
    # Duration of the approach, which begins at the test speed: the actuators settle, and with them the speed.
    approach = 0.0 if name in ("speed_run", "bollard_pull") else SETTLING * ship.time + ship.delay
    needed = (STEPS_WHEN_STEADY if plan.hold else STEPS_PER_LENGTH) * ship.speed / ship.length
    rate_hz = next((each for each in RATES_HZ if each >= needed), RATES_HZ[-1])  # the lowest with enough steps
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

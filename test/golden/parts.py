"""Recorded motions of the parts of a simulation: references, plant, observer, allocation, controlled point.

A golden run is of a whole scenario, in which a loop hides small mistakes of its parts, and most settings have their defaults.
Here each part runs alone, with settings that all differ. `make golden` records what has changed and shows it.
"""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.allocation import Allocation
from vessel_hsmc_ros.control.controlled_point import START, controlled_point_of, to_controlled_point
from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.control.observer_model import ObserverParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.law.known_vessel import KnownVessel
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters
from vessel_hsmc_ros.plant.thruster_plant import make_plant
from vessel_hsmc_ros.reference.factory import ReferenceShipParameters, make_reference

Array = NDArray[np.float64]
Rows = list[list[float]]

FILE = Path(__file__).parents[1] / "data" / "parts.json"
PERIOD = 0.1
SIXTH, NINTH = 1e-6, 1e-9
"""Relative tolerances: of what an iteration finds, and of what is computed in one go."""

COUPLED: dict[str, Any] = {
    **{"sway_yaw_inertia": 4e5, "yaw_sway_inertia": 2e5, "surge_damping_from_sway": 5e3, "surge_damping_from_sway_yaw": 2e4},
    **{"sway_damping_from_yaw": 3e5, "sway_damping_from_yaw_quadratic": 2e5, "sway_damping_from_yaw_at_sway": 1e5},
    **{"sway_damping_from_yaw_at_surge": -5e4, "sway_damping_at_yaw": 4e4, "sway_damping_at_surge": 2e4},
    **{"yaw_damping_from_sway": 2e5, "yaw_damping_from_sway_quadratic": 1e5, "yaw_damping_from_sway_at_yaw": 3e5},
    **{"yaw_damping_from_sway_at_surge": 1e5, "yaw_damping_at_sway": 5e5, "yaw_damping_at_surge": 1e6},
}


def built(cls: type[Any], **values: Any) -> Any:
    """Parameters by their dotted names, with two underscores for a dot."""
    return schema.build(cls, {name.replace("__", "."): value for name, value in values.items()}, "parts")


def thinned(rows: Sequence[Sequence[float]], count: int = 16) -> Rows:
    """Some of the rows, denser at the beginning; the last is one of them."""
    chosen = sorted({round((len(rows) - 1) * (k / (count - 1)) ** 1.5) for k in range(count)})
    return [[float(f"{value:.12g}") for value in rows[k]] for k in chosen]


# -- references -------------------------------------------------------------------------------------------------------


def followed(seconds: float, events: dict[int, Callable[[Any], None]] | None = None, **values: Any) -> Rows:
    """State and acceleration of a reference over time, with events by the number of their step."""
    reference, rows = make_reference(built(ReferenceShipParameters, **values), PERIOD), []
    for k in range(round(seconds / PERIOD)):
        if events and k in events:
            events[k](reference)
        rows.append([*reference.state, *reference.acceleration()])
        reference.advance()
    return thinned(rows, 24)


def program(name: str, scale: float, shift: float) -> dict[str, Any]:
    """An input with all of its parts."""
    sine = {"amplitude": 0.3 * scale, "frequency": 0.21 + shift, "phase": 0.4 - shift}
    steps = {"times": (1.0 + shift, 3.7, 8.0), "values": (0.2 * scale, -0.5 * scale, 0.1 * scale)}
    ramp = {"times": (2.0, 5.5 + shift, 9.0), "values": (-0.1 * scale, 0.6 * scale, 0.3 * scale)}
    groups: dict[str, dict[str, Any]] = {"sine": sine, "steps": steps, "ramp": ramp}
    return {f"{name}_{group}__{key}": value for group, values in groups.items() for key, value in values.items()}


def virtual_ship() -> Rows:
    values: dict[str, Any] = {
        **{"initial_pose": (3.0, -4.0, 2.9), "initial_velocity": (1.2, -0.1, 0.05), "surge_force": 6e4, "yaw_moment": -7e5},
        **program("surge_force", 8e4, 0.1),
        **program("yaw_moment", 1.5e6, 0.3),
        **{f"vessel__{name}": value for name, value in COUPLED.items()},
    }
    later = {"surge_force_sine__frequency": 0.55, "yaw_moment_sine__frequency": 0.13, "surge_force": 2e4}

    def change(reference: Any) -> None:
        reference.retune(built(ReferenceShipParameters, **{**values, **later}))

    def change_again(reference: Any) -> None:
        reference.retune(built(ReferenceShipParameters, **values))

    return followed(12.0, {45: change, 80: change_again}, **values)


def course() -> Rows:
    heading = {f"course__{name}": value for name, value in program("heading", 1.1, 0.2).items()}
    return followed(12.0, mode="course", course__heading=2.8, course__surge_velocity=1.7, initial_pose=(3.0, 4.0, 1.0), **heading)


MOTION: dict[str, Any] = {
    "motion__speed": 1.3,
    "motion__acceleration": 0.17,
    "motion__yaw_rate": 0.11,
    "motion__yaw_acceleration": 0.024,
}


def goals() -> Rows:
    """Far, near astern, near and beside, at the same place with another heading, on the way to which the next comes."""
    poses = (25.0, 9.0, 2.5, 21.0, 12.5, -2.0, 21.5, 18.0, 1.0, 21.5, 18.0, -2.6, -30.0, 5.0, 0.5)
    times: dict[str, Any] = {"goal__poses": poses, "goal__times": (0.5, 70.0, 150.3, 260.0, 266.0), "goal__astern_distance": 7.0}
    return followed(330.0, mode="goal", initial_pose=(2.0, -3.0, 0.7), initial_velocity=(0.4, 0.05, -0.02), **times, **MOTION)


def stream() -> Rows:
    """A stream of poses with stamps and without them, that pauses, goes on, jumps and ends; in turns across 180 degrees.

    After the jump it turns faster than the reference may. Its heading is not its course.
    """

    def arrival(k: int) -> Callable[[Any], None]:
        radius, rate, x = (14.0, 0.05, 4.0) if k < 420 else (4.0, 0.3, 49.0)
        turn = 2.0 + rate * k * PERIOD
        pose = x + radius * math.sin(turn), -6.0 - radius * math.cos(turn), math.remainder(turn + 0.5, 2.0 * math.pi)
        # Each arrives later than it was measured, by times that differ.
        stamp = None if k < 120 else k * PERIOD - 0.01 * (k % 7)
        return lambda reference: reference.set_goal(*pose, stamp)

    steps = [*range(5, 200, 6), *range(205, 290, 10), *range(330, 640, 6)]
    return followed(230.0, {k: arrival(k) for k in steps}, mode="goal", initial_pose=(-5.0, 0.0, 1.0), **MOTION)


def curve(mode: str, **values: Any) -> Callable[[], Rows]:
    own = {f"{mode}__{name}": value for name, value in values.items()}
    return lambda: followed(120.0, mode=mode, initial_pose=(7.0, -2.0, 2.3), **own)


CORNERS: dict[str, Any] = {
    "path__waypoints": (40.0, 5.0, 75.0, 40.0, 60.0, 90.0, 5.0, 95.0, -20.0, 60.0),
    "path__speeds": (1.2, 1.0, 1.3, 0.8, 1.1),
    "path__corners": ("through", "over", "stop", "through", "through"),
}
LIMITED: dict[str, Any] = {"vessel__surge_force_limit": 9e4, "vessel__yaw_moment_limit": 2.2e6, "motion__current": 0.15}


def path() -> Rows:
    return followed(420.0, mode="path", path__time=2.04, initial_pose=(3.0, 1.0, 0.4), **CORNERS, **LIMITED, **MOTION)


def path_under_way() -> Rows:
    """Paths that are set under way, astern of the ship and ahead, and one after a turn on the spot has begun."""
    events: dict[int, Callable[[Any], None]] = {
        300: lambda reference: reference.set_path([(60.0, -20.0), (20.0, -60.0)]),
        900: lambda reference: reference.set_path([(0.0, 30.0)]),
        2400: lambda reference: reference.set_path([(-30.0, 55.0), (-60.0, 20.0)]),
    }
    start: dict[str, Any] = {"initial_pose": (3.0, 1.0, 0.4), "initial_velocity": (1.0, -0.05, 0.03)}
    return followed(420.0, events, mode="path", path__time=0.0, **start, **CORNERS, **LIMITED, **MOTION)


def survey(seconds: float, **values: Any) -> Callable[[], Rows]:
    own = {f"lawnmower__{name}": value for name, value in values.items()}
    return lambda: followed(seconds, mode="lawnmower", initial_pose=(7.0, -2.0, 2.3), **own, **LIMITED, **MOTION)


# -- plant ------------------------------------------------------------------------------------------------------------

SENSORS: dict[str, Any] = {
    **{"position_noise": 0.4, "heading_noise": 0.02, "velocity_noise": 0.06, "yaw_rate_noise": 0.003},
    **{"position_bias": (0.3, -0.7), "heading_bias": 0.05, "velocity_bias": (0.02, -0.03), "yaw_rate_bias": 0.004},
    **{"position_rate_hz": 3.0, "heading_rate_hz": 4.0, "velocity_rate_hz": 7.0, "delay": 0.23},
}
ENVIRONMENT: dict[str, dict[str, Any]] = {
    "periodic": {"surge_force": 2e3, "sway_force": -5e3, "yaw_moment": 7e4, "frequency": 0.3},
    "earth_fixed": {"east_force": 6e3, "north_force": -9e3, "lever": 2.5, "gust_deviation": 3e3, "gust_time_constant": 4.0},
    "current": {"east": 0.4, "north": -0.25},
    "waves": {
        **{"significant_height": 0.8, "peak_period": 4.5, "peak_enhancement": 2.1, "direction": 1.1, "components": 5},
        **{"hull_length": 21.0, "hull_beam": 6.0, "hull_draught": 1.9},
    },
}
SHIP: dict[str, Any] = {
    **{f"vessel__{name}": value for name, value in COUPLED.items()},
    **{f"sensors__{name}": value for name, value in SENSORS.items()},
    **{f"disturbance__{kind}__{name}": value for kind, each in ENVIRONMENT.items() for name, value in each.items()},
    **{"initial_pose": (5.0, 1.0, 3.0), "initial_velocity": (1.5, -0.2, 0.05), "seed": 7, "substeps": 2},
}


def sailed(values: dict[str, Any], inputs: Callable[[float], Any], by_thrusters: bool) -> Rows:
    """Measurement, state, applied wrench and disturbance, with a changed environment on the way."""
    plant, rows, stamp = make_plant(built(PlantParameters, **values), PERIOD), [], 0
    changed: dict[str, dict[str, Any]] = {
        **ENVIRONMENT,
        "current": {"east": -0.1, "north": 0.5},
        "periodic": {**ENVIRONMENT["periodic"], "frequency": 0.7},
    }
    for k in range(90):
        time = stamp * 1e-9
        if k == 50:
            flat = {f"{kind}__{name}": value for kind, each in changed.items() for name, value in each.items()}
            plant.retune(built(DisturbanceParameters, **flat), time)
        measured, disturbance = plant.measured(stamp), plant.disturbance(time)
        wrench = plant.applied_thrusts(*inputs(time)) if by_thrusters else plant.applied(inputs(time))
        rows.append([*measured, *plant.state, *wrench, *disturbance, *plant.unforced_acceleration(), plant.periods_late])
        plant.advance(wrench, disturbance)
        stamp += round(PERIOD * 1e9)
    return thinned(rows)


def plant_by_wrench() -> Rows:
    actuators: dict[str, Any] = {
        **{"surge_force_limit": 8e4, "yaw_moment_limit": 1.1e6, "surge_force_rate": 9e4, "yaw_moment_rate": 1.3e6},
        **{"surge_lag": 0.6, "yaw_lag": 0.35, "surge_dead_time": 0.31, "yaw_dead_time": 0.52},
    }
    values = {**SHIP, **{f"actuators__{name}": value for name, value in actuators.items()}}
    return sailed(values, lambda t: (1e5 * math.sin(1.1 * t + 0.3), 1.4e6 * math.cos(0.8 * t)), by_thrusters=False)


THRUSTERS: dict[str, Any] = {
    "names": ["left", "right", "bow", "pod", "screw"],
    "kinds": ["fixed", "fixed", "fixed", "azimuth", "rudder"],
    "x": [-9.0, -9.5, 8.0, 3.0, -11.0],
    "y": [2.0, -2.3, 0.2, 0.4, -0.1],
    "angle": [0.05, -0.04, 1.55, 0.0, 0.0],
    "thrust_ahead": [4e4, 4.4e4, 9e3, 2e4, 5e4],
    "thrust_astern": [2.5e4, 2.2e4, 8e3, 1.1e4, 3e4],
    "thrust_rate": [4e4, 5e4, 2e4, 3e4, 6e4],
    "lag": [0.4, 0.5, 0.2, 0.3, 0.6],
    "angle_limit": [math.pi, math.pi, math.pi, math.pi, 0.6],
    "angle_rate": [1.0, 1.0, 1.0, 0.9, 0.4],
    "lift": [0.0, 0.0, 0.0, 0.0, 2e3],
    "lift_quadratic": [0.0, 0.0, 0.0, 0.0, 9e2],
    "slipstream": [0.0, 0.0, 0.0, 0.0, 0.004],
}


def layout(**changes: Any) -> ThrusterLayout:
    return schema.build(ThrusterLayout, {**THRUSTERS, **changes}, "parts")


def plant_by_thrusters() -> Rows:
    values = {
        **SHIP,
        **{f"vessel__thrusters__{name}": value for name, value in THRUSTERS.items()},
        "actuators__kind": "thrusters",
    }

    def demands(t: float) -> tuple[list[float], list[float]]:
        thrust = [6e4 * math.sin(t + k) * (0.2 if k == 2 else 1.0) for k in range(5)]
        return thrust, [0.0, 0.0, 0.0, 0.9 * t, 0.9 * math.sin(0.7 * t)]

    return sailed(values, demands, by_thrusters=True)


# -- control ----------------------------------------------------------------------------------------------------------


def ship_motion(t: float) -> Motion:
    """A ship in a slalom past 180 degrees, with drift."""
    psi = 2.6 + 0.6 * math.sin(0.3 * t) + 0.05 * t
    return Motion(12.0 + 1.8 * t, 4.0 + 0.4 * t - 0.1 * t * t, psi, 1.9, 0.2 * math.cos(0.3 * t), 0.18 * math.cos(0.3 * t) + 0.05)


KNOWN: dict[str, Any] = {
    **{"surge_inertia": 110e3, "sway_inertia": 190e3, "yaw_inertia": 600e5, "sway_yaw_inertia": 3.3e5, "yaw_sway_inertia": 2.5e5},
    **{"surge_force_limit": 1.9e5, "yaw_moment_limit": 2.7e6, "length": 29.0, "sway_force_per_yaw_moment": -0.002},
}
SLOW: dict[str, Any] = {"surge_lag": 0.5, "yaw_lag": 0.8, "surge_force_rate": 8e4, "yaw_moment_rate": 1e6, "surge_dead_time": 0.2}


def observed(**values: Any) -> Callable[[], Rows]:
    """Estimate and deviations, with held samples, outliers, a gap, a step back of the clock and a change of actuators."""

    def run() -> Rows:
        random = np.random.default_rng(3)
        observer = Observer(built(ObserverParameters, enabled=True, **values), KnownVessel(**KNOWN))
        rows, stamp, pose = [], 10**9, ship_motion(0.0)[:3]
        for k in range(150):
            t = k * PERIOD
            if k % 3 != 1:
                x, y, psi = ship_motion(t)[:3]
                noise = random.normal(size=3) * [0.3, 0.3, 0.01]
                pose = x + noise[0], y + noise[1], psi + noise[2]
                if k in (60, 61):
                    pose = pose[0] + 40.0, pose[1], pose[2]
            if k == 40:
                observer.take_for(KnownVessel(**KNOWN, **SLOW, yaw_dead_time=0.3))
            stamp += round(PERIOD * 1e9) + (2 * 10**9 if k == 90 else -(10**9) if k == 120 else 0)
            estimate = observer.update(stamp, pose, (6e4 * math.sin(0.5 * t), 9e5 * math.cos(0.4 * t)))
            rows.append([*estimate, *observer.deviation, float(observer.accepts)])
        return thinned(rows, 30)

    return run


def allocated(**changes: Any) -> Callable[[], Rows]:
    """Thrusts, angles and wrench for demands within and beyond what the thrusters give; with a stop and a clock set back."""

    def run() -> Rows:
        allocation, rows, stamp = Allocation(layout(**changes)), [], 0
        for k in range(60):
            t = k * PERIOD
            if k == 30:
                allocation.stop()
            stamp += -(3 * 10**8) if k == 45 else 10**8
            command = 1.1e5 * math.sin(1.3 * t), 7e5 * math.cos(0.9 * t + 0.2)
            found = allocation.step_at(stamp, command, 1.5 * math.cos(0.5 * t))
            rows.append([*found.thrust, *found.angle, *found.wrench, float(found.saturated)])
        return thinned(rows)

    return run


def controlled_point() -> Rows:
    """Ship, reference and errors at the centre of percussion, from rest into a slalom and back to station keeping."""
    point, filtered, rows = controlled_point_of(KnownVessel(**KNOWN), PERIOD), START, []
    for k in range(300):
        t = k * PERIOD
        speed = 2.0 * math.sin(math.pi * t / 30.0) ** 2
        psi = 3.0 + 0.5 * math.sin(0.4 * t)
        desired = Motion(10.0 + t, 4.0 - 0.3 * t, psi, speed, 0.1 * speed, 0.2 * math.cos(0.4 * t))
        change = Acceleration(0.4 * math.pi / 30.0 * math.sin(2.0 * math.pi * t / 30.0), 0.01, -0.08 * math.sin(0.4 * t))
        ship = desired._replace(x=desired.x + 0.7, y=desired.y - 0.4 * math.cos(t), psi=psi + 0.3 * math.sin(0.2 * t) - 6.2)
        at = to_controlled_point(ship, desired, change, filtered, point)
        filtered = at.delta
        rows.append([*at.motion, *at.desired, *at.acceleration, *at.back])
    return thinned(rows, 20)


PARTS: dict[str, tuple[Callable[[], Rows], float]] = {
    "reference_virtual_ship": (virtual_ship, NINTH),
    "reference_course": (course, NINTH),
    "reference_goals": (goals, NINTH),
    "reference_stream": (stream, NINTH),
    "reference_straight": (curve("straight", speed=1.4, rise_time=7.0), NINTH),
    "reference_circle": (curve("circle", radius=-43.0, speed=1.4, rise_time=7.0), SIXTH),
    "reference_figure_eight": (curve("figure_eight", length=-130.0, speed=1.1, rise_time=5.0), SIXTH),
    "reference_square": (curve("square", side=-90.0, corner_radius=15.0, speed=1.3, rise_time=0.0), SIXTH),
    "reference_path": (path, SIXTH),
    "reference_path_under_way": (path_under_way, SIXTH),
    "reference_survey": (survey(420.0, legs=3, leg_length=70.0, spacing=-75.0, speed=1.2, run_in=20.0), SIXTH),
    "reference_teardrops": (survey(420.0, legs=3, leg_length=60.0, spacing=12.0, speed=1.2, turn_radius=35.0), SIXTH),
    "reference_rectangle": (
        survey(420.0, rectangle=(40.0, -70.0, 80.0, 50.0), heading=0.6, spacing=30.0, speed=1.1, run_in=60.0),
        SIXTH,
    ),
    "plant_by_wrench": (plant_by_wrench, NINTH),
    "plant_by_thrusters": (plant_by_thrusters, NINTH),
    "observer": (observed(), SIXTH),
    "observer_of_waves": (observed(wave_period=5.0, wave_damping=0.15, surge_decay=0.1, actuator_lag=0.4), SIXTH),
    "allocation": (allocated(), SIXTH),
    "allocation_of_sectors": (
        allocated(kinds=["azimuth", "azimuth", "fixed", "fixed", "fixed"], angle_limit=[0.6, 0.5, math.pi, math.pi, math.pi]),
        SIXTH,
    ),
    "controlled_point": (controlled_point, NINTH),
}
"""What runs, and the relative tolerance of its numbers."""


def load() -> dict[str, Rows]:
    """The recorded rows of all parts."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def save(recorded: dict[str, Rows]) -> None:
    """Write the rows, one a line, so that a difference shows which have changed."""
    parts = (f' "{name}": [\n  ' + ",\n  ".join(map(json.dumps, rows)) + "\n ]" for name, rows in sorted(recorded.items()))
    FILE.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


def deviation(recorded: Rows, now: Rows, tolerance: float) -> float:
    """The largest deviation in terms of what is allowed, which follows from the largest value of each column; inf for others."""
    old, new = np.array(recorded), np.array(now)
    if old.shape != new.shape:
        return math.inf
    allowed = tolerance * np.abs(old).max(axis=0) + 1e-12
    return float(np.max(np.abs(new - old) / allowed))


def refresh() -> Iterator[str]:
    """Record all parts; a line for each that has changed."""
    old, new = load(), {name: run() for name, (run, _) in PARTS.items()}
    for name, (_, tolerance) in PARTS.items():
        ratio = deviation(old.get(name, []), new[name], tolerance)
        if ratio > 1.0:
            old[name] = new[name]
            yield f"{name}: changed, {ratio:.3g} x allowed"
    save({name: old[name] for name in PARTS})

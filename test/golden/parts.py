"""Recorded motions of the parts of a simulation: references, plant, observer, allocation, controlled point.

A golden run is of a whole scenario, in which a loop hides small mistakes of its parts, and most settings have their defaults.
Here each part runs alone, with settings that all differ. `make golden` records what has changed and shows it.
"""

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from golden.part_references import NINTH, REFERENCES, SIXTH
from golden.part_tools import COUPLED, PERIOD, Rows, built, thinned

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.loop.allocation import Allocation
from vessel_hsmc_ros.control.loop.control_period import START, controlled_point_of, to_controlled_point
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters
from vessel_hsmc_ros.plant.thruster_plant import make_plant

FILE = Path(__file__).parents[1] / "data" / "parts.json"


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


def sailed(values: dict[str, Any], inputs: Callable[[float], Any], by_thrusters: bool = False) -> Rows:
    """Measurement, state, applied wrench and disturbance, with an environment that changes twice, and a reset."""
    plant, rows, stamp = make_plant(built(PlantParameters, **values), PERIOD), [], 0
    environments = {
        40: {**ENVIRONMENT, "current": {"east": -0.1, "north": 0.5}, "periodic": {**ENVIRONMENT["periodic"], "frequency": 0.7}},
        60: {**ENVIRONMENT, "current": {"east": 0.2, "north": 0.1}, "periodic": {**ENVIRONMENT["periodic"], "frequency": 0.2}},
    }
    for k in range(120):
        if k == 90:
            plant.reset()
            stamp = 0
        time = stamp * 1e-9
        if k in environments:
            flat = {f"{kind}__{name}": value for kind, each in environments[k].items() for name, value in each.items()}
            plant.retune(built(DisturbanceParameters, **flat), time)
        measured, disturbance = plant.measured(stamp), plant.disturbance(time)
        wrench = plant.applied_thrusts(*inputs(time)) if by_thrusters else plant.applied(inputs(time))
        rows.append([*measured, *plant.state, *wrench, *disturbance, *plant.unforced_acceleration(), plant.periods_late])
        plant.advance(wrench, disturbance)
        stamp += round(PERIOD * 1e9)
    return thinned(rows) + thinned(rows[90:96], 6)


def plant_by_wrench() -> Rows:
    actuators: dict[str, Any] = {
        **{"surge_force_limit": 8e4, "yaw_moment_limit": 1.1e6, "surge_force_rate": 9e4, "yaw_moment_rate": 1.3e6},
        **{"surge_lag": 0.6, "yaw_lag": 0.35, "surge_dead_time": 0.31, "yaw_dead_time": 0.52},
    }
    values = {**SHIP, **{f"actuators__{name}": value for name, value in actuators.items()}}
    return sailed(values, lambda t: (1e5 * math.sin(1.1 * t + 0.3), 1.4e6 * math.cos(0.8 * t)))


def plain_plant() -> Rows:
    """A hull without coupling that goes astern, within the limits of its propulsion, with a dead time in yaw only."""
    values = {
        **{f"disturbance__{kind}__{name}": value for kind, each in ENVIRONMENT.items() for name, value in each.items()},
        **{"vessel__surge_force_limit": 7e4, "vessel__yaw_moment_limit": 9e5, "initial_velocity": (-1.5, -0.4, -0.06)},
        **{"actuators__yaw_dead_time": 0.3, "actuators__surge_force_limit": 9e4, "actuators__yaw_moment_limit": 2e6},
    }
    return sailed(values, lambda t: (-1e5 * math.cos(0.9 * t), 1.4e6 * math.sin(1.1 * t)))


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
        **{"actuators__kind": "thrusters", "initial_velocity": (0.2, -0.2, 0.05)},
    }

    def demands(t: float) -> tuple[list[float], list[float]]:
        thrust = [6e4 * math.sin(t + k - 2.5) * (0.2 if k == 2 else 1.0) for k in range(5)]
        return thrust, [0.0, 0.0, 0.0, 3.6 * math.sin(0.4 * t), 0.9 * math.sin(0.7 * t)]

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
    **REFERENCES,
    "plant_by_wrench": (plant_by_wrench, NINTH),
    "plain_plant": (plain_plant, NINTH),
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

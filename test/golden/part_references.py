"""The recorded references, each with settings that all differ."""

import math
from collections.abc import Callable
from typing import Any

from golden.part_tools import COUPLED, PERIOD, Rows, built, thinned

from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters, make_reference

SIXTH, NINTH = 1e-6, 1e-9
"""Relative tolerances: of what an iteration finds, and of what is computed in one go."""


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
    start: dict[str, Any] = {
        "initial_pose": (2.0, -3.0, 0.7),
        "initial_velocity": (0.4, 0.05, -0.02),
        "vessel__yaw_moment_limit": 2.2e6,
    }
    hull = {f"vessel__{name}": value for name, value in COUPLED.items()}
    return followed(330.0, mode="goal", **start, **hull, **times, **MOTION)


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
    # A moment with which the ship turns faster than the period resolves.
    start: dict[str, Any] = {"initial_pose": (-5.0, 0.0, 1.0), "vessel__yaw_moment_limit": 1e8}
    return followed(230.0, {k: arrival(k) for k in steps}, mode="goal", **start, **MOTION)


def curve(mode: str, **values: Any) -> Callable[[], Rows]:
    own = {f"{mode}__{name}": value for name, value in values.items()}
    return lambda: followed(120.0, mode=mode, initial_pose=(7.0, -2.0, 2.3), **own)


CORNERS: dict[str, Any] = {
    "path__waypoints": (40.0, 5.0, 75.0, 40.0, 60.0, 90.0, 5.0, 95.0, -20.0, 60.0),
    "path__speeds": (1.2, 1.0, 1.3, 0.8, 1.1),
    "path__corners": ("through", "over", "stop", "through", "through"),
}
LIMITED: dict[str, Any] = {"vessel__surge_force_limit": 7.2e4, "vessel__yaw_moment_limit": 1.5e6, "motion__current": 0.15}


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


def halted() -> Rows:
    """A ship that goes astern and drifts, a path, and another one when the turn on the spot to starboard has just begun."""
    events: dict[int, Callable[[Any], None]] = {
        30: lambda reference: reference.set_path([(10.0, -40.0)]),
        520: lambda reference: reference.set_path([(-30.0, 2.0)]),
        526: lambda reference: reference.set_path([(5.0, 30.0)]),
    }
    start: dict[str, Any] = {"initial_pose": (3.0, 1.0, 2.4), "initial_velocity": (-0.8, 0.15, -0.06)}
    return followed(150.0, events, mode="path", **start, **LIMITED, **MOTION)


def drifting() -> Rows:
    """A ship that only drifts aside."""
    start: dict[str, Any] = {"initial_pose": (3.0, 1.0, 2.4), "initial_velocity": (0.0, 0.3, 0.0)}
    return followed(30.0, mode="path", **start, **LIMITED, **MOTION)


def survey(seconds: float, **values: Any) -> Callable[[], Rows]:
    own = {f"lawnmower__{name}": value for name, value in values.items()}
    return lambda: followed(seconds, mode="lawnmower", initial_pose=(7.0, -2.0, 2.3), **own, **LIMITED, **MOTION)


REFERENCES: dict[str, tuple[Callable[[], Rows], float]] = {
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
    "reference_halted": (halted, SIXTH),
    "reference_drifting": (drifting, NINTH),
    "reference_survey": (survey(420.0, legs=3, leg_length=70.0, spacing=-75.0, speed=1.2, run_in=20.0), SIXTH),
    "reference_teardrops": (survey(420.0, legs=3, leg_length=60.0, spacing=12.0, speed=1.2, turn_radius=35.0), SIXTH),
    "reference_rectangle": (
        survey(420.0, rectangle=(40.0, -70.0, 80.0, 50.0), heading=0.6, spacing=30.0, speed=1.1, run_in=60.0),
        SIXTH,
    ),
}
"""What runs, and the relative tolerance of its numbers."""

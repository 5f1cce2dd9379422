"""The common interface of all references, and their factory."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.reference.course import CourseReference, CourseReferenceParameters
from vessel_hsmc_ros.reference.goal import GoalReference
from vessel_hsmc_ros.reference.goal_parameters import GoalParameters
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion, MotionLimits
from vessel_hsmc_ros.reference.path import PathParameters, PathReference
from vessel_hsmc_ros.reference.virtual_ship import ReferenceShip, VirtualShipParameters

Array = NDArray[np.float64]


class Reference(Protocol):
    """A desired motion in discrete time."""

    @property
    def state(self) -> Array:
        """Pose x, y, psi and body velocities u, v, r of the present step, shape (6,)."""
        ...

    def reset(self) -> None:
        """Return to the start."""
        ...

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities at the present step, shape (3,): m/s², m/s², rad/s²."""
        ...

    def advance(self) -> None:
        """Advance by one period."""
        ...


def _course(parameters: "ReferenceShipParameters", period: float) -> Reference:
    # The heading of a course reference is given by its program, so the initial heading is not used.
    x, y = parameters.initial_pose[:2]
    return CourseReference(parameters.course, (x, y), period)


def _motion(p: "ReferenceShipParameters", period: float) -> FilteredMotion:
    return FilteredMotion(p.initial_pose, p.initial_velocity, p.motion, p.vessel.coefficients(), period)


def _goal(parameters: "ReferenceShipParameters", period: float) -> Reference:
    return GoalReference(_motion(parameters, period), parameters.goal, period)


def _path(parameters: "ReferenceShipParameters", period: float) -> Reference:
    return PathReference(_motion(parameters, period), parameters.path, parameters.goal, period)


REFERENCES: dict[str, Callable[["ReferenceShipParameters", float], Reference]] = {
    "virtual_ship": ReferenceShip,
    "course": _course,
    "goal": _goal,
    "path": _path,
}


@dataclass(frozen=True)
class ReferenceShipParameters(VirtualShipParameters):
    """Parameters of all references: virtual ship, course, goals, path."""

    mode: str = parameter(
        "virtual_ship",
        "Reference to track: virtual_ship, the virtual ship (8); course, a heading over time; goal; or path, waypoints.",
        choices=tuple(REFERENCES),
    )
    course: CourseReferenceParameters = group(CourseReferenceParameters)
    motion: MotionLimits = group(MotionLimits)
    goal: GoalParameters = group(GoalParameters)
    path: PathParameters = group(PathParameters)


def make_reference(parameters: ReferenceShipParameters, period: float) -> Reference:
    """Make the reference that the parameters select.

    Args:
        parameters: Parameters of the node reference_ship.
        period: Time between two published states, s.

    Raises:
        ParameterError: times and values of an input, goal or waypoint list differ in number, or times do not increase.
    """
    return REFERENCES[parameters.mode](parameters, period)

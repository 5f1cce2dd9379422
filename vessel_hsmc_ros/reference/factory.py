"""What there is to follow, behind one way to make and to move it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.reference.course import CourseReference, CourseReferenceParameters
from vessel_hsmc_ros.reference.goal import GoalParameters, GoalReference
from vessel_hsmc_ros.reference.motion_filter import FilteredMotion, MotionLimits
from vessel_hsmc_ros.reference.path import PathParameters, PathReference
from vessel_hsmc_ros.reference.virtual_ship import ReferenceShip, VirtualShipParameters

Array = NDArray[np.float64]


class Reference(Protocol):
    """A desired motion in steps of a fixed period."""

    @property
    def state(self) -> Array:
        """The pose x, y, psi and the body velocities u, v, r of the present step, shape (6,)."""
        ...

    def reset(self) -> None:
        """Begin anew."""
        ...

    def acceleration(self) -> Array:
        """The derivatives of the body velocities at the present step, shape (3,)."""
        ...

    def advance(self) -> None:
        """Move on by one period."""
        ...


def _course(parameters: "ReferenceShipParameters", period: float) -> Reference:
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
    """What is followed: the paper's virtual ship, a heading alone, goals or waypoints."""

    mode: str = parameter(
        "virtual_ship",
        "What is followed: the virtual ship (8); a course, a heading over time; goals; or a path of waypoints.",
        choices=tuple(REFERENCES),
    )
    course: CourseReferenceParameters = group(CourseReferenceParameters)
    motion: MotionLimits = group(MotionLimits)
    goal: GoalParameters = group(GoalParameters)
    path: PathParameters = group(PathParameters)


def make_reference(parameters: ReferenceShipParameters, period: float) -> Reference:
    """The reference that the parameters ask for.

    Args:
        parameters: Those of the node reference_ship.
        period: Time between two published states, s.

    Raises:
        ParameterError: a programme, the goals or the waypoints make no sense.
    """
    return REFERENCES[parameters.mode](parameters, period)

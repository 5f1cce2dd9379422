"""What there is to follow, behind one way to make and to move it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.course_reference import CourseReference, CourseReferenceParameters
from vessel_hsmc_ros.reference_ship import ReferenceShip, VirtualShipParameters
from vessel_hsmc_ros.schema import group, parameter

Array = NDArray[np.float64]


class Reference(Protocol):
    """A desired motion in steps of a fixed period.

    Attributes:
        state: x, y, psi, u, v, r of the present step, shape (6,).
    """

    state: Array

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


REFERENCES: dict[str, Callable[["ReferenceShipParameters", float], Reference]] = {
    "virtual_ship": ReferenceShip,
    "course": _course,
}


@dataclass(frozen=True)
class ReferenceShipParameters(VirtualShipParameters):
    """What is followed: the paper's virtual ship, or a heading alone."""

    mode: str = parameter(
        "virtual_ship",
        "What is followed: the virtual ship (8), or a course, a heading over time.",
        choices=tuple(REFERENCES),
    )
    course: CourseReferenceParameters = group(CourseReferenceParameters)


def make_reference(parameters: ReferenceShipParameters, period: float) -> Reference:
    """The reference that the parameters ask for.

    Args:
        parameters: Those of the node reference_ship.
        period: Time between two published states, s.

    Raises:
        ParameterError: a programme makes no sense.
    """
    return REFERENCES[parameters.mode](parameters, period)

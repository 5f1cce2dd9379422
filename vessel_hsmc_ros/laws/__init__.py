"""Control laws, one file each, behind one way to make and to call them."""

import dataclasses
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros import schema
from vessel_hsmc_ros.exceptions import ParameterError
from vessel_hsmc_ros.laws.course import CourseController, CourseLawParameters
from vessel_hsmc_ros.laws.guided import GuidedController
from vessel_hsmc_ros.laws.guided_parameters import GuidedParameters
from vessel_hsmc_ros.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.los_pid import LosPidController, LosPidParameters
from vessel_hsmc_ros.laws.nmpc import NmpcController, NmpcParameters
from vessel_hsmc_ros.laws.pd import PdController, PdParameters
from vessel_hsmc_ros.laws.terms import Terms

__all__ = [
    "LAWS",
    "CourseLawParameters",
    "GuidedParameters",
    "HierarchicalParameters",
    "KnownVessel",
    "Law",
    "LosPidParameters",
    "NmpcParameters",
    "PdParameters",
    "Terms",
    "make_controller",
]

Array = NDArray[np.float64]


class LawKind(NamedTuple):
    """A law and the dataclass that declares its parameters."""

    controller: Any
    parameters: type


LAWS = {
    "hierarchical": LawKind(HierarchicalController, HierarchicalParameters),
    "guided": LawKind(GuidedController, GuidedParameters),
    "course": LawKind(CourseController, CourseLawParameters),
    "pd": LawKind(PdController, PdParameters),
    "los_pid": LawKind(LosPidController, LosPidParameters),
    "nmpc": LawKind(NmpcController, NmpcParameters),
}


class Law(Protocol):
    """What every law offers."""

    def update(self, time: float, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """One control period: the wrench to command, shape (2,), and every term that led to it."""
        ...

    def retune(self, parameters: Any) -> None:
        """Take other gains and keep what was learnt."""
        ...

    def reset(self) -> None:
        """Forget what was learnt."""
        ...


def make_controller(law: str, period: float, **parameters: object) -> Law:
    """Make a law from its name, its period and its parameters.

    Args:
        law: One of LAWS.
        period: Time between two updates, s.
        parameters: Names as in the YAML below `controller.<law>` (a name in a group with its dot, in a dictionary) and
            `controller.vessel`; the rest keep their defaults.

    Raises:
        ParameterError: the law or a parameter is unknown, out of range, or a gain is unstable at this period.
    """
    if law not in LAWS:
        raise ParameterError(f"controller.law = {law} is not allowed: it takes one of {', '.join(LAWS)}")
    hull = {field.name for field in dataclasses.fields(KnownVessel)}
    vessel = schema.build(KnownVessel, {k: v for k, v in parameters.items() if k in hull}, "controller.vessel")
    own = {k: v for k, v in parameters.items() if k not in hull}
    kind = LAWS[law]
    made: Law = kind.controller(schema.build(kind.parameters, own, f"controller.{law}"), vessel, period)
    return made

"""Control laws, one per file, with a common interface and factory."""

import dataclasses
from typing import Any, NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.laws.course import CourseController, CourseLawParameters
from vessel_hsmc_ros.laws.guided import GuidedController
from vessel_hsmc_ros.laws.guided_parameters import GuidedParameters
from vessel_hsmc_ros.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.laws.hierarchical_parameters import HierarchicalParameters
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.law import Law
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


class LawKind(NamedTuple):
    """The class of a law and the dataclass that declares its parameters."""

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


def make_controller(law: str, period: float, **parameters: object) -> Law[Any]:
    """Make a law from keyword arguments; for notebooks and tests.

    Args:
        law: Name of the law, one of LAWS.
        period: Control period, s.
        parameters: Values by the names that the YAML has below `controller.<law>` and `controller.vessel`; grouped parameters by
            their dotted name, `**{"network.width": 2.0}`. All others keep their defaults.

    Raises:
        ParameterError: the law or a parameter is unknown, a value is out of range, or a gain is unstable at this period.
    """
    if law not in LAWS:
        raise ParameterError(f"controller.law = {law} is not allowed: it takes one of {', '.join(LAWS)}")
    # In a scenario the vessel's parameters are a group of the controller, shared by all laws; here one namespace holds both.
    shared = {field.name for field in dataclasses.fields(KnownVessel)}
    vessel = schema.build(KnownVessel, {k: v for k, v in parameters.items() if k in shared}, "controller.vessel")
    own = {k: v for k, v in parameters.items() if k not in shared}
    kind = LAWS[law]
    made: Law[Any] = kind.controller(schema.build(kind.parameters, own, f"controller.{law}"), vessel, period)
    return made

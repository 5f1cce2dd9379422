"""Control laws, one per file, their registry and their factory."""

import dataclasses
from typing import Any

from vessel_hsmc_ros.control.guided.controller import GuidedController
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Law, guarded
from vessel_hsmc_ros.control.interface.registry import Registry
from vessel_hsmc_ros.control.laws.course import CourseController, PdController
from vessel_hsmc_ros.control.laws.hierarchical import HierarchicalController
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedController
from vessel_hsmc_ros.control.laws.los_pid import LosPidController
from vessel_hsmc_ros.control.laws.manoeuvre import ManoeuvreController, OpenLoop
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError

__all__ = ["LAWS", "KnownVessel", "construct", "make_controller"]

LAWS = Registry(
    HierarchicalController,
    HierarchicalPrintedController,
    GuidedController,
    CourseController,
    PdController,
    LosPidController,
    ManoeuvreController,
    OpenLoop,
)
"""Every law by its name: all that a law of this room is registered by; its parameters are those that its class declares."""


def make_controller(law: str, period: float, **parameters: object) -> Law[Any]:
    """Make a law from keyword arguments; for notebooks and tests.

    Args:
        law: Name of the law, one of LAWS.
        period: Control period, s.
        parameters: Values by the names that the YAML has below `controller.<law>` and `controller.vessel`; grouped parameters by
            their dotted name, `**{"network.width": 2.0}`. All others keep their defaults.

    Raises:
        ParameterError: the law or a parameter is unknown, a value is out of range, a gain is unstable at this period, or the
            declared vessel has a centre of percussion ahead, to which only the control loop carries ship and reference.
    """
    if law not in LAWS:
        raise ParameterError(f"controller.law must be one of {', '.join(LAWS)} (got {law})")
    # In a scenario the vessel's parameters are a group of the controller, shared by all laws; here one namespace holds both.
    shared = {field.name for field in dataclasses.fields(KnownVessel)}
    vessel = schema.build(KnownVessel, {k: v for k, v in parameters.items() if k in shared}, "controller.vessel")
    if vessel.controlled:
        raise ParameterError(
            f"controller.vessel.sway_yaw_inertia = {vessel.sway_yaw_inertia:g} puts the centre of percussion"
            f" {vessel.controlled:.3g} m ahead, which a law alone does not control:"
            ' simulate a scenario, or give controlled_point="origin"'
        )
    own = {k: v for k, v in parameters.items() if k not in shared}
    return construct(law, schema.build(LAWS[law].parameters, own, f"controller.{law}"), vessel.as_controlled(), period)


def construct(law: str, parameters: object, vessel: KnownVessel, period: float) -> Law[Any]:
    """Construct a law from instances of its parameters.

    Args:
        law: Name of the law, one of LAWS.
        parameters: An instance of the dataclass that the law declares.
        vessel: What the law knows of the ship.
        period: Control period, s.

    Raises:
        ParameterError: the law rejects its parameters, or its code fails.
    """
    with guarded(LAWS[law].controller, ParameterError):
        return LAWS[law].controller(parameters, vessel, period)

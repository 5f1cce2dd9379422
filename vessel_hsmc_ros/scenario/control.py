"""The control loop that the parameters of a controller describe; node, simulations and verification of bags run it."""

import dataclasses
from typing import Any

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.control.pivot import Pivot, pivot_of
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.laws import Law
from vessel_hsmc_ros.laws.guided_parameters import by_hand_or_derived
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import Scenario, make_law, make_observer


def make_pivot(parameters: ControllerParameters) -> Pivot:
    """Make the point that a controller controls.

    Raises:
        ParameterError: as `KnownVessel.pivot`.
    """
    return pivot_of(parameters.vessel, 1.0 / parameters.rate_hz)


def make_control_loop(parameters: ControllerParameters, law: Law[Any] | None = None) -> ControlLoop:
    """Make the control loop of a controller, with the law that its parameters select or with another one.

    Raises:
        ParameterError: as `make_law`.
    """
    law = law or make_law(parameters)
    return ControlLoop(law, RateGrid(parameters.rate_hz), make_observer(parameters), make_pivot(parameters))


def values_in_use(scenario: Scenario, node: str) -> dict[str, schema.Value]:
    """The values of a node's parameters by their dotted names, with the derived gains in the place of -1.

    Raises:
        ParameterError: as `by_hand_or_derived`.
    """
    parameters = getattr(scenario, node)
    if node == "controller":
        gains = by_hand_or_derived(parameters.guided, parameters.vessel.as_controlled())
        parameters = dataclasses.replace(parameters, guided=gains)
    return schema.flatten(parameters)

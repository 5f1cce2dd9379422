"""The control loop that the parameters of a controller describe; node, simulations and verification of bags run it."""

from typing import Any

from vessel_hsmc_ros.control.control_loop import ControlLoop
from vessel_hsmc_ros.control.pivot import Pivot, pivot_of
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.laws import Law
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import make_law, make_observer


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

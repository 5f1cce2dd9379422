"""The virtual ship that generates the desired trajectory, equation (8).

It has the dynamics (6) without disturbance and is driven by its own inputs tau_1d, tau_2d, so whatever it does a ship of
the same kind can do. Its states and inputs carry the suffix d in the paper.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.schema import group, parameter
from vessel_sim_node.integrate import rk4
from vessel_sim_node.plant import VesselParameters, derivative

Array = NDArray[np.float64]

CALM = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VirtualShipParameters:
    """Where the virtual ship starts, what it is and what drives it."""

    initial_pose: tuple[float, ...] = parameter(
        (15.0, 15.0, 0.0), "Position x, y [m] and heading at the start.", low=-1e6, high=1e6, length=3
    )
    initial_velocity: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0), "Surge, sway and yaw velocity at the start.", low=-1e3, high=1e3, length=3
    )
    surge_force: float = parameter(
        1e5, "Constant surge force on the virtual ship.", unit="N", low=-1e9, high=1e9, symbol="tau_1d"
    )
    yaw_moment: float = parameter(
        1e6, "Constant yaw moment on the virtual ship.", unit="N·m", low=-1e12, high=1e12, symbol="tau_2d"
    )
    vessel: VesselParameters = group(VesselParameters)


class ReferenceShip:
    """The virtual ship (8), moved in steps of 1/rate.

    Args:
        parameters: The virtual ship's parameters.
        period: Time between two published states, s.
    """

    def __init__(self, parameters: VirtualShipParameters, period: float) -> None:
        self._parameters = parameters
        self._period = period
        self._vessel = parameters.vessel.coefficients()
        self._wrench = (parameters.surge_force, parameters.yaw_moment)
        self.reset()

    def reset(self) -> None:
        """Put the virtual ship back to its start."""
        self.state: Array = np.array(self._parameters.initial_pose + self._parameters.initial_velocity)

    def acceleration(self) -> Array:
        """du_d, dv_d, dr_d of (8) at the present state, shape (3,): m/s², m/s², rad/s²."""
        return derivative(self.state, self._wrench, CALM, self._vessel)[3:]

    def advance(self) -> None:
        """Move on by one period."""
        self.state = rk4(self.state, self._wrench, CALM, self._vessel, self._period)

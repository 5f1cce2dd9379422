"""The plant in steps of a fixed rate: what the sim node publishes and what the offline loop integrates."""

import math
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.exceptions import SimulationError
from vessel_hsmc_ros.schema import group, parameter
from vessel_sim_node.actuators import ActuatorParameters, applied
from vessel_sim_node.disturbance import DisturbanceParameters, acceleration, periodic_wrench
from vessel_sim_node.integrate import rk4
from vessel_sim_node.plant import Array, VesselParameters


@dataclass(frozen=True)
class PlantParameters:
    """The plant: where the ship starts, what it is and what acts on it."""

    initial_pose: tuple[float, ...] = parameter(
        (5.0, 1.0, math.pi / 4), "Position x, y [m] and heading at the start.", low=-1e6, high=1e6, length=3
    )
    initial_velocity: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0), "Surge, sway and yaw velocity at the start.", low=-1e3, high=1e3, length=3
    )
    substeps: int = parameter(1, "Runge-Kutta steps between two odometry messages.", low=1, high=1000)
    vessel: VesselParameters = group(VesselParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    actuators: ActuatorParameters = group(ActuatorParameters)


class Simulator:
    """A ship that moves in steps of 1/rate while its inputs are held.

    Args:
        parameters: The plant's parameters.
        period: Time between two odometry messages, s.
    """

    def __init__(self, parameters: PlantParameters, period: float) -> None:
        self._parameters = parameters
        self._period = period
        self._vessel = parameters.vessel.coefficients()
        self.reset()

    def reset(self) -> None:
        """Put the ship back where it started, at its initial velocity."""
        self.state: Array = np.array(self._parameters.initial_pose + self._parameters.initial_velocity)

    def disturbance(self, time: float) -> tuple[float, float, float]:
        """The disturbing wrench at a time since the start: N, N, N·m."""
        return periodic_wrench(time, self._parameters.disturbance.periodic)

    def applied(self, command: tuple[float, float]) -> tuple[float, float]:
        """The wrench that reaches the hull of a commanded one: N, N·m.

        Raises:
            SimulationError: the command is not finite.
        """
        if not (math.isfinite(command[0]) and math.isfinite(command[1])):
            raise SimulationError(
                f"commanded wrench ({command[0]} N, {command[1]} N·m) is not allowed: both must be finite numbers"
            )
        return applied(command, self._parameters.actuators)

    def advance(self, wrench: tuple[float, float], disturbance: tuple[float, float, float]) -> None:
        """Move on by one period under a held wrench and disturbance.

        Raises:
            SimulationError: the motion is no longer finite.
        """
        step = self._period / self._parameters.substeps
        push = acceleration(disturbance, self._vessel)
        state = self.state
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                for _ in range(self._parameters.substeps):
                    state = rk4(state, wrench, push, self._vessel, step)
            except ValueError:  # the cosine of an infinite heading
                state = np.full(6, np.nan)
        if not np.isfinite(state).all():
            raise SimulationError(
                f"the ship's motion is no longer finite under {wrench[0]:g} N and {wrench[1]:g} N·m:"
                " the closed loop is unstable or the step too long"
            )
        self.state = state

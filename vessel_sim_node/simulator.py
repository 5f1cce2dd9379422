"""The plant in steps of a fixed rate: what the sim node publishes and what the offline loop integrates."""

import math
from dataclasses import dataclass

import numpy as np

from vessel_hsmc_ros.exceptions import SimulationError
from vessel_hsmc_ros.schema import group, parameter
from vessel_sim_node.actuators import ActuatorParameters, applied
from vessel_sim_node.disturbance import DisturbanceParameters, Wrench, acceleration, body_wrench, periodic_wrench, total
from vessel_sim_node.integrate import rk4
from vessel_sim_node.plant import Array, VesselParameters, unforced_in_current
from vessel_sim_node.sensors import SensorParameters, Sensors


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
    seed: int = parameter(
        0, "Seed of all that is random; the same seed gives the same run, to the last bit.", low=0, high=2**31 - 1
    )
    vessel: VesselParameters = group(VesselParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    actuators: ActuatorParameters = group(ActuatorParameters)
    sensors: SensorParameters = group(SensorParameters)


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
        wind, current = parameters.disturbance.earth_fixed, parameters.disturbance.current
        self._wind = wind.east_force, wind.north_force
        self._current = current.east, current.north
        self.perfect_sensors = parameters.sensors.perfect()
        self.reset()

    def reset(self) -> None:
        """Put the ship back where it started, at its initial velocity, and what is random back to its seed."""
        self.state: Array = np.array(self._parameters.initial_pose + self._parameters.initial_velocity)
        self._sensors = Sensors(self._parameters.sensors, np.random.default_rng(self._parameters.seed))

    def measured(self, stamp: int) -> Array:
        """What the sensors say of the state, shape (6,); to be asked once a step, for noise is drawn.

        Args:
            stamp: Time since the start, ns.
        """
        return self.state if self.perfect_sensors else self._sensors.measure(stamp, self.state)

    def disturbance(self, time: float) -> Wrench:
        """The sum of all disturbing wrenches at a time since the start: N, N, N·m."""
        push = periodic_wrench(time, self._parameters.disturbance.periodic)
        return total(push, body_wrench(self._wind, float(self.state[2])))

    def unforced_acceleration(self) -> tuple[float, float, float]:
        """What the ship's motion through the water alone does to it, f_u, f_v, f_r of (7): m/s², m/s², rad/s²."""
        return unforced_in_current(self.state, self._vessel, self._current)

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

    def advance(self, wrench: tuple[float, float], disturbance: Wrench) -> None:
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
                    state = rk4(state, wrench, push, self._vessel, step, self._current)
            except ValueError:  # the cosine of an infinite heading
                state = np.full(6, np.nan)
        if not np.isfinite(state).all():
            raise SimulationError(
                f"the ship's motion is no longer finite under {wrench[0]:g} N and {wrench[1]:g} N·m:"
                " the closed loop is unstable or the step too long"
            )
        self.state = state

"""The virtual ship that generates the desired trajectory, equation (8).

It has the dynamics (6) without disturbance and is driven by its own inputs tau_1d, tau_2d, so its trajectory is feasible for a
ship of the same kind. Its states and inputs carry the suffix d in the paper. The inputs are functions of time, which the paper
does not give; each is constant over a period.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.reference.input_program import InputProgram, RampParameters, SineParameters, StepsParameters, program_of
from vessel_sim_node.integrate import rk4
from vessel_sim_node.plant import VesselParameters, derivative, divergence, initial_pose, initial_velocity

Array = NDArray[np.float64]

UNDISTURBED = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class VirtualShipParameters:
    """Initial state, inputs and coefficients of the virtual ship."""

    initial_pose: tuple[float, ...] = initial_pose((15.0, 15.0, 0.0))
    initial_velocity: tuple[float, ...] = initial_velocity()
    surge_force: float = parameter(
        1e5, "Constant part of the surge force on the virtual ship.", unit="N", low=-1e9, high=1e9, symbol="tau_1d", tunable=True
    )
    surge_force_sine: SineParameters = group(SineParameters, tunable=True)
    surge_force_steps: StepsParameters = group(StepsParameters)
    surge_force_ramp: RampParameters = group(RampParameters)
    yaw_moment: float = parameter(
        1e6,
        "Constant part of the yaw moment on the virtual ship.",
        unit="N·m",
        low=-1e12,
        high=1e12,
        symbol="tau_2d",
        tunable=True,
    )
    yaw_moment_sine: SineParameters = group(SineParameters, tunable=True)
    yaw_moment_steps: StepsParameters = group(StepsParameters)
    yaw_moment_ramp: RampParameters = group(RampParameters)
    vessel: VesselParameters = group(VesselParameters)


class ReferenceShip:
    """The virtual ship (8) in discrete time.

    Args:
        parameters: Parameters of the virtual ship.
        period: Time between two published states, s.

    Attributes:
        state: x_d, y_d, psi_d, u_d, v_d, r_d, shape (6,).

    Raises:
        ParameterError: times and values of an input differ in number, or the times do not increase.
    """

    def __init__(self, parameters: VirtualShipParameters, period: float) -> None:
        self._parameters = parameters
        self._period = period
        self._vessel = parameters.vessel.coefficients()
        self.reset()

    @staticmethod
    def _programs(parameters: VirtualShipParameters) -> tuple[InputProgram, InputProgram]:
        surge_force, yaw_moment = (program_of(parameters, name, "reference_ship") for name in ("surge_force", "yaw_moment"))
        return surge_force, yaw_moment

    def reset(self) -> None:
        """Return to the initial state and the start of the inputs."""
        self.state: Array = np.array(self._parameters.initial_pose + self._parameters.initial_velocity)
        self._surge_force, self._yaw_moment = self._programs(self._parameters)
        self._steps = 0
        self._read_inputs()

    def retune(self, parameters: VirtualShipParameters) -> None:
        """Take changed inputs from the next step on; the phase of a sine whose frequency changes is continuous.

        Raises:
            ParameterError: the times of an input's programme do not fit its values.
        """
        # Validate the new inputs first: if they are rejected, the old ones stay in effect.
        surge_force, yaw_moment = self._programs(parameters)
        time = self._steps * self._period
        surge_force.continue_phase(self._surge_force, time)
        yaw_moment.continue_phase(self._yaw_moment, time)
        self._parameters, self._surge_force, self._yaw_moment = parameters, surge_force, yaw_moment

    def acceleration(self) -> Array:
        """Derivatives du_d, dv_d, dr_d of (8) at the present state, shape (3,): m/s², m/s², rad/s²."""
        return derivative(self.state, self._wrench, UNDISTURBED, self._vessel)[3:]

    def advance(self) -> None:
        """Advance by one period under the inputs at its beginning.

        Raises:
            SimulationError: the motion is no longer finite.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                self.state = rk4(self.state, self._wrench, UNDISTURBED, self._vessel, self._period)
            except ValueError:  # the cosine of an infinite heading
                self.state = np.full(6, np.nan)
        if not np.isfinite(self.state).all():
            cause = f"under {self._wrench[0]:g} N and {self._wrench[1]:g} N·m: they do not fit its hull, or the step is too long"
            raise divergence("virtual ship", self._steps * self._period, cause, self._parameters.vessel)
        self._steps += 1
        self._read_inputs()

    def _read_inputs(self) -> None:
        time = self._steps * self._period
        self._wrench = self._surge_force.value(time), self._yaw_moment.value(time)

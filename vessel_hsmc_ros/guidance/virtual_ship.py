"""The virtual ship that generates the desired trajectory, equation (8).

It has the dynamics (6) without disturbance and is driven by its own inputs tau_1d, tau_2d, so its trajectory is feasible for a
ship of the same kind. Its states and inputs carry the suffix d in the paper. The inputs are functions of time, which the paper
does not give; each is constant over a period.
"""

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_motion
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.guidance.input_program import (
    Program,
    RampParameters,
    SineParameters,
    StepsParameters,
    input_value,
    program_of,
)
from vessel_hsmc_ros.guidance.kernel_reference import KernelReference
from vessel_hsmc_ros.plant.dynamics import (
    STILL_WATER,
    Vessel,
    VesselParameters,
    divergence,
    initial_pose,
    initial_velocity,
    rate_of_motion,
    rk4_step,
)

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


class ShipConstants(NamedTuple):
    """Inputs and hull of the virtual ship, and the length of a step, s."""

    surge_force: Program
    yaw_moment: Program
    vessel: Vessel
    period: float


class ShipMemory(NamedTuple):
    """State, inputs of the present step, number of steps, and phases by which changes have shifted the sines, rad."""

    motion: Motion
    tau: tuple[float, float]
    steps: int
    offset: tuple[float, float]


@kernel
def inputs(steps: int, offset: tuple[float, float], c: ShipConstants) -> tuple[float, float]:
    """tau_1d [N] and tau_2d [N·m] of a step."""
    time = steps * c.period
    return input_value(c.surge_force, offset[0], time), input_value(c.yaw_moment, offset[1], time)


@kernel
def move(m: ShipMemory, c: ShipConstants) -> ShipMemory:
    """The virtual ship one period later, under the inputs at the beginning of the period."""
    motion = rk4_step(m.motion, (m.tau[0], 0.0, m.tau[1]), UNDISTURBED, c.vessel, c.period, STILL_WATER)
    return ShipMemory(motion, inputs(m.steps + 1, m.offset, c), m.steps + 1, m.offset)


@kernel
def read(m: ShipMemory, c: ShipConstants) -> tuple[Motion, Acceleration]:
    """State of the virtual ship, and the derivatives of its velocities by (8)."""
    rate = rate_of_motion(m.motion, (m.tau[0], 0.0, m.tau[1]), UNDISTURBED, c.vessel, STILL_WATER)
    return m.motion, Acceleration(rate.u, rate.v, rate.r)


class ReferenceShip(KernelReference):
    """The virtual ship (8) in discrete time.

    `period`: time between two published states, s.

    Raises:
        ParameterError: times and values of an input differ in number, or the times do not increase.
    """

    move, read = staticmethod(move), staticmethod(read)

    def __init__(self, parameters: VirtualShipParameters, period: float) -> None:
        self._period = period
        self._take(parameters)
        self.reset()

    def _take(self, parameters: VirtualShipParameters) -> None:
        surge_force, yaw_moment = (program_of(parameters, name, "reference_ship") for name in ("surge_force", "yaw_moment"))
        self.constants = ShipConstants(surge_force, yaw_moment, parameters.vessel.coefficients(), self._period)
        self._parameters = parameters

    def reset(self) -> None:
        """Return to the initial state and the start of the inputs."""
        start = as_motion(self._parameters.initial_pose + self._parameters.initial_velocity)
        self.memory = ShipMemory(start, inputs(0, (0.0, 0.0), self.constants), 0, (0.0, 0.0))

    def retune(self, parameters: VirtualShipParameters) -> None:
        """Take changed inputs from the next step on; the phase of a sine whose frequency changes is continuous.

        Raises ParameterError if the times of an input's programme do not fit its values.
        """
        old, m = self.constants, self.memory
        self._take(parameters)
        # Equal angles frequency·time + offset at the time of the change.
        time, new = m.steps * self._period, self.constants
        surge = m.offset[0] + (old.surge_force.frequency - new.surge_force.frequency) * time
        yaw = m.offset[1] + (old.yaw_moment.frequency - new.yaw_moment.frequency) * time
        self.memory = m._replace(offset=(surge, yaw))

    def advance(self) -> None:
        """Advance by one period under the inputs at its beginning. Raises SimulationError if the motion is no longer finite."""
        before = self.memory
        with suppress(ValueError):  # the cosine of an infinite heading
            self.memory = move(before, self.constants)
        if self.memory is before or not all(map(math.isfinite, self.memory.motion)):
            cause = f"under {before.tau[0]:g} N and {before.tau[1]:g} N·m: they do not fit its hull, or the step is too long"
            raise divergence("virtual ship", before.steps * self._period, cause, self._parameters.vessel)

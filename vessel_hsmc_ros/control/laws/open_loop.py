"""Open-loop inputs: a surge force and a yaw moment over time, without feedback.

tau_1(t) = F_i, tau_2(t) = N_i from t_i until t_(i+1), and zero before t_0

| symbol | meaning | unit |
|---|---|---|
| t_i | times of the steps, from the first control step on | s |
| F_i, N_i | surge force and yaw moment from t_i on | N, N·m |

It tracks nothing: it sails the manoeuvres from which the hull data of a ship are identified. The ship's limits are not applied
here, the actuators of the ship have them.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.kernel_law import NO_NETWORKS, KernelLaw
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.schema import parameter

EARLY = 0.5e-9  # tolerance of half a nanosecond, s: a step takes effect at its instant in spite of rounded times


def inputs(what: str, unit: str) -> tuple[float, ...]:
    """Declare the values of an input, zero by default."""
    return parameter((0.0,), f"{what} from each time on.", unit=unit, low=-1e15, high=1e15)


@dataclass(frozen=True)
class OpenLoopParameters:
    """The inputs over time, in three lists of equal length."""

    times: tuple[float, ...] = parameter(
        (0.0,), "Times of the steps since the first control step, increasing.", unit="s", low=0.0, high=1e6
    )
    surge_force: tuple[float, ...] = inputs("Surge force", "N")
    yaw_moment: tuple[float, ...] = inputs("Yaw moment", "N·m")


class Inputs(NamedTuple):
    """The constants of the law: t_i, F_i and N_i, shape (n,), and the control period, s."""

    times: Array
    surge_force: Array
    yaw_moment: Array
    period: float


class Memory(NamedTuple):
    """Number of control steps, and of steps of the inputs that have begun; W has the shape (0, 0)."""

    updates: int
    begun: int
    W: Array


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    heading_error: float


@kernel
def step(
    motion: Motion, desired: Motion, _acceleration: Acceleration, m: Memory, c: Inputs
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """The inputs of the present time.

    `motion`, `desired`, `_acceleration`: ship, reference, and derivatives of its velocities; they change no input.
    """
    begun, time = m.begun, m.updates * c.period + EARLY
    while begun < len(c.times) and c.times[begun] <= time:
        begun += 1
    wrench = (float(c.surge_force[begun - 1]), float(c.yaw_moment[begun - 1])) if begun > 0 else (0.0, 0.0)
    return wrench, StepTerms(wrap(motion.psi - desired.psi)), Memory(m.updates + 1, begun, m.W)


class OpenLoop(KernelLaw[OpenLoopParameters]):
    """The law; time counts from its first step.

    `vessel`: not used.

    Raises:
        ParameterError: the lists differ in length, or the times do not increase.
    """

    name = "open_loop"
    keeps_limits = False
    tracks = False
    kernel = staticmethod(step)
    terms = StepTerms

    def retune(self, parameters: OpenLoopParameters) -> None:
        """Take new inputs."""
        lists = times, surge, yaw = parameters.times, parameters.surge_force, parameters.yaw_moment
        lengths = [len(values) for values in lists]
        if len(set(lengths)) > 1:
            raise ParameterError(
                "controller.open_loop.times, surge_force and yaw_moment are lists of equal length, not of {}, {} and {}".format(
                    *lengths
                )
            )
        for before, after in pairwise(parameters.times):
            if after <= before:
                raise ParameterError(f"controller.open_loop.times must increase: {after:g} s follows {before:g} s")
        self.constants = Inputs(np.array(times), np.array(surge), np.array(yaw), self.period)

    def reset(self) -> None:
        """Begin again."""
        self.memory = Memory(0, 0, NO_NETWORKS)

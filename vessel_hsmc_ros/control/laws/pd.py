"""The PD heading controller that case 1 compares with the sliding-mode law.

tau_2 = m33·dr_d + d_r·r_d - Kp·z3e - Kd·dz3e

| symbol | meaning | unit | equation |
|---|---|---|---|
| z3e, dz3e | heading error and its rate | rad, rad/s | (11) |
| r_d, dr_d | desired yaw rate and its derivative | rad/s, rad/s² | (8) |
| Kp, Kd | gains on the error and on its rate | N·m/rad, N·m·s/rad | - |
| d_r | assumed linear yaw damping | kg·m²/s | (6) |
| tau_1, tau_2 | constant surge force, yaw moment | N, N·m | - |

The paper gives neither the form nor the gains of its PD controller. The first two terms are the usual reference feedforward of a
course autopilot, the moment that a ship with linear damping needs for the desired motion; without it a PD controller lags behind
a sine. The gains are chosen to reproduce Figures 1 and 2, where the controller takes most of a cycle to converge and deviates by
ten degrees under the disturbance: the damping ratio is 2.4, and the disturbance of section 6.2, a moment that oscillates between
0 and 1900e2 N·m, turns the ship by up to 10.9°.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.kernel_law import NO_NETWORKS, KernelLaw
from vessel_hsmc_ros.control.laws.course import thrust
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, wrap
from vessel_hsmc_ros.core.schema import parameter


def gain(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a non-negative gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=1e15, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class PdParameters:
    """Gains of the PD controller, all of them our choice: the paper gives none."""

    heading_gain: float = gain(1.0e6, "Yaw moment per heading error.", "N·m/rad", "Kp")
    yaw_rate_gain: float = gain(3.0e7, "Yaw moment per yaw-rate error.", "N·m·s/rad", "Kd")
    yaw_damping: float = gain(802e4, "Assumed linear yaw damping, for the feedforward of the desired yaw rate.", "kg·m²/s", "d_r")
    surge_force: float = thrust()


class Gains(NamedTuple):
    """The constants of the law by their symbols."""

    Kp: float
    Kd: float
    d_r: float
    tau_1: float
    m33: float


class Memory(NamedTuple):
    """There is no internal state: W has the shape (0, 0)."""

    W: NDArray[np.float64]


class StepTerms(NamedTuple):
    """The terms of a step, by their names in `Terms`."""

    heading_error: float
    heading_error_rate: float


@kernel
def step(
    motion: Motion, desired: Motion, acceleration: Acceleration, m: Memory, g: Gains
) -> tuple[tuple[float, float], StepTerms, Memory]:
    """The wrench for the present errors.

    `m`: internal state, returned unchanged.
    """
    z3e, dz3e = wrap(motion.psi - desired.psi), motion.r - desired.r
    # The moment that moves a ship with linear damping along the desired heading without any error.
    feedforward = g.m33 * acceleration.dr + g.d_r * desired.r
    tau_2 = feedforward - g.Kp * z3e - g.Kd * dz3e
    return (g.tau_1, tau_2), StepTerms(z3e, dz3e), m


class PdController(KernelLaw[PdParameters]):
    """The law; it has no internal state.

    `vessel`: the known inertia; the limits are not used. `period`: control period, s; the law does not depend on it.
    """

    name = "pd"
    keeps_limits = False
    tracks = False
    kernel = staticmethod(step)
    terms = StepTerms
    memory = Memory(NO_NETWORKS)

    def retune(self, parameters: PdParameters) -> None:
        """Take new gains."""
        self.constants = Gains(**schema.symbols(parameters), m33=schema.symbols(self.vessel)["m33"])

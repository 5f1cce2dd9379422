"""The PD controller that case 1 puts beside the sliding-mode law.

tau_2 = m33·dr_d + d_r·r_d - Kp·z3e - Kd·dz3e

| symbol | meaning | unit | equation |
|---|---|---|---|
| z3e, dz3e | heading error and its rate | rad, rad/s | (11) |
| r_d, dr_d | desired yaw rate and its derivative | rad/s, rad/s² | (8) |
| Kp, Kd | gains on the error and on its rate | N·m/rad, N·m·s/rad | - |
| d_r | what the law is told of the linear yaw damping | kg·m²/s | (6) |
| tau_1, tau_2 | surge force, held; yaw moment | N, N·m | - |

The paper gives neither its form nor its gains. The first two terms are the usual feedforward of a course autopilot, the moment
that a ship with linear damping needs for the desired motion: without them no PD follows a sine. The gains are chosen so that the
controller does what Figures 1 and 2 show of it, takes most of a cycle to converge and is driven off by ten degrees: the damping
is 2.4 times critical, and the disturbance of section 6.2, 950e2 N·m with a swell that doubles it, turns the ship by up to 10.9°.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.laws.course import thrust
from vessel_hsmc_ros.laws.law import Law
from vessel_hsmc_ros.laws.terms import Terms

Array = NDArray[np.float64]


def gain(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a non-negative moment per error, which may be changed while the law runs."""
    return parameter(default, description, unit=unit, low=0.0, high=1e15, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class PdParameters:
    """All ours: the paper gives nothing."""

    heading_gain: float = gain(1.0e6, "Yaw moment per heading error.", "N·m/rad", "Kp")
    yaw_rate_gain: float = gain(3.0e7, "Yaw moment per error of the yaw rate.", "N·m·s/rad", "Kd")
    yaw_damping: float = gain(802e4, "Linear yaw damping, for the feedforward of the desired yaw rate.", "kg·m²/s", "d_r")
    surge_force: float = thrust()


class Gains(NamedTuple):
    """Everything constant in the law, by its symbols."""

    Kp: float
    Kd: float
    d_r: float
    tau_1: float
    m33: float


class PdController(Law[PdParameters]):
    """The law; it remembers nothing.

    Args:
        parameters: Gains.
        vessel: What is known of the ship; its limits are left aside.
        period: Time between two updates, s; the law does not depend on it.
    """

    def retune(self, parameters: PdParameters) -> None:
        """Take other gains."""
        self._gains = Gains(**schema.symbols(parameters), m33=schema.symbols(self._vessel)["m33"])

    def reset(self) -> None:
        """Nothing to forget."""

    def _step(self, state: Array, reference: Array, reference_acceleration: Array) -> tuple[Array, Terms]:
        """The wrench from the present errors."""
        g = self._gains
        z3e, dz3e = wrap(float(state[2] - reference[2])), float(state[5] - reference[5])
        feedforward = g.m33 * float(reference_acceleration[2]) + g.d_r * float(reference[5])
        tau_2 = feedforward - g.Kp * z3e - g.Kd * dz3e
        return np.array([g.tau_1, tau_2]), Terms(heading_error=z3e, heading_error_rate=dz3e)

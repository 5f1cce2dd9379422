"""A reference filter: surge-speed and yaw-rate setpoints become a motion that a ship with propeller and rudder can follow.

| symbol | meaning | unit |
|---|---|---|
| x, y, psi, u, v, r | pose and body velocities of the reference | m, m, rad, m/s, m/s, rad/s |
| a, alpha | surge and yaw acceleration | m/s², rad/s² |
| u_c, r_c | setpoints of surge speed and yaw rate | m/s, rad/s |
| T_f, T_a | time constants of velocity and acceleration | s, s |

da = (sat((u_c - u)/T_f) - a)/T_a and likewise for alpha; dv = f_v(u, v, r) of (7), because sway is not actuated: the sway
velocity is that of the unforced hull. Position, velocity and acceleration are continuous and limited. The heading is not wrapped.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.schema import parameter
from vessel_sim_node.plant import Vessel, unforced_acceleration

Array = NDArray[np.float64]

T_F, T_A = 1.5, 0.4
"""Time constants, s; the damping ratio of velocity and acceleration is sqrt(T_F/T_A)/2 = 0.97, almost critical."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits of the reference's motion; the ship must be able to exceed them a little in order to correct errors."""

    speed: float = parameter(1.5, "Largest surge velocity.", unit="m/s", low=1e-3, high=1e3)
    acceleration: float = parameter(0.2, "Largest surge acceleration.", unit="m/s²", low=1e-6, high=1e3)
    yaw_rate: float = parameter(0.1, "Largest yaw rate.", unit="rad/s", low=1e-6, high=1e2)
    yaw_acceleration: float = parameter(0.02, "Largest yaw acceleration.", unit="rad/s²", low=1e-6, high=1e2)


class FilteredMotion:
    """The motion of a reference in discrete time.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).
        limits: Limits of the motion.

    Args:
        pose, velocity: Initial x, y, psi and u, v, r.
        limits: Limits of the motion.
        vessel: Coefficients of the hull, for its sway.
        period: Length of a step, s.
    """

    def __init__(
        self, pose: tuple[float, ...], velocity: tuple[float, ...], limits: MotionLimits, vessel: Vessel, period: float
    ) -> None:
        self.limits = limits
        self._start = np.array(pose + velocity)
        self._vessel = vessel
        self._period = period
        self.reset()

    def reset(self) -> None:
        """Return to the initial state."""
        self.state: Array = self._start.copy()
        self._a = self._alpha = 0.0

    def acceleration(self) -> Array:
        """Derivatives du, dv, dr of the body velocities, shape (3,): m/s², m/s², rad/s²."""
        u, v, r = self.state[3:].tolist()
        return np.array([self._a, unforced_acceleration(u, v, r, self._vessel)[1], self._alpha])

    def advance(self, u_c: float, r_c: float) -> None:
        """Advance by one period towards the setpoints, by one Runge-Kutta step.

        Args:
            u_c: Surge-speed setpoint, m/s; limited to the largest speed.
            r_c: Yaw-rate setpoint, rad/s; limited to the largest yaw rate.
        """
        u_c, r_c = clip(u_c, self.limits.speed), clip(r_c, self.limits.yaw_rate)
        # Velocity and acceleration are integrated with the pose, so that all published derivatives are consistent.
        h, s = self._period, np.array([*self.state, self._a, self._alpha])
        k1 = self._derivative(s, u_c, r_c)
        k2 = self._derivative(s + 0.5 * h * k1, u_c, r_c)
        k3 = self._derivative(s + 0.5 * h * k2, u_c, r_c)
        k4 = self._derivative(s + h * k3, u_c, r_c)
        s = s + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
        self.state, self._a, self._alpha = s[:6], float(s[6]), float(s[7])

    def _derivative(self, s: Array, u_c: float, r_c: float) -> Array:
        """The time derivative of x, y, psi, u, v, r, a, alpha."""
        psi, u, v, r, a, alpha = s[2:].tolist()
        c, sine = math.cos(psi), math.sin(psi)
        # The acceleration demand is limited before the second lag, so that the acceleration itself stays within its limit.
        jerk = (clip((u_c - u) / T_F, self.limits.acceleration) - a) / T_A
        yaw_jerk = (clip((r_c - r) / T_F, self.limits.yaw_acceleration) - alpha) / T_A
        dv = unforced_acceleration(u, v, r, self._vessel)[1]
        return np.array([u * c - v * sine, u * sine + v * c, r, a, dv, alpha, jerk, yaw_jerk])

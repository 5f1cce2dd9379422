"""A motion that a ship with a propeller and a rudder can follow, made of wishes for speed and turning.

| symbol | meaning | unit |
|---|---|---|
| x, y, psi, u, v, r | pose and body velocities of the reference | m, m, rad, m/s, m/s, rad/s |
| a, alpha | surge and yaw acceleration | m/s², rad/s² |
| u_c, r_c | wished surge velocity and yaw rate | m/s, rad/s |
| T_f, T_a | time constants: of a velocity towards its wish, of an acceleration | s, s |

da = (sat((u_c - u)/T_f) - a)/T_a and likewise for alpha; dv = f_v(u, v, r) of (7): nothing pushes sideways, the sway is what the
hull makes of it. So position, velocity and acceleration are continuous, limits hold, and the heading turns on past 180°.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.schema import parameter
from vessel_sim_node.plant import Vessel, unforced_acceleration

Array = NDArray[np.float64]

T_F, T_A = 1.5, 0.4
"""Time constants, s: with them the chain of velocity and acceleration is damped critically."""


@dataclass(frozen=True)
class MotionLimits:
    """How fast and how briskly a goal is gone to or a path followed; the ship must be able to do a little more."""

    speed: float = parameter(1.5, "Largest surge velocity.", unit="m/s", low=1e-3, high=1e3)
    acceleration: float = parameter(0.2, "Largest surge acceleration.", unit="m/s²", low=1e-6, high=1e3)
    yaw_rate: float = parameter(0.1, "Largest yaw rate.", unit="rad/s", low=1e-6, high=1e2)
    yaw_acceleration: float = parameter(0.02, "Largest yaw acceleration.", unit="rad/s²", low=1e-6, high=1e2)


def clip(value: float, limit: float) -> float:
    """The value, at most `limit` either way."""
    return min(max(value, -limit), limit)


def approach(distance: float, gain: float, braking: float, largest: float) -> float:
    """The speed at which to go a way so that one can stop in time: proportional to it at its end, limited by braking before.

    Args:
        distance: Way to go, either sign.
        gain: Speed over distance at the end, 1/s.
        braking: Deceleration to count on.
        largest: Largest speed.
    """
    way = abs(distance)
    return math.copysign(min(gain * way, math.sqrt(2.0 * braking * way), largest), distance)


class FilteredMotion:
    """The reference's motion, in steps of a fixed period.

    Attributes:
        state: x, y, psi, u, v, r, shape (6,).
        limits: How fast and how briskly it moves.

    Args:
        pose, velocity: Where and how it starts.
        limits: How fast and how briskly it moves.
        vessel: The hull that makes the sway.
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
        """Back to the start."""
        self.state: Array = self._start.copy()
        self._a = self._alpha = 0.0

    def acceleration(self) -> Array:
        """du, dv, dr, shape (3,): m/s², m/s², rad/s²."""
        u, v, r = (float(value) for value in self.state[3:])
        return np.array([self._a, unforced_acceleration(u, v, r, self._vessel)[1], self._alpha])

    def advance(self, u_c: float, r_c: float) -> None:
        """Move on by one period towards a surge velocity and a yaw rate, by one Runge-Kutta step."""
        limits = self.limits
        u_c, r_c = clip(u_c, limits.speed), clip(r_c, limits.yaw_rate)

        def rate(s: Array) -> Array:
            psi, u, v, r, a, alpha = (float(value) for value in s[2:])
            c, sine = math.cos(psi), math.sin(psi)
            to_a = (clip((u_c - u) / T_F, limits.acceleration) - a) / T_A
            to_alpha = (clip((r_c - r) / T_F, limits.yaw_acceleration) - alpha) / T_A
            dv = unforced_acceleration(u, v, r, self._vessel)[1]
            return np.array([u * c - v * sine, u * sine + v * c, r, a, dv, alpha, to_a, to_alpha])

        h, s = self._period, np.array([*self.state, self._a, self._alpha])
        k1 = rate(s)
        k2 = rate(s + 0.5 * h * k1)
        k3 = rate(s + 0.5 * h * k2)
        k4 = rate(s + h * k3)
        s = s + (h / 6.0) * (k1 + 2.0 * (k2 + k3) + k4)
        self.state, self._a, self._alpha = s[:6], float(s[6]), float(s[7])

"""The ship's motion from its noisy pose alone: an extended Kalman filter with unknown forces and, if asked for, waves as states.

| symbol | meaning | unit |
|---|---|---|
| p, psi | position and heading without waves | m, rad |
| nu = (u, v, r) | body velocities over ground | m/s, m/s, rad/s |
| b | accelerations that nothing known explains: damping, disturbance, current, errors of the inertia | m/s², m/s², rad/s² |
| xi, dxi | filter states of the waves' motion; dxi is what they add to position and heading | s·m, s·rad; m, rad |
| omega_0, zeta | the waves' frequency and damping in that model | rad/s, - |
| tau_1, tau_2, m11, m33 | commanded wrench and known inertia | N, N·m, kg, kg·m² |
| w | white noises; their intensities are the tuning | |

The model is Newton's second law in a frame that turns with the ship; of the hull it knows the inertia that the law knows:

    dp = R(psi)·(u, v)           du = v·r + tau_1/m11 + b_u + w      db = w
    dpsi = r                     dv = -u·r + b_v + w                 ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi + w
    dr = tau_2/m33 + b_r + w     measured: p + dxi_p + noise, psi + dxi_psi + noise

Source of the method, bias states and wave model: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.kinematics import wrap
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.schema import parameter
from vessel_hsmc_ros.timing import seconds

Array = NDArray[np.float64]

LONGEST_HOLD = 2.0
"""A measurement that does not change is one sample held, and no news, for this long, s."""

GATE = 20.0
"""A measurement further off than so many standard deviations is a glitch; after LONGEST_HOLD of nothing else, a new start."""

START = np.array([3.0, 3.0, 0.1, 0.1, 0.1, 0.01])
"""How far velocities and unknown accelerations may be from zero at the start, one standard deviation."""

_PSI, _V, _B, _XI, _DXI = 2, slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15)


def tuning(default: float, description: str, unit: str) -> float:
    """Declare a standard deviation or intensity of the filter."""
    return parameter(default, description, unit=unit, low=1e-9, high=1e6)


@dataclass(frozen=True)
class ObserverParameters:
    """What the observer expects of sensors, forces and waves."""

    enabled: bool = parameter(False, "Give the law estimates from the measured pose instead of what is measured.")
    position_noise: float = tuning(0.5, "Standard deviation of a sample of x and of y.", "m")
    heading_noise: float = tuning(0.005, "Standard deviation of a sample of the heading.", "rad")
    velocity_walk: float = tuning(0.01, "Unexplained change of surge and sway velocity in one second.", "m/s")
    yaw_rate_walk: float = tuning(0.0005, "Unexplained change of the yaw rate in one second.", "rad/s")
    force_walk: float = tuning(0.02, "Change of the unknown accelerations in surge and sway in one second.", "m/s²")
    moment_walk: float = tuning(0.002, "Change of the unknown acceleration in yaw in one second.", "rad/s²")
    wave_period: float = parameter(0.0, "Period of the waves to filter out; 0 filters none.", unit="s", low=0.0, high=60.0)
    wave_damping: float = parameter(0.1, "Damping of the waves' model.", low=0.01, high=0.9)
    wave_position: float = tuning(0.2, "Standard deviation of the waves' motion in x and in y.", "m")
    wave_heading: float = tuning(0.01, "Standard deviation of the waves' motion in heading.", "rad")


class Observer:
    """The filter with its memory.

    Args:
        parameters: Its tuning.
        vessel: What is known of the ship.
    """

    def __init__(self, parameters: ObserverParameters, vessel: KnownVessel) -> None:
        self._p = parameters
        self._vessel = vessel
        self._size = 15 if parameters.wave_period else 9
        p = parameters
        self._noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
        walks = [0.0] * 3 + [p.velocity_walk] * 2 + [p.yaw_rate_walk] + [p.force_walk] * 2 + [p.moment_walk] + [0.0] * 6
        self._intensity = np.array(walks[: self._size]) ** 2
        if p.wave_period:
            waves = np.array([p.wave_position, p.wave_position, p.wave_heading])
            self._intensity[_DXI] = waves**2 * 4.0 * p.wave_damping * 2.0 * math.pi / p.wave_period
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next measurement is the start."""
        self._stamp: int | None = None

    @property
    def estimate(self) -> Array:
        """x, y, psi, u, v, r without noise and waves, shape (6,)."""
        estimated = self._x[:6].copy()
        estimated[_PSI] = wrap(float(estimated[_PSI]))
        return estimated

    @property
    def deviation(self) -> Array:
        """Standard deviations that the filter claims for its estimate, shape (6,)."""
        return np.asarray(np.sqrt(np.diag(self._P)[:6]))

    def update(self, stamp: int, pose: Array, wrench: tuple[float, float]) -> Array:
        """Carry the estimate to a new measurement and correct it.

        Args:
            stamp: Time of the measurement, ns.
            pose: Measured x, y, psi in its first three elements; the rest is not looked at.
            wrench: Commanded since the last update, N, N·m.

        Returns:
            The estimate x, y, psi, u, v, r, shape (6,).
        """
        if self._stamp is None:
            self._begin(stamp, pose)
        elif stamp > self._stamp:
            self._predict(seconds(stamp - self._stamp), wrench)
            self._stamp = stamp
        self._correct(stamp, pose)
        return self.estimate

    def _begin(self, stamp: int, pose: Array) -> None:
        """At rest at the first pose, as far as is known."""
        self._stamp = stamp
        self._x = np.zeros(self._size)
        self._x[:3] = pose[:3]
        start = np.concatenate((self._noise, START**2))
        if self._size > 9:
            p = self._p
            omega_0 = 2.0 * math.pi / p.wave_period
            waves = np.array([p.wave_position, p.wave_position, p.wave_heading]) ** 2
            start = np.concatenate((start, waves / omega_0**2, waves))
        self._P = np.diag(start)
        self._held = np.full(3, math.nan)
        self._news_at = [stamp] * 3
        self._trusted_at = stamp

    # -- prediction ---------------------------------------------------------------------------------------------------

    def _predict(self, dt: float, wrench: tuple[float, float]) -> None:
        """The model over dt, the unknown accelerations held; its Jacobian carries the covariance.

        Velocities are added up in the earth-fixed frame, where no turning, however fast, can feed them.
        """
        x, vessel = self._x.copy(), self._vessel
        force = min(max(wrench[0], -vessel.surge_force_limit), vessel.surge_force_limit)
        moment = min(max(wrench[1], -vessel.yaw_moment_limit), vessel.yaw_moment_limit)
        psi, u, v, r = (float(value) for value in x[2:6])
        turn = float(x[8]) + moment / vessel.yaw_inertia
        middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
        before = _rotated(psi, u, v)
        gained = dt * _rotated(middle, float(x[6]) + force / vessel.surge_inertia, float(x[7]))
        x[:2] += dt * (before + 0.5 * gained)
        x[2], x[5] = end, r + dt * turn
        x[3:5] = _rotated(-end, *(before + gained))
        F = np.eye(self._size)
        c, s = math.cos(middle), math.sin(middle)
        F[0, 2:5] = dt * np.array([-u * s - v * c, c, -s])
        F[1, 2:5] = dt * np.array([u * c - v * s, s, c])
        F[2, 5] = dt
        F[3, 4:6] = dt * np.array([r, v])
        F[4, 3], F[4, 5] = -dt * r, -dt * u
        F[3, 6] = F[4, 7] = F[5, 8] = dt
        self._x = x
        if self._size > 9:
            self._move_waves(dt, F)
        self._P = F @ self._P @ F.T + np.diag(dt * self._intensity)

    def _move_waves(self, dt: float, F: Array) -> None:
        """The damped oscillation of the wave states over dt, in closed form: an Euler step would feed it."""
        zeta, omega_0 = self._p.wave_damping, 2.0 * math.pi / self._p.wave_period
        omega, fading = omega_0 * math.sqrt(1.0 - zeta * zeta), math.exp(-zeta * omega_0 * dt)
        c, s = fading * math.cos(omega * dt), fading * math.sin(omega * dt) / omega
        stay, come = c + zeta * omega_0 * s, -omega_0 * omega_0 * s
        for i in range(3):
            xi, dxi = 9 + i, 12 + i
            F[xi, xi], F[xi, dxi], F[dxi, xi], F[dxi, dxi] = stay, s, come, c - zeta * omega_0 * s
        self._x[9:] = F[9:, 9:] @ self._x[9:]

    # -- correction ---------------------------------------------------------------------------------------------------

    def _correct(self, stamp: int, pose: Array) -> None:
        """Take x, y and psi one by one, their noises being independent; what is held since an earlier sample is no news."""
        position, heading = self._fresh(0, 2, stamp, pose), self._fresh(2, 3, stamp, pose)
        taken = [self._take(i, float(pose[i])) for i in range(3) if (heading if i == _PSI else position)]
        self._P = 0.5 * (self._P + self._P.T)
        if taken and all(taken):
            self._trusted_at = stamp
        elif taken and seconds(stamp - self._trusted_at) > LONGEST_HOLD:
            self._begin(stamp, pose)

    def _fresh(self, first: int, end: int, stamp: int, pose: Array) -> bool:
        """Whether these measurements are a new sample."""
        same = np.array_equal(pose[first:end], self._held[first:end])
        if same and seconds(stamp - self._news_at[first]) < LONGEST_HOLD:
            return False
        self._held[first:end] = pose[first:end]
        self._news_at[first] = stamp
        return True

    def _take(self, i: int, measured: float) -> bool:
        """Take one scalar measurement of state i, with the waves on top of it, unless it is a glitch; whether it was taken."""
        expected, column = float(self._x[i]), self._P[:, i]
        if self._size > 9:
            expected, column = expected + float(self._x[12 + i]), column + self._P[:, 12 + i]
        variance = float(column[i]) + (float(column[12 + i]) if self._size > 9 else 0.0) + float(self._noise[i])
        difference = wrap(measured - expected) if i == _PSI else measured - expected
        if difference * difference > GATE * GATE * variance:
            return False
        gain = column / variance
        self._x = self._x + gain * difference
        self._P = self._P - np.outer(gain, column)
        return True


def _rotated(angle: float, along: float, across: float) -> Array:
    """A vector turned counter-clockwise, shape (2,)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([along * c - across * s, along * s + across * c])

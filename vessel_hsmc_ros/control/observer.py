"""The ship's motion from its noisy pose alone: an extended Kalman filter with unknown forces and, if asked for, waves as states.

| symbol | meaning | unit |
|---|---|---|
| p, psi | position and heading without waves | m, rad |
| nu = (u, v, r) | body velocities over ground | m/s, m/s, rad/s |
| b | unknown accelerations that turn with the ship: damping beyond d_1 to d_3, Coriolis, errors of the inertia | m/s², rad/s² |
| w_E, w_N | unknown accelerations that do not: wind, waves, current | m/s² |
| xi, dxi | filter states of the waves' motion; dxi is what they add to position and heading | s·m, s·rad; m, rad |
| omega_0, zeta | the waves' frequency and damping in that model | rad/s, - |
| d_1, d_2, d_3 | rates at which u, v, r left alone fade | 1/s |
| tau_1, tau_2 | commanded wrench, cut at the known limits and lagging by T_l | N, N·m |
| m11, m33 | known inertia | kg, kg·m² |

The model is Newton's second law in a frame that turns with the ship,

    dp = R(psi)·(u, v)      du = v·r + tau_1/m11 - d_1·u + b_u + w_E·cos psi + w_N·sin psi      db = noise
    dpsi = r                dv = -u·r            - d_2·v + b_v - w_E·sin psi + w_N·cos psi      dw = noise
                            dr = tau_2/m33       - d_3·r + b_r
    measured: p + dxi_p + noise, psi + dxi_psi + noise      ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi + noise

Source of the method, unknown forces and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

Array = NDArray[np.float64]

LONGEST_HOLD = 2.0
"""A measurement that does not change is one sample held, and no news, for this long, s."""

GATE = 20.0
"""A measurement further off than so many standard deviations is a glitch; after LONGEST_HOLD of nothing else, a new start."""

START = np.array([1.0, 1.0, 0.05, 0.1, 0.1, 0.01, 0.2, 0.2])
"""How far velocities and unknown accelerations may be from zero at the start, one standard deviation."""

_PSI, _U, _V, _R, _BU, _BV, _BR, _WE, _WN = range(2, 11)
_XI, _DXI = 11, 14
"""Where the waves' states begin, three each."""


class Observer:
    """The filter with its memory.

    Args:
        parameters: Its tuning.
        vessel: What is known of the ship.
    """

    def __init__(self, parameters: ObserverParameters, vessel: KnownVessel) -> None:
        self._p = p = parameters
        self._vessel = vessel
        self._waves = p.wave_period > 0.0
        self._noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
        walks = [p.velocity_walk] * 2 + [p.yaw_rate_walk] + [p.force_walk] * 2 + [p.moment_walk] + [p.weather_walk] * 2
        intensity, start = np.array([0.0] * 3 + walks) ** 2, np.concatenate((self._noise, START**2))
        if self._waves:
            omega_0 = 2.0 * math.pi / p.wave_period
            swell = np.array([p.wave_position, p.wave_position, p.wave_heading]) ** 2
            intensity = np.concatenate((intensity, np.zeros(3), 4.0 * p.wave_damping * omega_0 * swell))
            start = np.concatenate((start, swell / omega_0**2, swell))
        self._intensity, self._start = intensity, start
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
        """At rest at this pose, as far as is known."""
        self._stamp = self._trusted_at = stamp
        self._x = np.zeros(len(self._start))
        self._x[:3] = pose[:3]
        self._P = np.diag(self._start)
        self._arrived = (0.0, 0.0)
        self._held = np.full(3, math.nan)
        self._news_at = [stamp] * 3

    # -- prediction ---------------------------------------------------------------------------------------------------

    def _predict(self, dt: float, wrench: tuple[float, float]) -> None:
        """The model over dt, the unknown accelerations held; its Jacobian carries the covariance.

        Velocities are added up in the earth-fixed frame, where no turning, however fast, can feed them.
        """
        p, x = self._p, self._x.copy()
        self._arrived = self._arriving(dt, wrench)
        psi, u, v, r, b_u, b_v, b_r, w_e, w_n = (float(value) for value in x[_PSI:_XI])
        fade_u, fade_v, fade_r = (-math.expm1(-decay * dt) for decay in (p.surge_decay, p.sway_decay, p.yaw_decay))
        turn = self._arrived[1] / self._vessel.yaw_inertia + b_r - fade_r / dt * r
        middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
        along, across = self._arrived[0] / self._vessel.surge_inertia + b_u - fade_u / dt * u, b_v - fade_v / dt * v
        before = _rotated(psi, u, v)
        gained = dt * (_rotated(middle, along, across) + np.array([w_e, w_n]))
        x[:2] += dt * (before + 0.5 * gained)
        x[_PSI], x[_R] = end, r + dt * turn
        x[_U], x[_V] = _rotated(-end, *(before + gained))
        F = np.eye(len(x))
        c, s = math.cos(middle), math.sin(middle)
        F[0, _PSI : _V + 1] = dt * np.array([-u * s - v * c, c, -s])
        F[1, _PSI : _V + 1] = dt * np.array([u * c - v * s, s, c])
        F[_PSI, _R] = F[_U, _BU] = F[_V, _BV] = F[_R, _BR] = dt
        F[_U, _U : _R + 1] = 1.0 - fade_u, dt * r, dt * v
        F[_V, _U : _R + 1] = -dt * r, 1.0 - fade_v, -dt * u
        F[_R, _R] = 1.0 - fade_r
        F[_U, [_PSI, _WE, _WN]] = dt * np.array([w_n * c - w_e * s, c, s])
        F[_V, [_PSI, _WE, _WN]] = dt * np.array([-w_e * c - w_n * s, -s, c])
        if self._waves:
            F[_XI:, _XI:] = oscillation(2.0 * math.pi / p.wave_period, p.wave_damping, dt)
            x[_XI:] = F[_XI:, _XI:] @ x[_XI:]
        self._x = x
        self._P = F @ self._P @ F.T + np.diag(dt * self._intensity)

    def _arriving(self, dt: float, wrench: tuple[float, float]) -> tuple[float, float]:
        """What the actuators make of the command by the end of dt, as far as is known."""
        limits = self._vessel.surge_force_limit, self._vessel.yaw_moment_limit
        force, moment = (min(max(command, -limit), limit) for command, limit in zip(wrench, limits, strict=True))
        if not self._p.actuator_lag:
            return force, moment
        share = -math.expm1(-dt / self._p.actuator_lag)
        return self._arrived[0] + share * (force - self._arrived[0]), self._arrived[1] + share * (moment - self._arrived[1])

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
        expected, column, variance = float(self._x[i]), self._P[:, i], float(self._noise[i])
        if self._waves:
            expected, column = expected + float(self._x[_DXI + i]), column + self._P[:, _DXI + i]
            variance += float(column[_DXI + i])
        variance += float(column[i])
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


def oscillation(omega_0: float, zeta: float, dt: float) -> Array:
    """The waves' model over dt in closed form, for xi and dxi of three directions, (6, 6): an Euler step would feed it."""
    omega, fading = omega_0 * math.sqrt(1.0 - zeta * zeta), math.exp(-zeta * omega_0 * dt)
    c, s = fading * math.cos(omega * dt), fading * math.sin(omega * dt) / omega
    one = np.array([[c + zeta * omega_0 * s, s], [-omega_0 * omega_0 * s, c - zeta * omega_0 * s]])
    return np.kron(one, np.eye(3))

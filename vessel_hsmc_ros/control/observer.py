"""State estimation from the noisy pose alone: an extended Kalman filter with disturbances and, optionally, waves as states.

| symbol | meaning | unit |
|---|---|---|
| p, psi | low-frequency position and heading, without the wave motion | m, rad |
| nu = (u, v, r) | body velocities over ground | m/s, m/s, rad/s |
| b | body-fixed disturbance: damping beyond d_1 to d_3, Coriolis force, errors of the inertia | m/s², rad/s² |
| w_E, w_N | earth-fixed disturbance: wind, wave drift, current | m/s² |
| xi, dxi | states of the wave filter; dxi is the wave-frequency part of position and heading | s·m, s·rad; m, rad |
| omega_0, zeta | frequency and damping ratio of the wave filter | rad/s, - |
| d_1, d_2, d_3 | linear damping of u, v, r | 1/s |
| tau_1, tau_2 | commanded wrench within the known limits, delayed by a first-order lag T_l | N, N·m |
| m11, m33 | known inertia | kg, kg·m² |

The model is Newton's second law in the body-fixed frame,

    dp = R(psi)·(u, v)      du = v·r + tau_1/m11 - d_1·u + b_u + w_E·cos psi + w_N·sin psi      db = noise
    dpsi = r                dv = -u·r            - d_2·v + b_v - w_E·sin psi + w_N·cos psi      dw = noise
                            dr = tau_2/m33       - d_3·r + b_r
    measured: p + dxi_p + noise, psi + dxi_psi + noise      ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi + noise

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kinematics import Motion, as_motion, wrap
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.core.timing import seconds
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

Array = NDArray[np.float64]

LONGEST_HOLD = 2.0
"""An unchanged measurement counts as a repetition of the last sample for this long, s."""

GATE = 20.0
"""Innovation gate, in standard deviations: a measurement beyond it is rejected as an outlier.

After LONGEST_HOLD without an accepted measurement the filter is reinitialised, because then the estimate is wrong and not the
sensor. The gate is wide, so that the filter recovers by itself from moderate errors of its model."""

START = np.array([1.0, 1.0, 0.05, 0.1, 0.1, 0.01, 0.2, 0.2])
"""Initial standard deviations of u, v, r, b and w."""

_PSI, _U, _V, _R, _BU, _BV, _BR, _WE, _WN = range(2, 11)
_XI, _DXI = 11, 14
"""Indices of the first states of xi and dxi, three each."""


class Observer:
    """The filter with its state and covariance.

    Args:
        parameters: Noise levels and model parameters.
        vessel: The known inertia and limits.
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
        """Discard the estimate: the next measurement initialises the filter."""
        self._stamp: int | None = None

    @property
    def estimate(self) -> Motion:
        """The estimated low-frequency motion, its heading in (-pi, pi]."""
        estimated = as_motion(self._x[:6])
        return estimated._replace(psi=wrap(estimated.psi))

    @property
    def deviation(self) -> Array:
        """Standard deviations of the estimate according to the filter's covariance, shape (6,)."""
        return np.asarray(np.sqrt(np.diag(self._P)[:6]))

    def update(self, stamp: int, pose: Sequence[float] | Array, wrench: tuple[float, float]) -> Motion:
        """Predict the estimate to the time of a new measurement and correct it.

        Args:
            stamp: Time of the measurement, ns.
            pose: Measured x, y, psi; further elements, such as measured velocities, are ignored.
            wrench: Wrench commanded since the last update, N, N·m.

        Returns:
            The estimated motion.
        """
        if self._stamp is None:
            self._begin(stamp, pose)
        elif stamp > self._stamp:
            self._predict(seconds(stamp - self._stamp), wrench)
            self._stamp = stamp
        self._correct(stamp, pose)
        return self.estimate

    def _begin(self, stamp: int, pose: Sequence[float] | Array) -> None:
        """Initialise the filter at a measured pose, at rest and without disturbance."""
        self._stamp = self._accepted_at = stamp
        self._x = np.zeros(len(self._start))
        self._x[:3] = pose[:3]
        self._P = np.diag(self._start)
        self._applied = (0.0, 0.0)
        self._held = np.full(3, math.nan)
        self._sampled_at = [stamp] * 3

    # -- prediction ---------------------------------------------------------------------------------------------------

    def _predict(self, dt: float, wrench: tuple[float, float]) -> None:
        """Propagate the state by the model over dt, and the covariance by its Jacobian F.

        The velocities are integrated in the earth-fixed frame, where the Coriolis terms v·r and -u·r vanish: integrated by Euler
        steps in the body frame, they would add kinetic energy in a turn.

        Args:
            dt: Time step, s.
            wrench: Commanded wrench, N, N·m.
        """
        p, x = self._p, self._x.copy()
        self._applied = self._actuated(dt, wrench)
        psi, u, v, r, b_u, b_v, b_r, w_e, w_n = (float(value) for value in x[_PSI:_XI])
        decay_u, decay_v, decay_r = (-math.expm1(-rate * dt) for rate in (p.surge_decay, p.sway_decay, p.yaw_decay))
        turn = self._applied[1] / self._vessel.yaw_inertia + b_r - decay_r / dt * r
        middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
        along, across = self._applied[0] / self._vessel.surge_inertia + b_u - decay_u / dt * u, b_v - decay_v / dt * v
        velocity = _rotated(psi, u, v)
        change = dt * (_rotated(middle, along, across) + np.array([w_e, w_n]))
        x[:2] += dt * (velocity + 0.5 * change)
        x[_PSI], x[_R] = end, r + dt * turn
        x[_U], x[_V] = _rotated(-end, *(velocity + change))
        F = np.eye(len(x))
        c, s = math.cos(middle), math.sin(middle)
        F[0, _PSI : _V + 1] = dt * np.array([-u * s - v * c, c, -s])
        F[1, _PSI : _V + 1] = dt * np.array([u * c - v * s, s, c])
        F[_PSI, _R] = F[_U, _BU] = F[_V, _BV] = F[_R, _BR] = dt
        F[_U, _U : _R + 1] = 1.0 - decay_u, dt * r, dt * v
        F[_V, _U : _R + 1] = -dt * r, 1.0 - decay_v, -dt * u
        F[_R, _R] = 1.0 - decay_r
        F[_U, [_PSI, _WE, _WN]] = dt * np.array([w_n * c - w_e * s, c, s])
        F[_V, [_PSI, _WE, _WN]] = dt * np.array([-w_e * c - w_n * s, -s, c])
        if self._waves:
            F[_XI:, _XI:] = wave_transition(2.0 * math.pi / p.wave_period, p.wave_damping, dt)
            x[_XI:] = F[_XI:, _XI:] @ x[_XI:]
        self._x = x
        self._P = F @ self._P @ F.T + np.diag(dt * self._intensity)

    def _actuated(self, dt: float, wrench: tuple[float, float]) -> tuple[float, float]:
        """The wrench at the end of dt after the known limits and the actuator lag.

        Args:
            dt: Time step, s.
            wrench: Commanded wrench, N, N·m.
        """
        force, moment = clip(wrench[0], self._vessel.surge_force_limit), clip(wrench[1], self._vessel.yaw_moment_limit)
        if not self._p.actuator_lag:
            return force, moment
        share = -math.expm1(-dt / self._p.actuator_lag)
        return self._applied[0] + share * (force - self._applied[0]), self._applied[1] + share * (moment - self._applied[1])

    # -- correction ---------------------------------------------------------------------------------------------------

    def _correct(self, stamp: int, pose: Sequence[float] | Array) -> None:
        """Correct by x, y and psi one after the other, which is exact because their noises are independent.

        A measurement that only repeats an earlier sample is not used again: it is old, and its noise is not independent.

        Args:
            stamp: Time of the measurement, ns.
            pose: Measured x, y, psi.
        """
        # Position and heading are separate sensors with rates of their own, so each is tested for a new sample on its own.
        position, heading = self._is_new_sample(0, 2, stamp, pose), self._is_new_sample(2, 3, stamp, pose)
        accepted = [self._correct_by(i, float(pose[i])) for i in range(3) if (heading if i == _PSI else position)]
        self._P = 0.5 * (self._P + self._P.T)  # rounding must not make it unsymmetric
        if accepted and all(accepted):
            self._accepted_at = stamp
        elif accepted and seconds(stamp - self._accepted_at) > LONGEST_HOLD:
            self._begin(stamp, pose)

    def _is_new_sample(self, first: int, end: int, stamp: int, pose: Sequence[float] | Array) -> bool:
        """Whether the measurements first..end-1 of the pose are a new sample, which they are if they differ from the last."""
        same = np.array_equal(pose[first:end], self._held[first:end])
        if same and seconds(stamp - self._sampled_at[first]) < LONGEST_HOLD:
            return False
        self._held[first:end] = pose[first:end]
        self._sampled_at[first] = stamp
        return True

    def _correct_by(self, i: int, measured: float) -> bool:
        """Correct by one scalar measurement of state i plus wave motion, unless it is an outlier.

        Returns:
            Whether the measurement was accepted.
        """
        expected, column, variance = float(self._x[i]), self._P[:, i], float(self._noise[i])
        if self._waves:
            expected, column = expected + float(self._x[_DXI + i]), column + self._P[:, _DXI + i]
            variance += float(column[_DXI + i])
        variance += float(column[i])
        difference = wrap(measured - expected) if i == _PSI else measured - expected
        if difference * difference > GATE * GATE * variance:  # the innovation over its standard deviation
            return False
        gain = column / variance
        self._x = self._x + gain * difference
        self._P = self._P - np.outer(gain, column)
        return True


def _rotated(angle: float, along: float, across: float) -> Array:
    """A horizontal vector rotated counter-clockwise, shape (2,)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([along * c - across * s, along * s + across * c])


def wave_transition(omega_0: float, zeta: float, dt: float) -> Array:
    """Transition matrix of the wave filter ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi, in closed form.

    An Euler step would add energy to the oscillation.

    Args:
        omega_0: Natural frequency, rad/s.
        zeta: Damping ratio, below 1.
        dt: Time step, s.

    Returns:
        Matrix for (xi, dxi) with three components each, shape (6, 6).
    """
    omega, decay = omega_0 * math.sqrt(1.0 - zeta * zeta), math.exp(-zeta * omega_0 * dt)
    c, s = decay * math.cos(omega * dt), decay * math.sin(omega * dt) / omega
    one = np.array([[c + zeta * omega_0 * s, s], [-omega_0 * omega_0 * s, c - zeta * omega_0 * s]])
    return np.kron(one, np.eye(3))

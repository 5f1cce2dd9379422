"""State estimation from the noisy pose alone: an extended Kalman filter with disturbances and, optionally, waves as states.

The filter predicts by the model of `observer_model`, whose symbols it shares, and corrects by x, y and psi one after the other.

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_model import DXI, PSI, XI, jacobian, propagate, wave_transition
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
        # The filter works with variances; the parameters are standard deviations.
        self._noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
        levels = [p.velocity_walk] * 2 + [p.yaw_rate_walk] + [p.force_walk] * 2 + [p.moment_walk] + [p.weather_walk] * 2
        intensity, start = np.array([0.0] * 3 + levels) ** 2, np.concatenate((self._noise, START**2))
        if self._waves:
            omega_0 = 2.0 * math.pi / p.wave_period
            wave_variance = np.array([p.wave_position, p.wave_position, p.wave_heading]) ** 2
            # The white noise on ddxi whose stationary variance of dxi is wave_variance: 4·zeta·omega_0·variance; that of xi is
            # then variance/omega_0².
            intensity = np.concatenate((intensity, np.zeros(3), 4.0 * p.wave_damping * omega_0 * wave_variance))
            start = np.concatenate((start, wave_variance / omega_0**2, wave_variance))
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
    def covariance(self) -> Array:
        """Covariance matrix of all states of the filter, in the order of `observer_model`."""
        return self._P.copy()

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
        """Propagate state and covariance by the model over dt.

        Args:
            dt: Time step, s.
            wrench: Commanded wrench, N, N·m.
        """
        p = self._p
        self._applied = self._actuated(dt, wrench)
        tau_1, tau_2 = self._applied
        x = self._x.copy()
        # The vessel model is nonlinear, hence the Jacobian (extended Kalman filter); the wave filter is linear and exact.
        F = np.eye(len(x))
        F[:XI, :XI] = jacobian(x[:XI], dt, p)
        x[:XI] = propagate(x[:XI], tau_1 / self._vessel.surge_inertia, tau_2 / self._vessel.yaw_inertia, dt, p)
        if self._waves:
            F[XI:, XI:] = wave_transition(2.0 * math.pi / p.wave_period, p.wave_damping, dt)
            x[XI:] = F[XI:, XI:] @ x[XI:]
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
        accepted = [self._correct_by(i, float(pose[i])) for i in range(3) if (heading if i == PSI else position)]
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
            expected, column = expected + float(self._x[DXI + i]), column + self._P[:, DXI + i]
            variance += float(column[DXI + i])
        variance += float(column[i])
        difference = wrap(measured - expected) if i == PSI else measured - expected
        if difference * difference > GATE * GATE * variance:  # the innovation over its standard deviation
            return False
        # Kalman gain of a scalar measurement: the innovation variance is a number, so no matrix is inverted.
        gain = column / variance
        self._x = self._x + gain * difference
        self._P = self._P - np.outer(gain, column)
        return True

"""State estimation from the noisy pose alone: an extended Kalman filter with disturbances and, optionally, waves as states.

The filter predicts by the model of `observer_model`, whose symbols it shares, and corrects by x, y and psi one after the other.

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_filter import ObserverConstants, estimate, initial_state, observe
from vessel_hsmc_ros.control.observer_model import model
from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

Array = NDArray[np.float64]

START = np.array([1.0, 1.0, 0.05, 0.1, 0.1, 0.01, 0.2, 0.2])
"""Initial standard deviations of u, v, r, b and w."""


def constants(p: ObserverParameters, vessel: KnownVessel) -> ObserverConstants:
    """The constants of the filter, which works with variances; the parameters are standard deviations."""
    m = model(p)
    noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
    levels = [p.velocity_walk] * 2 + [p.yaw_rate_walk] + [p.force_walk] * 2 + [p.moment_walk] + [p.weather_walk] * 2
    intensity, start = np.array([0.0] * 3 + levels) ** 2, np.concatenate((noise, START**2))
    if m.waves:
        wave_variance = np.array([p.wave_position, p.wave_position, p.wave_heading]) ** 2
        # The white noise on ddxi whose stationary variance of dxi is wave_variance: 4·zeta·omega_0·variance; that of xi is
        # then variance/omega_0².
        intensity = np.concatenate((intensity, np.zeros(3), 4.0 * m.zeta * m.omega_0 * wave_variance))
        start = np.concatenate((start, wave_variance / m.omega_0**2, wave_variance))
    x, y, psi = noise.tolist()
    limits = vessel.surge_force_limit, vessel.yaw_moment_limit
    inertia = vessel.surge_inertia, vessel.as_controlled().yaw_inertia, vessel.pivot
    return ObserverConstants(p.enabled, m, (x, y, psi), np.diag(intensity), start, *inertia, *limits, p.actuator_lag)


class Observer:
    """The filter with its state and covariance.

    Args:
        parameters: Noise levels and model parameters.
        vessel: The known inertia and limits.

    Attributes:
        constants: What the filter's kernel takes besides its state.
        state: The present state of the filter.
    """

    def __init__(self, parameters: ObserverParameters, vessel: KnownVessel) -> None:
        self.constants = constants(parameters, vessel)
        self.reset()

    def reset(self) -> None:
        """Discard the estimate: the next measurement initialises the filter."""
        self.state = initial_state(self.constants)

    @property
    def estimate(self) -> Motion:
        """The estimated low-frequency motion, its heading in (-pi, pi]."""
        return estimate(self.state)

    @property
    def covariance(self) -> Array:
        """Covariance matrix of all states of the filter, in the order of `observer_model`."""
        return self.state.P.copy()

    @property
    def deviation(self) -> Array:
        """Standard deviations of the estimate according to the filter's covariance, shape (6,)."""
        return np.asarray(np.sqrt(np.diag(self.state.P)[:6]))

    def update(self, stamp: int, pose: Sequence[float] | Array, wrench: tuple[float, float]) -> Motion:
        """Predict the estimate to the time of a new measurement and correct it.

        Args:
            stamp: Time of the measurement, ns.
            pose: Measured x, y, psi; further elements, such as measured velocities, are ignored.
            wrench: Wrench commanded since the last update, N, N·m.

        Returns:
            The estimated motion.
        """
        measured = float(pose[0]), float(pose[1]), float(pose[2])
        self.state = observe(stamp, measured, wrench, self.state, self.constants)
        return estimate(self.state)

"""State estimation from the noisy pose alone: an extended Kalman filter with disturbances and, optionally, waves as states.

The filter predicts by the model of `observer_model`, whose symbols it shares, and corrects by x, y and psi one after the other.

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_actuators import actuators
from vessel_hsmc_ros.control.observer_filter import ObserverConstants, estimate, initial_state, observe
from vessel_hsmc_ros.control.observer_model import model
from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.laws.known_vessel import KnownVessel

Array = NDArray[np.float64]

NONE = -1.0
"""Marks a parameter as not set: it is derived from the units of the ship."""


class Units(NamedTuple):
    """The ship's own units: time sqrt(m_p/tau_2max), speed length/time, and the largest accelerations by surge force and moment."""

    time: float
    speed: float
    acceleration: float
    yaw_acceleration: float


def units(vessel: KnownVessel) -> Units:
    """The units of a ship."""
    m_p = vessel.as_controlled().yaw_inertia
    time = math.sqrt(m_p / vessel.yaw_moment_limit)
    return Units(time, vessel.length / time, vessel.surge_force_limit / vessel.surge_inertia, vessel.yaw_moment_limit / m_p)


def chosen(value: float, derived: float) -> float:
    """A parameter as set, or what is derived for it."""
    return derived if value == NONE else value


def walks(p: ObserverParameters, ship: Units) -> list[float]:
    """Intensities of the process noise of u, v, r, b, ln d and c: standard deviations of the change in one second."""
    per = 1.0 / math.sqrt(ship.time)
    speed = chosen(p.velocity_walk, 0.003 * ship.speed * per)
    yaw_rate = chosen(p.yaw_rate_walk, 0.002 / ship.time * per)
    force = chosen(p.force_walk, 0.012 * ship.acceleration * per)
    moment = chosen(p.moment_walk, 0.03 * ship.yaw_acceleration * per)
    current = chosen(p.weather_walk, 0.001 * ship.speed * per)
    damping = [0.04 * per if decay == NONE else 0.0 for decay in (p.surge_decay, p.sway_decay, p.yaw_decay)]
    return [speed] * 2 + [yaw_rate] + [force] * 2 + [moment] + damping + [current] * 2


def deviations(p: ObserverParameters, ship: Units) -> list[float]:
    """Initial standard deviations of the same states."""
    speed, yaw_rate, current = 0.15 * ship.speed, 0.25 / ship.time, 0.1 * ship.speed
    force, moment = 0.06 * ship.acceleration, 0.2 * ship.yaw_acceleration
    damping = [1.0 if decay == NONE else 0.0 for decay in (p.surge_decay, p.sway_decay, p.yaw_decay)]
    return [speed] * 2 + [yaw_rate] + [force] * 2 + [moment] + damping + [current] * 2


def constants(p: ObserverParameters, vessel: KnownVessel) -> ObserverConstants:
    """The constants of the filter, which works with variances; the parameters are standard deviations."""
    m, ship = model(p, vessel), units(vessel)
    noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
    intensity = np.array([0.0] * 3 + walks(p, ship)) ** 2
    start = np.concatenate((noise, np.array(deviations(p, ship)) ** 2))
    if m.waves:
        wave_variance = np.array([p.wave_position, p.wave_position, p.wave_heading]) ** 2
        # The white noise on ddxi whose stationary variance of dxi is wave_variance: 4·zeta·omega_0·variance; that of xi is
        # then variance/omega_0².
        intensity = np.concatenate((intensity, np.zeros(3), 4.0 * m.zeta * m.omega_0 * wave_variance))
        start = np.concatenate((start, wave_variance / m.omega_0**2, wave_variance))
    x, y, psi = noise.tolist()
    d_1, d_2, d_3 = (math.log(max(chosen(d, 0.8 / ship.time), 1e-9)) for d in (p.surge_decay, p.sway_decay, p.yaw_decay))
    inertia = vessel.surge_inertia, vessel.as_controlled().yaw_inertia, vessel.pivot
    return ObserverConstants(
        p.enabled, m, (x, y, psi), np.diag(intensity), start, (d_1, d_2, d_3), *inertia, actuators(p, vessel)
    )


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

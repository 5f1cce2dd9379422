"""State estimation from the noisy pose alone: an extended Kalman filter.

Besides the motion its states are damping, disturbances, current and, optionally, waves.

The filter predicts by the model of `observer_model`, whose symbols it shares, and corrects by x, y and psi one after the other.

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.loop.observer_filter import ObserverConstants, estimate, initial_state, observe
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters, actuators, model
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion

PRIOR_DECAY = 0.8  # decay rates before anything is known of them, in units of 1/T, with a standard deviation of a factor e


class Units(NamedTuple):
    """The ship's own units."""

    time: float  # T = sqrt(m_p/tau_2max), s
    length: float  # L, m
    speed: float  # L/T, m/s
    # acceleration, yaw_acceleration: tau_1max/m11, m/s²; tau_2max/m_p, rad/s²
    acceleration: float
    yaw_acceleration: float


def units(vessel: KnownVessel) -> Units:
    """The units of a ship."""
    L, m_p = vessel.length, vessel.as_controlled().yaw_inertia
    T = math.sqrt(m_p / vessel.yaw_moment_limit)
    return Units(T, L, L / T, vessel.surge_force_limit / vessel.surge_inertia, vessel.yaw_moment_limit / m_p)


def chosen(value: float, derived: float) -> float:
    """A parameter as set, or, where it is negative, what is derived for it."""
    return derived if value < 0.0 else value


def walks(p: ObserverParameters, ship: Units) -> list[float]:
    """Intensities of the process noise of u, v, r, b, ln d and c: standard deviations of the change in one second.

    They are numbers of the ship's units for a change in the time T. Found once, on the paper's ship in config/realistic.yaml, so
    that its NEES is close to 6 (benchmarks/consistency.py); the smallest tracking error is there too.
    """
    per = 1.0 / math.sqrt(ship.time)
    speed = chosen(p.velocity_walk, 0.0003 * ship.speed * per)
    yaw_rate = chosen(p.yaw_rate_walk, 0.002 / ship.time * per)
    force = chosen(p.force_walk, 0.0023 * ship.acceleration * per)
    moment = chosen(p.moment_walk, 0.016 * ship.yaw_acceleration * per)
    current = chosen(p.current_walk, 0.0008 * ship.speed * per)
    damping = [0.04 * per if decay < 0.0 else 0.0 for decay in (p.surge_decay, p.sway_decay, p.yaw_decay)]
    return [speed] * 2 + [yaw_rate] + [force] * 2 + [moment] + damping + [current] * 2


def deviations(p: ObserverParameters, ship: Units) -> list[float]:
    """Initial standard deviations of the same states."""
    speed, yaw_rate, current = 0.15 * ship.speed, 0.25 / ship.time, 0.1 * ship.speed
    force, moment = 0.06 * ship.acceleration, 0.2 * ship.yaw_acceleration
    damping = [1.0 if decay < 0.0 else 0.0 for decay in (p.surge_decay, p.sway_decay, p.yaw_decay)]
    return [speed] * 2 + [yaw_rate] + [force] * 2 + [moment] + damping + [current] * 2


def wave_motion(p: ObserverParameters, ship: Units, omega: float) -> Array:
    """Standard deviations of the wave-frequency motion in x, y and psi.

    By default that of a fully developed sea of the period 2·pi/omega, whose elevation has the standard deviation
    sigma = period²/100 in metres and seconds. The hull averages waves of length lambda over its own: sigma/sqrt(2) along each
    axis and a quarter of the slope k·sigma in heading, both divided by 1 + L/lambda.
    """
    k, sigma = omega * omega / GRAVITY, (2.0 * math.pi / omega) ** 2 / 100.0
    averaged = 1.0 + 0.5 * ship.length * k / math.pi
    position = chosen(p.wave_position, sigma / math.sqrt(2.0) / averaged)
    return np.array([position, position, chosen(p.wave_heading, 0.25 * k * sigma / averaged)])


def constants(p: ObserverParameters, vessel: KnownVessel) -> ObserverConstants:
    """The constants of the filter, which works with variances; the parameters are standard deviations."""
    m, ship = model(p, vessel), units(vessel)
    noise = np.array([p.position_noise, p.position_noise, p.heading_noise]) ** 2
    intensity = np.array([0.0] * 3 + walks(p, ship)) ** 2
    start = np.concatenate((noise, np.array(deviations(p, ship)) ** 2))
    if m.waves:
        wave_variance = wave_motion(p, ship, m.omega_0) ** 2
        # The white noise on ddxi whose stationary variance of dxi is wave_variance: 4·zeta·omega_0·variance; that of xi is
        # then variance/omega_0².
        intensity = np.concatenate((intensity, np.zeros(3), 4.0 * m.zeta * m.omega_0 * wave_variance))
        start = np.concatenate((start, wave_variance / m.omega_0**2, wave_variance))
    x, y, psi = noise.tolist()
    decays = (chosen(d, PRIOR_DECAY / ship.time) for d in (p.surge_decay, p.sway_decay, p.yaw_decay))
    d_1, d_2, d_3 = (math.log(max(d, 1e-9)) for d in decays)
    inertia = vessel.surge_inertia, vessel.as_controlled().yaw_inertia, vessel.percussion_point
    return ObserverConstants(
        p.enabled, m, (x, y, psi), np.diag(intensity), start, (d_1, d_2, d_3), *inertia, actuators(p, vessel.as_controlled())
    )


def with_actuators(c: ObserverConstants, p: ObserverParameters, vessel: KnownVessel) -> ObserverConstants:
    """The constants with the actuators of a vessel."""
    return c._replace(actuators=actuators(p, vessel))


class Observer:
    """The filter with its state and covariance.

    Attributes:
        constants: What the filter's kernel takes besides its state.
        state: The present state of the filter.
    """

    def __init__(self, parameters: ObserverParameters, vessel: KnownVessel) -> None:
        self.constants = constants(parameters, vessel)
        self._parameters, self._vessel = parameters, vessel
        self.reset()

    def take_for(self, vessel: KnownVessel) -> None:
        """Predict with the actuators of a vessel from now on, as far as they are not set by hand."""
        if vessel is not self._vessel:
            self._vessel = vessel
            self.constants = with_actuators(self.constants, self._parameters, vessel)

    def reset(self) -> None:
        """Discard the estimate: the next measurement initialises the filter."""
        self.state = initial_state(self.constants)

    @property
    def estimate(self) -> Motion:
        """The estimated low-frequency motion, its heading in (-pi, pi]."""
        return estimate(self.state)

    @property
    def accepts(self) -> bool:
        """Whether no new sample of the last measurement was an outlier."""
        return self.state.accepted_at == self.state.stamp

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

        `stamp`: time of the measurement, ns. `pose`: measured x, y, psi; further elements, such as measured velocities, are
        ignored. `wrench`: wrench commanded since the last update, N, N·m. Returns the estimated motion.
        """
        measured = float(pose[0]), float(pose[1]), float(pose[2])
        self.state = observe(stamp, measured, wrench, self.state, self.constants)
        return estimate(self.state)

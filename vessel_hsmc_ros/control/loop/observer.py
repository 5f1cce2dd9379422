"""State estimation from the noisy pose alone: an extended Kalman filter.

Besides the motion its states are damping, disturbances, current and, optionally, waves.

The filter predicts by the model of `observer_model`, whose symbols it shares, and corrects by x, y and psi one after the other.

Source of the method, disturbances and waves as states: T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control.

One update of the observer: prediction by the model, then correction by x, y and psi one after the other.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.loop.observer_model import (
    D1,
    DXI,
    PSI,
    Actuators,
    Commands,
    Model,
    ObserverParameters,
    V,
    Wrench,
    actuated,
    actuators,
    model,
    no_commands,
    propagate,
    propagate_covariance,
)
from vessel_hsmc_ros.core.kernel import Array, between, kernel
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, wrap
from vessel_hsmc_ros.core.timing import seconds

Pose = tuple[float, float, float]

LONGEST_HOLD = 2.0
"""An unchanged measurement counts as a repetition of the last sample, which carries no information, for this long, s."""

HELD_GATE = 3.0
"""Innovation gate of a measurement that has been unchanged for longer, in standard deviations.

Within it the ship lies still and the measurement is true; beyond it the ship has moved on and the sensor has failed."""

GATE = 20.0
"""Innovation gate, in standard deviations: a measurement beyond it is rejected as an outlier.

After LONGEST_HOLD without an accepted measurement the filter is reinitialised, because then the estimate is wrong and not the
sensor. The gate is wide, so that the filter recovers by itself from moderate errors of its model."""

WIDEST_DECAY = math.log(10.0)
"""Largest deviation of ln d_1, ln d_2, ln d_3 from their initial values: large damping would make the filter certain of a
velocity, whatever is measured."""


class ObserverConstants(NamedTuple):
    """What does not change during a run."""

    enabled: bool  # whether the law takes the estimate; the kernels of this module do not look at it
    model: Model  # constants of the model
    noise: tuple[float, float, float]  # variances of a sample of x, y and psi
    Q: Array  # intensity of the process noise, shape (n, n)
    start: Array  # initial variances of the states, shape (n,)
    decay: tuple[float, float, float]  # initial ln d_1, ln d_2, ln d_3
    # m11, m_p: known inertia; m_p is that which the yaw moment accelerates
    m11: float
    m_p: float
    x_p: float  # distance of the known centre of percussion ahead of the origin, m
    actuators: Actuators  # what is known of the actuators


class ObserverState(NamedTuple):
    """The state of the filter; its arrays are written in place."""

    x: Array  # states in the order of `observer_model`, shape (n,)
    P: Array  # their covariance, shape (n, n)
    held: Array  # the last samples of x, y and psi, shape (3,)
    sampled_at: NDArray[np.int64]  # when position and heading were sampled, ns, shape (2,)
    refused: NDArray[np.int64]  # 1 where the last sample of position or heading was an outlier, otherwise 0, shape (2,)
    started: bool  # whether a measurement has initialised the filter
    stamp: int  # time of the estimate, ns
    accepted_at: int  # when there was a new sample and no last one was an outlier, ns
    applied: Wrench  # wrench on the hull, N, N·m
    commands: Commands  # the latest commands


def initial_state(c: ObserverConstants) -> ObserverState:
    """The state before the first measurement."""
    n, sampled_at, refused = len(c.start), np.zeros(2, np.int64), np.zeros(2, np.int64)
    arrays = np.zeros(n), np.zeros((n, n)), np.zeros(3), sampled_at, refused
    return ObserverState(*arrays, False, 0, 0, (0.0, 0.0), no_commands())


@kernel
def observe(stamp: int, pose: Pose, wrench: Wrench, s: ObserverState, c: ObserverConstants) -> ObserverState:
    """Predict the estimate to the time of a new measurement and correct it.

    `stamp`: time of the measurement, ns. `pose`: measured x, y, psi. `wrench`: wrench commanded since the last update, N, N·m.
    `s`: state of the filter; its arrays are written in place. Returns state of the filter.
    """
    if not s.started:
        s = begin(stamp, pose, s, c)
    applied = s.applied
    if stamp > s.stamp:
        dt = seconds(stamp - s.stamp)
        applied = actuated(applied, s.stamp, wrench, dt, s.commands, c.actuators)
        predict(s.x, s.P, applied, dt, c)
    # Position and heading are separate sensors with rates of their own, so each is tested for a new sample on its own.
    position_gate, heading_gate = gate_of_position(stamp, pose, s), gate_of_heading(stamp, pose, s)
    refuse_outliers(pose, position_gate, heading_gate, s, c)
    accepted_at = s.accepted_at
    if position_gate > 0.0 or heading_gate > 0.0:
        s.P[:] = 0.5 * (s.P + s.P.T)  # rounding must not make it unsymmetric
        if s.refused[0] == 0 and s.refused[1] == 0:
            accepted_at = stamp
        elif seconds(stamp - accepted_at) > LONGEST_HOLD:
            return begin(stamp, pose, s, c)
    arrays = s.x, s.P, s.held, s.sampled_at, s.refused
    return ObserverState(*arrays, True, max(stamp, s.stamp), accepted_at, applied, s.commands)


@kernel
def refuse_outliers(pose: Pose, position_gate: float, heading_gate: float, s: ObserverState, c: ObserverConstants) -> None:
    """Correct by what is measured, and note which sensor has an outlier; in place.

    `pose`: measured x, y, psi. `position_gate`, `heading_gate`: innovation gates, 0 for no new sample.
    """
    for i in range(3):
        sensor, gate = (1, heading_gate) if i == PSI else (0, position_gate)
        if gate > 0.0:
            # A position that is refused stays so until the next one, whatever headings come between.
            refused = not correct(i, pose[i], gate, s.x, s.P, c) and gate == GATE
            s.refused[sensor] = 1 if refused or (i == 1 and s.refused[0] == 1) else 0
    for i in range(3):
        s.x[D1 + i] = between(float(s.x[D1 + i]), c.decay[i] - WIDEST_DECAY, c.decay[i] + WIDEST_DECAY)


@kernel
def estimate(s: ObserverState) -> Motion:
    """The estimated low-frequency motion, its heading in (-pi, pi]."""
    x = s.x
    return Motion(float(x[0]), float(x[1]), wrap(float(x[2])), float(x[3]), float(x[4]), float(x[5]))


@kernel
def begin(stamp: int, pose: Pose, s: ObserverState, c: ObserverConstants) -> ObserverState:
    """Initialise the filter at a measured pose, at rest and without disturbance; the arguments are those of `observe`."""
    s.x[:] = 0.0
    s.P[:] = 0.0
    for i in range(len(c.start)):
        s.P[i, i] = c.start[i]
    for i in range(3):
        s.x[i] = pose[i]
        s.x[D1 + i] = c.decay[i]
        s.held[i] = math.nan  # equal to no sample
    s.sampled_at[:], s.refused[:] = stamp, 0
    return ObserverState(s.x, s.P, s.held, s.sampled_at, s.refused, True, stamp, stamp, s.applied, s.commands)


@kernel
def predict(x: Array, P: Array, applied: Wrench, dt: float, c: ObserverConstants) -> None:
    """Propagate state and covariance by the model over dt: x <- f(x), P <- F·P·Fᵀ + dt·Q; in place.

    `P`: covariance, symmetric. `applied`: wrench on the hull, N, N·m. `dt`: time step, s.
    """
    # The vessel model is nonlinear, hence the Jacobian (extended Kalman filter); the wave filter is linear and exact.
    propagate_covariance(x, P, dt, c.model)
    turning = applied[1] / c.m_p
    propagate(x, applied[0] / c.m11, turning, dt, c.model)
    if c.x_p != 0.0:  # the yaw moment turns the ship about the centre of percussion
        x[V] -= dt * c.x_p * turning
    P += dt * c.Q


@kernel
def gate_of_position(stamp: int, pose: Pose, s: ObserverState) -> float:
    """Innovation gate of the measured position, which is then held; 0 for one that repeats a sample and is not to be used.

    A measurement that only repeats an earlier sample is not used again: it is old, and its noise is not independent. `stamp`:
    time of the measurement, ns. `pose`: measured x, y, psi.
    """
    same = s.held[0] == pose[0] and s.held[1] == pose[1]
    if same and seconds(stamp - int(s.sampled_at[0])) < LONGEST_HOLD:
        return 0.0
    s.held[0], s.held[1], s.sampled_at[0] = pose[0], pose[1], stamp
    return HELD_GATE if same else GATE


@kernel
def gate_of_heading(stamp: int, pose: Pose, s: ObserverState) -> float:
    """Innovation gate of the measured heading; see `gate_of_position`."""
    same = s.held[2] == pose[2]
    if same and seconds(stamp - int(s.sampled_at[1])) < LONGEST_HOLD:
        return 0.0
    s.held[2], s.sampled_at[1] = pose[2], stamp
    return HELD_GATE if same else GATE


@kernel
def correct(i: int, measured: float, gate: float, x: Array, P: Array, c: ObserverConstants) -> bool:
    """Correct by one scalar measurement of state i plus wave motion, unless it is an outlier; in place.

    Correcting by x, y and psi one after the other is exact, because their noises are independent. `gate`: largest innovation to
    accept, in standard deviations. Returns whether the measurement was accepted.
    """
    expected, column, variance = float(x[i]), P[:, i].copy(), c.noise[i]
    if c.model.waves:
        expected += float(x[DXI + i])
        column += P[:, DXI + i]
        variance += float(column[DXI + i])
    variance += float(column[i])
    difference = wrap(measured - expected) if i == PSI else measured - expected
    if difference * difference > gate * gate * variance:  # the innovation over its standard deviation
        return False
    # Kalman gain of a scalar measurement: the innovation variance is a number, so no matrix is inverted.
    gain = column / variance
    x += gain * difference
    P -= gain.reshape(-1, 1) * column
    return True


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

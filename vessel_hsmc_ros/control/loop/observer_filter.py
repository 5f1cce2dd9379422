"""One update of the observer: prediction by the model, then correction by x, y and psi one after the other."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.loop.observer_covariance import propagate_covariance
from vessel_hsmc_ros.control.loop.observer_model import (
    D1,
    DXI,
    PSI,
    Actuators,
    Commands,
    Model,
    V,
    Wrench,
    actuated,
    no_commands,
    propagate,
)
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.core.limits import between
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

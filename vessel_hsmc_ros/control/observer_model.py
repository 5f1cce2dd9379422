"""The model of the observer: vessel dynamics with disturbances as states, and a second-order model of the wave motion.

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

The states are in the order p, psi, u, v, r, b, w and, with waves, xi, dxi.
"""

import math

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_parameters import ObserverParameters

Array = NDArray[np.float64]

PSI, U, V, R, BU, BV, BR, WE, WN = range(2, 11)
"""Indices of the states after the position."""

XI, DXI = 11, 14
"""Indices of the first states of xi and dxi, three each."""


def propagate(x: Array, surge: float, yaw: float, dt: float, p: ObserverParameters) -> Array:
    """The states p, psi, nu, b, w of the vessel model after dt, with b and w constant.

    The velocities are integrated in the earth-fixed frame, where the Coriolis terms v·r and -u·r vanish: integrated by Euler
    steps in the body frame, they would add kinetic energy in a turn.

    Args:
        x: States, shape (11,).
        surge, yaw: Accelerations by the wrench, tau_1/m11 [m/s²] and tau_2/m33 [rad/s²].
        dt: Time step, s.
        p: Decay rates of the linear damping.

    Returns:
        The states after dt, shape (11,).
    """
    psi, u, v, r, b_u, b_v, b_r, w_e, w_n = x[PSI:XI].tolist()
    decay_u, decay_v, decay_r = _decays(dt, p)
    # decay/dt·velocity is the mean deceleration of an exponential decay over dt.
    turn = yaw + b_r - decay_r / dt * r
    middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
    along, across = surge + b_u - decay_u / dt * u, b_v - decay_v / dt * v
    velocity = _rotated(psi, u, v)
    change = dt * (_rotated(middle, along, across) + np.array([w_e, w_n]))
    after = x.copy()
    after[:2] += dt * (velocity + 0.5 * change)
    after[PSI], after[R] = end, r + dt * turn
    # Back into the body frame at the new heading.
    after[U], after[V] = _rotated(-end, *(velocity + change))
    return after


def jacobian(x: Array, dt: float, p: ObserverParameters) -> Array:
    """The Jacobian of `propagate` with respect to x, to first order in dt, shape (11, 11).

    Args:
        x: States, shape (11,).
        dt: Time step, s.
        p: Decay rates.

    Returns:
        d(states after dt)/d(states), shape (11, 11).
    """
    psi, u, v, r, _, _, _, w_e, w_n = x[PSI:XI].tolist()
    decay_u, decay_v, decay_r = _decays(dt, p)
    middle = psi + 0.5 * dt * r
    c, s = math.cos(middle), math.sin(middle)
    F = np.eye(XI)
    F[0, PSI : V + 1] = dt * np.array([-u * s - v * c, c, -s])
    F[1, PSI : V + 1] = dt * np.array([u * c - v * s, s, c])
    F[PSI, R] = F[U, BU] = F[V, BV] = F[R, BR] = dt
    F[U, U : R + 1] = 1.0 - decay_u, dt * r, dt * v
    F[V, U : R + 1] = -dt * r, 1.0 - decay_v, -dt * u
    F[R, R] = 1.0 - decay_r
    F[U, [PSI, WE, WN]] = dt * np.array([w_n * c - w_e * s, c, s])
    F[V, [PSI, WE, WN]] = dt * np.array([-w_e * c - w_n * s, -s, c])
    return F


def _decays(dt: float, p: ObserverParameters) -> tuple[float, float, float]:
    """Fractions by which linear damping reduces u, v and r within dt."""
    return -math.expm1(-p.surge_decay * dt), -math.expm1(-p.sway_decay * dt), -math.expm1(-p.yaw_decay * dt)


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

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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.observer_parameters import ObserverParameters
from vessel_hsmc_ros.core.kernel import kernel

Array = NDArray[np.float64]

PSI, U, V, R, BU, BV, BR, WE, WN = range(2, 11)
"""Indices of the states after the position."""

XI, DXI = 11, 14
"""Indices of the first states of xi and dxi, three each."""


class Model(NamedTuple):
    """The constants of the model by its symbols, and whether it has waves."""

    d_1: float
    d_2: float
    d_3: float
    omega_0: float
    zeta: float
    waves: bool


def model(p: ObserverParameters) -> Model:
    """The constants of the model; without waves omega_0 is 0."""
    waves = p.wave_period > 0.0
    omega_0 = 2.0 * math.pi / p.wave_period if waves else 0.0
    return Model(p.surge_decay, p.sway_decay, p.yaw_decay, omega_0, p.wave_damping, waves)


@kernel
def propagate(x: Array, surge: float, yaw: float, dt: float, m: Model) -> None:
    """Advance the states of the vessel model by dt, with b and w constant, and those of the wave filter; in place.

    The velocities are integrated in the earth-fixed frame, where the Coriolis terms v·r and -u·r vanish: integrated by Euler
    steps in the body frame, they would add kinetic energy in a turn.

    Args:
        x: States, shape (11,), with waves (17,).
        surge, yaw: Accelerations by the wrench, tau_1/m11 [m/s²] and tau_2/m33 [rad/s²].
        dt: Time step, s.
        m: Constants of the model.
    """
    psi, u, v, r = float(x[PSI]), float(x[U]), float(x[V]), float(x[R])
    decay_u, decay_v, decay_r = decays(dt, m)
    # decay/dt·velocity is the mean deceleration of an exponential decay over dt.
    turn = yaw + float(x[BR]) - decay_r / dt * r
    middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
    east, north = rotated(psi, u, v)
    force_east, force_north = rotated(middle, surge + float(x[BU]) - decay_u / dt * u, float(x[BV]) - decay_v / dt * v)
    change_east, change_north = dt * (force_east + float(x[WE])), dt * (force_north + float(x[WN]))
    x[0] += dt * (east + 0.5 * change_east)
    x[1] += dt * (north + 0.5 * change_north)
    x[PSI], x[R] = end, r + dt * turn
    # Back into the body frame at the new heading.
    x[U], x[V] = rotated(-end, east + change_east, north + change_north)
    if m.waves:
        a, b, c, d = wave_transition(dt, m)
        xi = a * x[XI:DXI] + b * x[DXI:]
        x[DXI:] = c * x[XI:DXI] + d * x[DXI:]
        x[XI:DXI] = xi


@kernel
def decays(dt: float, m: Model) -> tuple[float, float, float]:
    """Fractions by which linear damping reduces u, v and r within dt."""
    return -math.expm1(-m.d_1 * dt), -math.expm1(-m.d_2 * dt), -math.expm1(-m.d_3 * dt)


@kernel
def rotated(angle: float, along: float, across: float) -> tuple[float, float]:
    """A horizontal vector rotated counter-clockwise."""
    c, s = math.cos(angle), math.sin(angle)
    return along * c - across * s, along * s + across * c


@kernel
def wave_transition(dt: float, m: Model) -> tuple[float, float, float, float]:
    """Transition matrix of the wave filter ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi, in closed form.

    An Euler step would add energy to the oscillation.

    Args:
        dt: Time step, s.
        m: Constants of the model, with zeta below 1.

    Returns:
        Matrix for (xi, dxi) of one component, shape (2, 2), row by row.
    """
    omega, decay = m.omega_0 * math.sqrt(1.0 - m.zeta * m.zeta), math.exp(-m.zeta * m.omega_0 * dt)
    c, s = decay * math.cos(omega * dt), decay * math.sin(omega * dt) / omega
    return c + m.zeta * m.omega_0 * s, s, -m.omega_0 * m.omega_0 * s, c - m.zeta * m.omega_0 * s


@kernel
def jacobian(x: Array, dt: float, m: Model) -> Array:
    """What is not constant in the Jacobian F of `propagate`, to first order in dt.

    Args:
        x: States before the step.
        dt: Time step, s.
        m: Constants of the model.

    Returns:
        The columns of psi, u, v, r, w_E and w_N of F - I, their rows those of the first six states, shape (6, 6, 1).
    """
    psi, u, v, r, w_e, w_n = float(x[PSI]), float(x[U]), float(x[V]), float(x[R]), float(x[WE]), float(x[WN])
    decay_u, decay_v, decay_r = decays(dt, m)
    middle = psi + 0.5 * dt * r
    c, s = math.cos(middle), math.sin(middle)
    columns = np.array(
        [
            [dt * (-u * s - v * c), dt * (u * c - v * s), 0.0, dt * (w_n * c - w_e * s), dt * (-w_e * c - w_n * s), 0.0],
            [dt * c, dt * s, 0.0, -decay_u, -dt * r, 0.0],
            [-dt * s, dt * c, 0.0, dt * r, -decay_v, 0.0],
            [0.0, 0.0, dt, dt * v, -dt * u, -decay_r],
            [0.0, 0.0, 0.0, dt * c, -dt * s, 0.0],
            [0.0, 0.0, 0.0, dt * s, dt * c, 0.0],
        ]
    )
    return columns.reshape(6, 6, 1)


@kernel
def multiply(F: Array, M: Array, dt: float, m: Model) -> None:
    """M <- F·M in place, row by row, because most elements of F are those of the unit matrix.

    Args:
        F: The columns of `jacobian`.
        M: Matrix with one row a state; F·(F·P)ᵀ is the predicted covariance.
        dt: Time step, s.
        m: Constants of the model.
    """
    change = F[0] * M[PSI] + F[1] * M[U] + F[2] * M[V] + F[3] * M[R] + F[4] * M[WE] + F[5] * M[WN]
    # The body-fixed disturbance accelerates u, v, r, which are next to one another as b_u, b_v, b_r are.
    change[U:BU] += dt * M[BU:WE]
    M[:BU] += change
    if m.waves:
        a, b, c, d = wave_transition(dt, m)
        xi = a * M[XI:DXI] + b * M[DXI:]
        M[DXI:] = c * M[XI:DXI] + d * M[DXI:]
        M[XI:DXI] = xi

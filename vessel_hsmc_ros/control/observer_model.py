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
| m11, m_p | known inertia in surge, and that which the yaw moment accelerates | kg, kg·m² |
| x_p | distance of the known pivot point ahead of the origin | m |

The model is Newton's second law in the body-fixed frame,

    dp = R(psi)·(u, v)      du = v·r + tau_1/m11 - d_1·u + b_u + w_E·cos psi + w_N·sin psi      db = noise
    dpsi = r                dv = -u·r - x_p·tau_2/m_p - d_2·v + b_v - w_E·sin psi + w_N·cos psi dw = noise
                            dr = tau_2/m_p       - d_3·r + b_r
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
        for i in range(3):
            xi, dxi = float(x[XI + i]), float(x[DXI + i])
            x[XI + i], x[DXI + i] = a * xi + b * dxi, c * xi + d * dxi


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


class Jacobian(NamedTuple):
    """The elements of G = F - I, where F is the Jacobian of `propagate`, to first order in dt.

    Attributes:
        dt: Time step, s.
        c, s: dt·cos psi and dt·sin psi at the middle of the step.
        x_psi, y_psi, u_psi, v_psi: Derivatives of the changes of x, y, u and v with respect to psi.
        along, aside, turn: dt·u, dt·v and dt·r.
        decay_u, decay_v, decay_r: Fractions by which damping reduces u, v and r.
    """

    dt: float
    c: float
    s: float
    x_psi: float
    y_psi: float
    u_psi: float
    v_psi: float
    along: float
    aside: float
    turn: float
    decay_u: float
    decay_v: float
    decay_r: float


@kernel
def jacobian(x: Array, dt: float, m: Model) -> Jacobian:
    """The Jacobian of `propagate` at the states x before the step."""
    along, aside, turn = dt * float(x[U]), dt * float(x[V]), dt * float(x[R])
    w_e, w_n = float(x[WE]), float(x[WN])
    middle = float(x[PSI]) + 0.5 * turn
    c, s = math.cos(middle), math.sin(middle)
    decay_u, decay_v, decay_r = decays(dt, m)
    return Jacobian(
        dt,
        dt * c,
        dt * s,
        -along * s - aside * c,
        along * c - aside * s,
        dt * (w_n * c - w_e * s),
        dt * (-w_e * c - w_n * s),
        along,
        aside,
        turn,
        decay_u,
        decay_v,
        decay_r,
    )


@kernel
def change(M: Array, g: Jacobian) -> Array:
    """G·M for a matrix M with one row a state: the first six rows, because the others are zero."""
    psi, u, v, r, w_e, w_n = M[PSI], M[U], M[V], M[R], M[WE], M[WN]
    rows = np.empty((BU, M.shape[1]))
    rows[0] = g.x_psi * psi + g.c * u - g.s * v
    rows[1] = g.y_psi * psi + g.s * u + g.c * v
    rows[PSI] = g.dt * r
    rows[U] = g.u_psi * psi - g.decay_u * u + g.turn * v + g.aside * r + g.dt * M[BU] + g.c * w_e + g.s * w_n
    rows[V] = g.v_psi * psi - g.turn * u - g.decay_v * v - g.along * r + g.dt * M[BV] - g.s * w_e + g.c * w_n
    rows[R] = g.dt * M[BR] - g.decay_r * r
    return rows


@kernel
def pass_waves(M: Array, dt: float, m: Model) -> None:
    """M <- F·M in place for the rows of xi and dxi, from `wave_transition`."""
    a, b, c, d = wave_transition(dt, m)
    xi = a * M[XI:DXI] + b * M[DXI:]
    M[DXI:] = c * M[XI:DXI] + d * M[DXI:]
    M[XI:DXI] = xi


@kernel
def propagate_covariance(x: Array, P: Array, dt: float, m: Model) -> None:
    """P <- F·P·Fᵀ in place, with the Jacobian F of `propagate` at x.

    Args:
        x: States before the step.
        P: Their covariance, symmetric.
        dt: Time step, s.
        m: Constants of the model.
    """
    if m.waves:
        pass_waves(P, dt, m)
        pass_waves(P.T, dt, m)
    # Most elements of F are those of the unit matrix: with F = I + G, F·P·Fᵀ = P + G·P + (G·P)ᵀ + G·(G·P)ᵀ.
    g = jacobian(x, dt, m)
    rows = change(P, g)
    P[:BU] += rows
    P[:, :BU] += rows.T
    P[:BU, :BU] += change(rows.T, g)

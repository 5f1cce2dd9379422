"""How the covariance of the observer's states goes from one time to the next, with the symbols of `observer_model`."""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.loop.observer_model import (
    BR,
    BU,
    BV,
    CE,
    CN,
    D1,
    D2,
    D3,
    DXI,
    PSI,
    XI,
    Model,
    R,
    U,
    V,
    decays,
    through_water,
    wave_transition,
)
from vessel_hsmc_ros.core.arrays import Array
from vessel_hsmc_ros.core.kernel import kernel


class Jacobian(NamedTuple):
    """The elements of G = F - I, where F is the Jacobian of `propagate`, to first order in dt.

    A name such as u_psi is the derivative of the change of u with respect to psi.
    """

    dt: float  # time step, s
    # c, s: dt·cos psi and dt·sin psi at the middle of the step
    c: float
    s: float
    # decay_u, decay_v, decay_r: fractions by which damping reduces u_r, v_r and r
    decay_u: float
    decay_v: float
    decay_r: float
    x_psi: float
    y_psi: float
    u_psi: float
    u_v: float
    u_r: float
    u_d: float
    u_ce: float
    u_cn: float
    v_psi: float
    v_u: float
    v_r: float
    v_d: float
    v_ce: float
    v_cn: float
    r_psi: float
    r_u: float
    r_v: float
    r_d: float
    r_ce: float
    r_cn: float


@kernel
def jacobian(x: Array, dt: float, m: Model) -> Jacobian:
    """The Jacobian of `propagate` at the states x before the step."""
    u, v, r = float(x[U]), float(x[V]), float(x[R])
    u_r, v_r = through_water(x)
    u_c, v_c, turn = u - u_r, v - v_r, dt * r
    middle = float(x[PSI]) + 0.5 * turn
    c, s = dt * math.cos(middle), dt * math.sin(middle)
    decay_u, decay_v, decay_r = decays(x, dt)
    loss_u, loss_v, k_u, k_v, k_r = decay_u / dt, decay_v / dt, m.k_u * r, m.k_v * r, m.k_r
    return Jacobian(
        dt,
        c,
        s,
        decay_u,
        decay_v,
        decay_r,
        -u * s - v * c,
        u * c - v * s,
        decay_u * v_c + dt * k_u * u_c,
        turn + dt * k_u,
        dt * (v + m.k_u * v_r),
        -decay_u * u_r,
        loss_u * c + k_u * s,
        loss_u * s - k_u * c,
        -decay_v * u_c - dt * k_v * v_c,
        dt * k_v - turn,
        dt * (m.k_v * u_r - u),
        -decay_v * v_r,
        -loss_v * s - k_v * c,
        loss_v * c - k_v * s,
        dt * k_r * (u_r * u_c - v_r * v_c),
        dt * k_r * v_r,
        dt * k_r * u_r,
        -decay_r * r,
        k_r * (u_r * s - v_r * c),
        -k_r * (u_r * c + v_r * s),
    )


@kernel
def change(M: Array, g: Jacobian) -> Array:
    """G·M for a matrix M with one row a state: the first six rows, because the others are zero."""
    psi, u, v, r, c_e, c_n = M[PSI], M[U], M[V], M[R], M[CE], M[CN]
    rows = np.empty((BU, M.shape[1]))
    rows[0] = g.x_psi * psi + g.c * u - g.s * v
    rows[1] = g.y_psi * psi + g.s * u + g.c * v
    rows[PSI] = g.dt * r
    own = g.u_psi * psi - g.decay_u * u + g.u_v * v + g.u_r * r + g.u_d * M[D1] + g.u_ce * c_e + g.u_cn * c_n
    rows[U] = own + g.dt * M[BU]
    own = g.v_psi * psi + g.v_u * u - g.decay_v * v + g.v_r * r + g.v_d * M[D2] + g.v_ce * c_e + g.v_cn * c_n
    rows[V] = own + g.dt * M[BV]
    own = g.r_psi * psi + g.r_u * u + g.r_v * v - g.decay_r * r + g.r_d * M[D3] + g.r_ce * c_e + g.r_cn * c_n
    rows[R] = own + g.dt * M[BR]
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

    `P`: their covariance, symmetric. `dt`: time step, s.
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

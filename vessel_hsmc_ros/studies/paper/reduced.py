"""The reduced dynamics: the closed loop of the law as printed, on both of its sliding surfaces.

S1 = 0 and S2 = 0 are two linear equations for the surge and the yaw velocity,

    (b - a·z1)·r = b·(r_d - c2·z3e) - a·(c1·z2e + v - dz2d)
    u = dz1d - c3·z1e - z2·r

so position, heading and sway velocity remain as states of (6), without an input. With the printed weights, b/a = 1e5, the first
equation is dz3e = -c2·z3e up to a relative error of 1e-5: the heading converges to its reference, and so does z1e; then
u = u_d - r_d·z2e and, to first order in z2e and with r = r_d,

    ddz2e + (d_v/m22)·dz2e - (m11/m22)·r²·z2e = tau_vw

which is marginally stable on a straight line and unstable in every turn, and in which a constant disturbance lets
the error grow without bound.

| symbol | meaning | unit | equation |
|---|---|---|---|
| z1e, z2e, z3e | tracking errors | m, m, rad | (11) |
| a, b, c1, c2, c3 | weights and slopes of the surfaces | - | (12), (17), (20), (23) |
| u, v, r | velocities of the ship | m/s, m/s, rad/s | (6) |
| tau_vw | disturbance in sway | m/s² | (6) |
"""

import math
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import Motion, tracking_error, transform, transform_rate
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration

ON_SURFACES, STRIDE = 20.0, 10
"""Time from which a run is compared with the reduced dynamics, s, and half the step of the comparison in samples."""

RUNAWAY = 1e6  # a position, heading or velocity beyond this is not physical


class Surfaces(NamedTuple):
    """The constants of both surfaces, by the paper's symbols: slopes c1, c2, c3 and weights a, b."""

    c1: float
    c2: float
    c3: float
    a: float
    b: float


def on_surfaces(x: float, y: float, psi: float, v: float, desired: Motion, g: Surfaces) -> tuple[float, float, float]:
    """Velocities that keep S1 = S2 = 0, and the lateral error.

    `x`, `y`, `psi`, `v`: position, heading and sway velocity of the ship. Returns u [m/s], r [rad/s], z2e [m].
    """
    z, z_d = transform(Motion(x, y, psi, 0.0, v, 0.0)), transform(desired)
    dz_d = transform_rate(z_d, desired)
    z_e = tracking_error(z, z_d)
    r = (g.b * (dz_d.z3 - g.c2 * z_e.z3) - g.a * (g.c1 * z_e.z2 + v - dz_d.z2)) / (g.b - g.a * z.z1)
    return dz_d.z1 - g.c3 * z_e.z1 - z.z2 * r, r, z_e.z2


class Reduced(NamedTuple):
    """State of the reduced dynamics, or its time derivative."""

    x: float
    y: float
    psi: float
    v: float


def rate(state: Reduced, desired: Motion, tau_vw: float, g: Surfaces, vessel: Vessel) -> Reduced:
    """The time derivative of the state.

    `tau_vw`: disturbance in sway, m/s². `vessel`: coefficients of (6).
    """
    u, r, _ = on_surfaces(state.x, state.y, state.psi, state.v, desired, g)
    f_v = unforced_acceleration(u, state.v, r, vessel)[1]
    c, s = math.cos(state.psi), math.sin(state.psi)
    return Reduced(u * c - state.v * s, u * s + state.v * c, r, f_v + tau_vw)


def moved(state: Reduced, step: float, rate: Reduced) -> Reduced:
    """The state moved by a step at a rate."""
    return Reduced(state.x + step * rate.x, state.y + step * rate.y, state.psi + step * rate.psi, state.v + step * rate.v)


def lateral_error(time: Array, reference: Array, disturbance: Array, start: Array, g: Surfaces, vessel: Vessel) -> Array:
    """Integrate the reduced dynamics along a reference, by RK4 in steps of two samples.

    Args:
        time: Evenly spaced, (2·n + 1,) s.
        reference: x, y, psi, u, v, r of the virtual ship at those times, (2·n + 1, 6).
        disturbance: tau_vw at those times, (2·n + 1,) m/s².
        start: x, y, psi, v of the ship at the first time, (4,).
        vessel: Coefficients of (6).

    Returns:
        z2e at every other time, (n + 1,) m; NaN from where the motion exceeds RUNAWAY.
    """
    desired, tau_vw = [Motion(*row) for row in reference.tolist()], disturbance.tolist()
    state, T = Reduced(*start.tolist()), float(time[2] - time[0])
    errors = np.full((len(time) + 1) // 2, np.nan)
    errors[0] = on_surfaces(*state, desired[0], g)[2]
    for k in range(0, len(time) - 1, 2):
        # The reference is given at samples only, so its values at k + 1 serve the middle of a step from k to k + 2.
        k1 = rate(state, desired[k], tau_vw[k], g, vessel)
        k2 = rate(moved(state, 0.5 * T, k1), desired[k + 1], tau_vw[k + 1], g, vessel)
        k3 = rate(moved(state, 0.5 * T, k2), desired[k + 1], tau_vw[k + 1], g, vessel)
        k4 = rate(moved(state, T, k3), desired[k + 2], tau_vw[k + 2], g, vessel)
        mean = Reduced(*(a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
        state = moved(state, T / 6.0, mean)
        # Negated so that NaN ends the integration too.
        if not all(abs(value) < RUNAWAY for value in state):
            break
        errors[k // 2 + 1] = on_surfaces(*state, desired[k + 2], g)[2]
    return errors


def growth_rate(r: float, v: float, vessel: Vessel) -> float:
    """The larger root of s² + (D/m22)·s - (m11/m22)·r² = 0: the growth rate of z2e in a turn, 1/s.

    D = d_v + 2·d_v2·|v| + 3·d_v3·v² is the slope of the damping at v: a small error adds to the sway velocity of the turn. `r`:
    yaw velocity, rad/s; on a straight line the root is 0. `v`: sway velocity, m/s. `vessel`: coefficients of (6).
    """
    damping = (vessel.d_v + 2.0 * vessel.d_v2 * abs(v) + 3.0 * vessel.d_v3 * v * v) / vessel.m22
    return 0.5 * (math.sqrt(damping * damping + 4.0 * vessel.m11 / vessel.m22 * r * r) - damping)


def reduced_error(run: Run, vessel: Vessel, gains: HierarchicalPrintedParameters) -> tuple[Array, Array]:
    """Times and lateral errors that the reduced dynamics predict from ON_SURFACES on; empty for a run that ends before.

    The prediction holds only for a constant weight a: a weight of switching sign changes the surfaces at every switch. `run`:
    the run to compare with, which provides the initial state, the reference and the disturbance. `vessel`: coefficients of (6).
    Returns times, (n,) s, and z2e, (n,) m.
    """
    rows = np.flatnonzero(run.time >= ON_SURFACES)[::STRIDE]
    # An odd number of samples, because one Runge-Kutta step spans two intervals.
    rows = rows[: len(rows) - 1 + len(rows) % 2]
    if len(rows) < 3 or gains.sway_weight_sign != "constant":
        return np.empty(0), np.empty(0)
    symbols = schema.symbols(gains)
    surfaces = Surfaces(**{name: symbols[name] for name in Surfaces._fields})
    start = run.state[rows[0], [0, 1, 2, 4]]
    error = lateral_error(run.time[rows], run.reference[rows], run.disturbance[rows, 1], start, surfaces, vessel)
    return run.time[rows[::2]], error

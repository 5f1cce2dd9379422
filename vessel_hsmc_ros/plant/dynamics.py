"""The ship model: a surface vessel in three degrees of freedom (surge, sway, yaw), equations (6) and (7), with coupling terms.

| symbol | meaning | unit | equation |
|---|---|---|---|
| x, y | position in the earth-fixed frame | m | (6) |
| psi | heading, counter-clockwise from x | rad | (6) |
| u, v, r | surge, sway and yaw velocity in the body frame, nu | m/s, m/s, rad/s | (6) |
| tau_1, tau_2 | surge force X and yaw moment N, the two inputs | N, N·m | (6) |
| X, Y, N | the wrench on the hull; Y is the side force of rudders and thrusters | N, N, N·m | not in the paper |
| m11, m22 | mass with added mass, surge and sway | kg | (6) |
| m33 | moment of inertia with added inertia, yaw | kg·m² | (6) |
| m23, m32 | inertia that couples sway and yaw | kg·m | not in the paper |
| d_u, d_v, d_r | linear damping | kg/s, kg/s, kg·m²/s | (6) |
| d_u2 .. d_r3 | quadratic and cubic damping | per power of the velocity | (6) |
| d_x_vv .. d_n_uv | damping by other velocities, such as d_y_r: sway force lost to r | hull_parameters.py | not in the paper |
| tau_uw, tau_vw, tau_rw | disturbances, as accelerations | m/s², m/s², rad/s² | (6) |
| f_u, f_v, f_r | unforced acceleration: Coriolis forces and damping | m/s², m/s², rad/s² | (7) |
| E, N | current, steady and uniform, east and north | m/s | not in the paper |
| u_c, v_c | the current in the body frame | m/s | not in the paper |
| nu_r | u - u_c, v - v_c, r: velocity relative to the water | m/s, m/s, rad/s | not in the paper |

The class of ships, in still water, is M·dnu + C(nu)·nu + D(nu)·nu = (X, Y, N) + disturbance with

    M = [m11 0 0; 0 m22 m23; 0 m32 m33]
    C(nu) = [0 0 c13; 0 0 c23; -c13 -c23 0],   c13 = -(m22·v + m_c·r),   c23 = m11·u,   m_c = (m23 + m32)/2
    (D·nu)_X = d_u·u + d_u2·|u|u + d_u3·u³ + d_x_vv·v² + d_x_vr·v·r
    (D·nu)_Y = d_v·v + d_v2·|v|v + d_v3·v³ + d_y_rv·|r|v + d_y_uv·|u|v + d_y_r·r + d_y_rr·|r|r + d_y_vr·|v|r + d_y_ur·u·r
    (D·nu)_N = d_r·r + d_r2·|r|r + d_r3·r³ + d_n_vr·|v|r + d_n_ur·|u|r + d_n_v·v + d_n_vv·|v|v + d_n_rv·|r|v + d_n_uv·|u|v

C is skew-symmetric, so Coriolis forces do no work: that takes a symmetric matrix, hence the mean m_c; M keeps m23 and m32 apart.
The paper's ship (6) is the case in which all coefficients beyond its own are zero; it is computed by its own equations.

In a current M, C and D act on nu_r. The state remains the velocity over ground, dnu = dnu_r + dnu_c. The current is constant in
the earth-fixed frame, so in the body frame du_c = r·v_c and dv_c = -r·u_c, whatever M is:

    du = f_u(nu_r) + r·v_c + (M⁻¹·(X, Y, N))_u + tau_uw
    dv = f_v(nu_r) - r·u_c + (M⁻¹·(X, Y, N))_v + tau_vw
    dr = f_r(nu_r)         + (M⁻¹·(X, Y, N))_r + tau_rw

The rigid body may stand on nu_r as well: with C_RB independent of the linear velocity, M_RB·dnu + C_RB(r)·nu is the same for nu
and nu_r in a uniform current, so one M and one C hold both parts.

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode; beyond the
paper: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control (2021), chapters 6 and 10.
The printed f_r divides the higher-order yaw damping by m11; it is interpreted here as m33, the inertia of that equation. The
printed form is selected by `as_printed`, which is equivalent to d_r2 and d_r3 being m33/m11 times larger.

A hull that travels along a plane curve has the speed W and the drift angle beta, which is course minus heading, positive for a
drift to port: u = W·cos(beta), v = W·sin(beta), r = W·kappa - dbeta/dt with the curvature kappa.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from vessel_hsmc_ros.core.kernel import Array, kernel
from vessel_hsmc_ros.core.kinematics import Motion, as_motion, to_body

Wrench = tuple[float, float, float]  # surge force [N], sway force [N], yaw moment [N·m] in the body frame
STILL_WATER = (0.0, 0.0)


class Vessel(NamedTuple):
    """The coefficients of the ship by the symbols of `dynamics`, and what follows from them.

    Attributes:
        m11 .. d_n_ur: Inertia and damping; those up to d_r3 are the paper's.
    """

    m11: float
    m22: float
    m33: float
    d_u: float
    d_v: float
    d_r: float
    d_u2: float
    d_u3: float
    d_v2: float
    d_v3: float
    d_r2: float
    d_r3: float
    m23: float
    m32: float
    d_x_vv: float
    d_x_vr: float
    d_y_r: float
    d_y_rv: float
    d_y_vr: float
    d_y_rr: float
    d_y_uv: float
    d_y_ur: float
    d_n_v: float
    d_n_vv: float
    d_n_rv: float
    d_n_vr: float
    d_n_uv: float
    d_n_ur: float
    coupled: bool  # whether any coefficient beyond the paper's is not zero
    m_c: float  # (m23 + m32)/2, the coupling inertia of the Coriolis forces
    # i22, i23, i32, i33: the inverse of [m22 m23; m32 m33]
    i22: float
    i23: float
    i32: float
    i33: float


@kernel
def unforced_acceleration(u: float, v: float, r: float, vessel: Vessel) -> tuple[float, float, float]:
    """f_u, f_v, f_r of (7): Coriolis, Munk moment and damping, without inputs and disturbances.

    `u`, `v`, `r`: body velocities, m/s, m/s, rad/s. Returns f_u [m/s²], f_v [m/s²], f_r [rad/s²].
    """
    s = vessel
    if s.coupled:
        return coupled_acceleration(u, v, r, vessel)
    # Damping opposes the velocity: |u|u and u³ are odd functions, so that the sign of the velocity is kept.
    f_u = (s.m22 * v * r - s.d_u * u - s.d_u2 * abs(u) * u - s.d_u3 * u * u * u) / s.m11
    f_v = (-s.m11 * u * r - s.d_v * v - s.d_v2 * abs(v) * v - s.d_v3 * v * v * v) / s.m22
    # (m11 - m22)·u·v is the Munk moment, which turns a hull at a drift angle broadside to the flow.
    f_r = ((s.m11 - s.m22) * u * v - s.d_r * r - s.d_r2 * abs(r) * r - s.d_r3 * r * r * r) / s.m33
    return f_u, f_v, f_r


@kernel
def coupled_acceleration(u: float, v: float, r: float, vessel: Vessel) -> tuple[float, float, float]:
    """`unforced_acceleration` of the whole class, M⁻¹·(-C(nu)·nu - D(nu)·nu); arguments and units are the same."""
    s = vessel
    lost_X, lost_Y, lost_N = damping_force(u, v, r, vessel)
    # -C·nu row by row; (m11 - m22)·u·v is the Munk moment.
    X = (s.m22 * v + s.m_c * r) * r - lost_X
    Y = -s.m11 * u * r - lost_Y
    N = ((s.m11 - s.m22) * v - s.m_c * r) * u - lost_N
    return acceleration((X, Y, N), vessel)


@kernel
def unforced_sway(u: float, v: float, r: float, dr: float, vessel: Vessel) -> float:
    """Dv of a hull on which no sway force acts while its yaw rate changes at dr: m22·dv + m23·dr = -(C·nu + D·nu)_Y.

    `u`, `v`, `r`: body velocities, m/s, m/s, rad/s. `dr`: yaw acceleration, rad/s², by whatever moment it takes. Returns dv
    [m/s²]; it is f_v where m23 is zero.
    """
    _, f_v, f_r = unforced_acceleration(u, v, r, vessel)
    if vessel.coupled:
        return f_v + vessel.m23 * (f_r - dr) / vessel.m22
    return f_v


@kernel
def damping_force(u: float, v: float, r: float, vessel: Vessel) -> Wrench:
    """D(nu)·nu, the wrench that the hull loses to damping; its power is u·X + v·Y + r·N.

    `u`, `v`, `r`: velocities relative to the water, m/s, m/s, rad/s. Returns surge force [N], sway force [N], yaw moment [N·m].
    """
    s = vessel
    # Every term of Y and N is odd in (v, r) and every term of X is even, so that the hull is symmetric to port and starboard.
    a, b, c = abs(u), abs(v), abs(r)
    X = (s.d_u + s.d_u2 * a + s.d_u3 * u * u) * u + (s.d_x_vv * v + s.d_x_vr * r) * v
    N = (s.d_r + s.d_r2 * c + s.d_r3 * r * r + s.d_n_vr * b + s.d_n_ur * a) * r
    N = N + (s.d_n_v + s.d_n_vv * b + s.d_n_rv * c + s.d_n_uv * a) * v
    return X, sway_damping(u, v, r, vessel), N


@kernel
def sway_damping(u: float, v: float, r: float, vessel: Vessel) -> float:
    """The sway force of `damping_force`, N; its arguments are the same."""
    s = vessel
    a, b, c = abs(u), abs(v), abs(r)
    Y = (s.d_v + s.d_v2 * b + s.d_v3 * v * v + s.d_y_rv * c + s.d_y_uv * a) * v
    return Y + (s.d_y_r + s.d_y_rr * c + s.d_y_vr * b + s.d_y_ur * u) * r


@kernel
def acceleration(wrench: Wrench, vessel: Vessel) -> tuple[float, float, float]:
    """The acceleration of the hull by a wrench, M⁻¹·(X, Y, N); m/s², m/s², rad/s².

    It makes disturbing accelerations (tau_uw, tau_vw, tau_rw) of forces: (6) adds them to du, dv, dr without an inertia.
    """
    s = vessel
    if s.coupled:
        return wrench[0] / s.m11, s.i22 * wrench[1] + s.i23 * wrench[2], s.i32 * wrench[1] + s.i33 * wrench[2]
    return wrench[0] / s.m11, wrench[1] / s.m22, wrench[2] / s.m33


def unforced_in_current(state: Array, vessel: Vessel, current: tuple[float, float] = STILL_WATER) -> tuple[float, float, float]:
    """The unforced acceleration of a ship in a current, including the rotation of the body frame; (7) in still water.

    `state`: x, y, psi, u, v, r, shape (6,); velocities over ground. `current`: E, N, m/s. Returns f_u(u_r, v_r, r) + r·v_c
    [m/s²], f_v(u_r, v_r, r) - r·u_c [m/s²], f_r(u_r, v_r, r) [rad/s²].
    """
    return unforced(as_motion(state), vessel, current)


def as_wrench(values: Any) -> Wrench:
    """The wrench of two or three numbers: surge force, sway force (0 where there are two) and yaw moment."""
    return float(values[0]), float(values[1]) if len(values) == 3 else 0.0, float(values[-1])


def derivative(state: Array, wrench: Any, disturbance: Any, vessel: Vessel, current: tuple[float, float] = STILL_WATER) -> Array:
    """The time derivative of the state, (6).

    `state`: x, y, psi, u, v, r, shape (6,); velocities over ground. `wrench`: tau_1 [N], tau_2 [N·m], shape (2,), or X [N], Y
    [N], N [N·m], shape (3,). `disturbance`: tau_uw [m/s²], tau_vw [m/s²], tau_rw [rad/s²], shape (3,). `current`: E, N, m/s.
    Returns derivatives in the order of the state, shape (6,).
    """
    disturbing = float(disturbance[0]), float(disturbance[1]), float(disturbance[2])
    return np.array(rate_of_motion(as_motion(state), as_wrench(wrench), disturbing, vessel, current))


@kernel
def rate_of_motion(
    motion: Motion, wrench: Wrench, disturbance: tuple[float, float, float], vessel: Vessel, current: tuple[float, float]
) -> Motion:
    """`derivative` of a motion; the arguments are the same.

    `motion`: state; velocities over ground. `wrench`: X, Y, N. `disturbance`: tau_uw, tau_vw, tau_rw. `current`: E, N. Returns
    derivatives in the order of the state.
    """
    u, v, r = motion.u, motion.v, motion.r
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    f_u, f_v, f_r = unforced(motion, vessel, current)
    a_u, a_v, a_r = acceleration(wrench, vessel)
    return Motion(
        u * c - v * s, u * s + v * c, r, f_u + a_u + disturbance[0], f_v + a_v + disturbance[1], f_r + a_r + disturbance[2]
    )


@kernel
def unforced(motion: Motion, vessel: Vessel, current: tuple[float, float]) -> tuple[float, float, float]:
    """`unforced_in_current` of a motion."""
    u_c = v_c = 0.0
    # In still water the forces do not wait for the cosine and sine.
    if current[0] != 0.0 or current[1] != 0.0:
        # The current in the body frame; the terms r·v_c and -r·u_c are its rates there.
        u_c, v_c = to_body(current[0], current[1], motion.psi)
    f_u, f_v, f_r = unforced_acceleration(motion.u - u_c, motion.v - v_c, motion.r, vessel)
    return f_u + motion.r * v_c, f_v - motion.r * u_c, f_r


def rk4(
    state: Array, wrench: Any, disturbance: Any, vessel: Vessel, step: float, current: tuple[float, float] = STILL_WATER
) -> Array:
    """Advance the state by one step; the local error is of order step⁵.

    Args:
        state: x, y, psi, u, v, r, shape (6,).
        wrench: tau_1 [N], tau_2 [N·m], shape (2,), or X [N], Y [N], N [N·m], shape (3,); constant over the step.
        disturbance: Disturbing accelerations, constant over the step, shape (3,), m/s², m/s², rad/s².
        step: Length of the step, s.
        current: Current towards the east and the north, m/s.

    Returns:
        The state at the end of the step, shape (6,).
    """
    disturbing = float(disturbance[0]), float(disturbance[1]), float(disturbance[2])
    return np.array(rk4_step(as_motion(state), as_wrench(wrench), disturbing, vessel, step, current))


@kernel
def rk4_step(
    motion: Motion,
    wrench: Wrench,
    disturbance: tuple[float, float, float],
    vessel: Vessel,
    step: float,
    current: tuple[float, float],
) -> Motion:
    """`rk4` of a motion; the arguments are the same.

    `wrench`, `disturbance`, `vessel`, `current`: as in `rate_of_motion`, constant over the step. `step`: length of the step, s.
    Returns the state at the end of the step.
    """
    half = 0.5 * step
    k1 = rate_of_motion(motion, wrench, disturbance, vessel, current)
    k2 = rate_of_motion(moved(motion, half, k1), wrench, disturbance, vessel, current)
    k3 = rate_of_motion(moved(motion, half, k2), wrench, disturbance, vessel, current)
    k4 = rate_of_motion(moved(motion, step, k3), wrench, disturbance, vessel, current)
    mean = Motion(
        k1.x + 2.0 * (k2.x + k3.x) + k4.x,
        k1.y + 2.0 * (k2.y + k3.y) + k4.y,
        k1.psi + 2.0 * (k2.psi + k3.psi) + k4.psi,
        k1.u + 2.0 * (k2.u + k3.u) + k4.u,
        k1.v + 2.0 * (k2.v + k3.v) + k4.v,
        k1.r + 2.0 * (k2.r + k3.r) + k4.r,
    )
    return moved(motion, step / 6.0, mean)


@kernel
def moved(motion: Motion, step: float, rate: Motion) -> Motion:
    """The motion after a step of a rate: motion + step·rate."""
    return Motion(
        motion.x + step * rate.x,
        motion.y + step * rate.y,
        motion.psi + step * rate.psi,
        motion.u + step * rate.u,
        motion.v + step * rate.v,
        motion.r + step * rate.r,
    )


STEEPEST = 1.55  # largest drift angle of the solution, rad; the hull then travels almost sideways


def damping_ratio(beta: Any, speed: Any, r: Any, vessel: Vessel) -> Any:
    """Y(u, v, r)/u at a drift angle and a yaw rate, numbers or arrays, kg/s·(m/s).

    `beta`: drift angle, rad. `speed`: U, m/s. `r`: yaw rate, rad/s.
    """
    u = speed * np.cos(beta)
    return sway_damping(u, speed * np.sin(beta), r, vessel) / u


def steady_drift(load: Array, speed: Array | float, vessel: Vessel) -> Array:
    """The drift angle of a steady turn, F(beta) = 0 with beta' = kappa' = 0, by bisection.

    `load`: m11·U·kappa, shape (n,), kg/s. `speed`: U, m/s, one or shape (n,). `vessel`: coefficients of (6). Returns drift
    angle, shape (n,), rad; STEEPEST at most where the damping is too small for a smaller one.
    """
    low, high = np.full(load.shape, -STEEPEST), np.full(load.shape, STEEPEST)
    for _ in range(60):
        middle = 0.5 * (low + high)
        # A steady turn has the yaw rate U·kappa.
        above = load + damping_ratio(middle, speed, load / vessel.m11, vessel) > 0.0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.where(load == 0.0, 0.0, 0.5 * (low + high))


class Velocities(NamedTuple):
    """Body velocities and their time derivatives, numbers or arrays; m/s, m/s, rad/s and per second."""

    u: Any
    v: Any
    r: Any
    du: Any
    dv: Any
    dr: Any


@kernel
def hull_velocities(W: Any, dW: Any, bend: tuple[Any, Any], direction: tuple[Any, Any], dbeta: Any, ddbeta: Any) -> Velocities:
    """The body velocities of a hull along a plane curve, and their derivatives; numbers or arrays.

    `W`, `dW`: speed along the curve and its rate, m/s and m/s². `bend`: curvature [1/m] and its slope [1/m²]. `direction`:
    cosine and sine of the drift angle. `dbeta`, `ddbeta`: its time derivatives, rad/s and rad/s².
    """
    (kappa, kappa_slope), (c, sine) = bend, direction
    return Velocities(
        W * c,
        W * sine,
        W * kappa - dbeta,
        dW * c - W * sine * dbeta,
        dW * sine + W * c * dbeta,
        W * W * kappa_slope + dW * kappa - ddbeta,
    )


def inverse_dynamics(motion: Velocities, vessel: Vessel) -> tuple[Any, Any]:
    """Surge force tau_1 [N] and yaw moment tau_2 [N·m] of motions, numbers or arrays."""
    f_u, f_v, f_r = unforced_acceleration(motion.u, motion.v, motion.r, vessel)  # element by element
    surge_force = vessel.m11 * (motion.du - f_u)
    return surge_force, vessel.m33 * (motion.dr - f_r) + vessel.m32 * (motion.dv - f_v)

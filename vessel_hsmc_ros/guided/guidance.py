"""Guidance: from the position error to heading, yaw-rate and surge-speed commands that a ship without sway thrust can follow.

| symbol | meaning | unit |
|---|---|---|
| e = p - p_d | position error, east and north | m |
| g | error feedback: k_p·e/sqrt(1 + (k_p·|e|/v_max)²) + xi | m/s |
| xi | integral of e, which removes the steady-state error | m/s |
| w = dp_d - g | velocity command; dw its derivative, W its magnitude | m/s, m/s² |
| w_t, w_n | w along and across the hull | m/s |
| s | direction of travel: 1 ahead, -1 astern | - |
| q = c·rho | speed below which the station-keeping mode takes over | m/s |
| m = w_n - v | sway mismatch: commanded minus actual sway velocity; it lengthens the lever arm up to m_max | m/s |
| U_s | slowest reference that determines the direction of travel | m/s |
| U_xi | speed of the reference above which xi is integrated | m/s |
| epsilon | heading error: turned by it, the hull has w_n equal to its sway velocity | rad |
| psi_c | commanded heading psi + epsilon | rad |
| r_w | rate of psi_c while the ship has the velocity w | rad/s |
| a | yaw acceleration that turns are planned with | rad/s² |
| b, w_b | gain on the rate of epsilon, and its bandwidth | -, rad/s |
| epsilon_s | slow part of epsilon | rad |

Sway is not actuated, so the ship is turned until the component of w across the hull equals its sway velocity; then the surge
force alone gives it the velocity w, and e decays. In station keeping this is equivalent to controlling the position of a point
rho ahead of midships.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import TURN, Acceleration, Motion, magnitude
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.current_estimate import Current
from vessel_hsmc_ros.guided.parameters import Gains

LARGEST_LEAD = 0.2
"""Largest epsilon - epsilon_s, rad: a ship that turns round is not damped by more."""

Vector = tuple[float, float]
"""A horizontal vector, east and north."""


class VelocityCommand(NamedTuple):
    """w and dw, east and north, with the squares of the two speeds that it is made of, |g| and |dp_d|."""

    wx: float
    wy: float
    dwx: float
    dwy: float
    feedback_squared: float
    reference_squared: float


class BodyCommand(NamedTuple):
    """w and dw resolved along (t) and across (n) the hull, m/s and m/s²."""

    w_t: float
    w_n: float
    dw_t: float
    dw_n: float


@kernel
def velocity_command(motion: Motion, desired: Motion, acceleration: Acceleration, xi: Vector, g: Gains) -> VelocityCommand:
    """Velocity command w = dp_d - g and its derivative with xi constant.

    The feedback is linear, k_p·e, near the reference and saturates at the speed v_max far from it.

    Args:
        motion: State of the ship.
        desired: State of the reference.
        acceleration: Derivatives of the reference's body velocities.
        xi: Integral state, m/s.
        g: Gains.

    Returns:
        w and dw in the earth-fixed frame, with |g|² and |dp_d|².
    """
    x_d, y_d, psi_d, u_d, v_d, r_d = desired
    c, s = math.cos(psi_d), math.sin(psi_d)
    dx_d, dy_d = u_d * c - v_d * s, u_d * s + v_d * c
    # Acceleration over ground in the reference's body frame: the body-frame rates plus those of the rotating axes.
    along, across = acceleration.du - v_d * r_d, acceleration.dv + u_d * r_d
    c_psi, s_psi = math.cos(motion.psi), math.sin(motion.psi)
    ex, ey = motion.x - x_d, motion.y - y_d
    dex = motion.u * c_psi - motion.v * s_psi - dx_d
    dey = motion.u * s_psi + motion.v * c_psi - dy_d

    # With n = 1 + (slope·|e|)² the feedback is k_p·e/sqrt(n); its derivative is k_p/sqrt(n)·(de - slope²·(e·de)/n·e).
    slope = g.k_p / g.v_max
    stretch = 1.0 + slope * slope * (ex * ex + ey * ey)
    gain = g.k_p / math.sqrt(stretch)
    bend = slope * slope * (ex * dex + ey * dey) / stretch
    gx, gy = gain * ex + xi[0], gain * ey + xi[1]
    return VelocityCommand(
        dx_d - gx,
        dy_d - gy,
        along * c - across * s - gain * (dex - bend * ex),
        along * s + across * c - gain * (dey - bend * ey),
        gx * gx + gy * gy,
        dx_d * dx_d + dy_d * dy_d,
    )


@kernel
def resolve(command: VelocityCommand, current: Current, psi: float) -> BodyCommand:
    """The velocity command relative to the current, and its derivative, along and across a hull of heading psi."""
    c, s = math.cos(psi), math.sin(psi)
    wx, wy, dwx, dwy, _, _ = command
    wx, wy = wx - current.east, wy - current.north
    return BodyCommand(wx * c + wy * s, -wx * s + wy * c, dwx * c + dwy * s, -dwx * s + dwy * c)


@kernel
def direction_of_travel(
    s: float, w_t: float, distance: float, u_d: float, feedback_squared: float, lever: float, g: Gains
) -> float:
    """The direction of travel s, ahead or astern.

    It is that of the reference while the reference's speed dominates w. Otherwise it changes with hysteresis: only when w points
    in the other direction by more than q.

    Args:
        s: Direction in the last period, 1 or -1.
        w_t: Velocity command along the hull, m/s.
        distance: |e|, m; beyond R_b the ship does not go astern.
        u_d: Surge velocity of the reference, m/s.
        feedback_squared: |g|², m²/s².
        lever: Lever arm rho of station keeping, m.
        g: Gains.

    Returns:
        1 for ahead, -1 for astern.
    """
    # A moving reference decides, because w is then close to its velocity; the error feedback alone must not reverse the ship.
    if u_d * u_d > max(feedback_squared, g.U_s * g.U_s):
        return 1.0 if u_d > 0.0 else -1.0
    if s * w_t >= -g.c * lever:
        return s
    # Beyond R_b a turn is cheaper than going astern, so the ship goes ahead.
    return -1.0 if s > 0.0 and distance < g.R_b else 1.0


@kernel
def heading_error(w: BodyCommand, v: float, s: float, lever: float, g: Gains) -> float:
    """The heading error epsilon = s·atan2(m, D) with m = w_n - v, in [-pi, pi].

    D is s·w_t, kept away from zero: sqrt((s·w_t)² + q_m²) ahead, s·w_t + q_m astern, with q_m² = q² + (c·T_m·min(|m|, m_max))².
    In station keeping and for a small m, epsilon is m/q, which turns the ship at m/rho: a point rho ahead of midships then moves
    across the hull at w_n. The lever arm grows with m, because in a strong current a short one demands a faster turn than the
    ship can follow.

    Args:
        w: Velocity command along and across the hull.
        v: Sway velocity, m/s.
        s: Direction of travel.
        lever: Lever arm rho of station keeping, m.
        g: Gains.

    Returns:
        epsilon, rad: the angle by which the hull should turn, positive counter-clockwise.
    """
    m = w.w_n - v
    D = s * w.w_t
    # Without q_m the heading error would be undefined, and its gain unbounded, as w tends to zero.
    q_m = g.c * magnitude(lever, g.T_m * min(abs(m), g.m_max))
    return s * math.atan2(m, math.sqrt(D * D + q_m * q_m) if D >= 0.0 else D + q_m)


@kernel
def course_rate(w: BodyCommand, v: float, dv: float, r_d: float, s: float, lever: float, g: Gains) -> float:
    """Feedforward yaw rate r_w, the derivative of atan2(w) - s·asin(v/W), which tends to r_d as W tends to zero.

    r_w = (w_t·dw_n - w_n·dw_t)/W² - s·(dv - v·(w·dw)/W²)·B/(B² + E²) with B² = max(W² - v², 0), E² = max(v² - W², 0), and q²
    added to every square in a denominator. Where a current carries the ship abeam faster than W, no heading has the sway
    velocity v, and the commanded one hardly depends on it: without E the noise of v would decide the turn.

    Args:
        w: Velocity command and its derivative.
        v, dv: Sway velocity and its derivative, m/s, m/s².
        r_d: Yaw rate of the reference, rad/s.
        s: Direction of travel.
        lever: Lever arm rho of station keeping, m.
        g: Gains.

    Returns:
        r_w, rad/s.
    """
    # q, the speed at which station keeping takes over, keeps every quotient finite as w tends to zero.
    q = g.c * lever
    q2 = q * q
    square = w.w_t * w.w_t + w.w_n * w.w_n
    W2 = square + q2
    # 1 for a moving ship, 0 at rest: blends the rate of the course with the yaw rate of the reference.
    moving = square / W2
    # W times the derivative of v/W; the crab angle is asin(v/W).
    crab_rate = dv - v * (w.w_t * w.dw_t + w.w_n * w.dw_n) / W2
    B = math.sqrt(max(square - v * v, 0.0) + q2)
    crab = crab_rate * B / (B * B + max(v * v - square, 0.0))
    return (w.w_t * w.dw_n - w.w_n * w.dw_t) / W2 - s * moving * crab + (1.0 - moving) * r_d


@kernel
def course_damping(epsilon: float, slow: float, reference_squared: float, g: Gains) -> tuple[float, float]:
    """A yaw rate against the rate by which the course comes to lag, b·w_b·(epsilon - epsilon_s)·U²/(U² + U_xi²).

    depsilon_s = w_b·(epsilon - epsilon_s), so that this is b·depsilon/dt up to the bandwidth w_b. It acts like 1 + b times the
    sway damping rate.

    Args:
        epsilon: Heading error.
        slow: epsilon_s.
        reference_squared: U², m²/s².
        g: Gains.

    Returns:
        The yaw rate, and epsilon_s one period later.
    """
    beyond = math.remainder(epsilon - slow, TURN)
    moving = reference_squared / (reference_squared + g.U_xi * g.U_xi)
    return g.b * g.w_b * moving * clip(beyond, LARGEST_LEAD), slow + g.step_b * beyond


@kernel
def approach_rate(epsilon: float, g: Gains) -> float:
    """The yaw-rate command for a heading error: c·epsilon when small, sqrt(2·a·|epsilon|) when large, at most r_max.

    The square root is the braking curve of a constant yaw acceleration: a ship that follows it never needs more than a to stop
    the turn at epsilon = 0.
    """
    # The positive root of rate²/(2·a) + rate/c = |epsilon|, which joins both limits smoothly.
    rate = g.a_max / g.c * (math.sqrt(1.0 + 2.0 * g.c * g.c * abs(epsilon) / g.a_max) - 1.0)
    return math.copysign(min(rate, g.r_max), epsilon)


@kernel
def integrate_error(xi: Vector, motion: Motion, desired: Motion, reference_squared: float, g: Gains) -> Vector:
    """The integral state xi one period later, by an Euler step of dxi = k_i·e; its magnitude is limited to xi_max.

    Anti-windup: it is held constant while the feedback is saturated, |e| >= v_max/k_p.

    Args:
        xi: Integral state, m/s.
        motion, desired: States of the ship and of the reference.
        reference_squared: |dp_d|², m²/s². In station keeping xi is not integrated: the error decays without it.
        g: Gains.

    Returns:
        xi after one control period, m/s.
    """
    ex, ey = motion.x - desired.x, motion.y - desired.y
    slope = g.k_p / g.v_max
    if slope * slope * (ex * ex + ey * ey) >= 1.0:
        return xi
    # A smooth switch at the speed U_xi of the reference.
    step = g.T * g.k_i * reference_squared / (reference_squared + g.U_xi * g.U_xi)
    x, y = xi[0] + step * ex, xi[1] + step * ey
    shrink = min(1.0, g.xi_max / max(magnitude(x, y), 1e-9))
    return shrink * x, shrink * y


@kernel
def filtered_rate(rate: float, integral: float, goal: float, largest: float, g: Gains) -> tuple[float, float]:
    """The command filter of the yaw rate.

    drho_c = zeta + lambda_c·(r_goal - rho_c), dzeta = kappa·lambda_c²·(r_goal - rho_c). The yaw acceleration drho_c is limited,
    and the integral is held constant meanwhile (conditional integration).

    Args:
        rate, integral: rho_c and zeta.
        goal: r_goal.
        largest: Limit of the yaw acceleration.
        g: Gains.

    Returns:
        drho_c, and zeta one period later.
    """
    error = clip(goal, 2.0 * g.r_max) - rate
    demand = integral + g.step_c * error
    drate = clip(demand, largest)
    if drate == demand:
        integral += g.kappa * g.lambda_c * g.step_c * g.T * error
    return drate, integral

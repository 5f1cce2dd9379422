"""Guidance: from the position error to a heading, a yaw rate and a surge velocity that a ship without sway thrust can have.

| symbol | meaning | unit |
|---|---|---|
| e = p - p_d | position error, east and north | m |
| g | velocity at which e is to fade: k_p·e/sqrt(1 + (k_p·|e|/v_max)²) + xi | m/s |
| xi | integral of e, which takes away what is left of it | m/s |
| w = dp_d - g | wanted velocity; dw its derivative, W its length | m/s, m/s² |
| w_t, w_n | w along and across the hull | m/s |
| s | direction of travel: 1 ahead, -1 astern | - |
| q = c·rho | speed below which the ship is steered as a resting one | m/s |
| m = w_n - v | by how much the sway does not match | m/s |
| epsilon | heading by which the hull is off: turned by it, w_n is the sway that the ship has | rad |
| psi_c | commanded heading psi + epsilon | rad |
| r_w | rate of psi_c while the ship has the velocity w | rad/s |
| a | yaw acceleration that turns are planned with | rad/s² |

Sway cannot be commanded, so the ship is turned until the part of w across the hull is the sway it has; then surge alone makes
its velocity w, and e fades. At rest this is the same as holding a point rho ahead of midships.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.laws.guided_parameters import Gains
from vessel_hsmc_ros.laws.predictor import Motion

Pair = tuple[float, float]

LARGEST_MISMATCH = 0.3
"""The lever of a resting ship grows with the mismatch of its sway up to this one, m_max, m/s."""


class Wanted(NamedTuple):
    """w and dw, east and north, and the squares of |w - dp_d| and of |dp_d|."""

    wx: float
    wy: float
    dwx: float
    dwy: float
    fading: float
    carried: float


class Across(NamedTuple):
    """w and dw along (t) and across (n) the hull."""

    w_t: float
    w_n: float
    dw_t: float
    dw_n: float


def clip(value: float, limit: float) -> float:
    """The value, at most `limit` either way."""
    return min(max(value, -limit), limit)


def wanted_velocity(motion: Motion, desired: Motion, acceleration: list[float], xi: Pair, g: Gains) -> Wanted:
    """Wanted velocity and its derivative, xi held.

    Args:
        motion: The ship.
        desired: The reference.
        acceleration: du_d, dv_d, dr_d.
        xi: East and north, m/s.
        g: Gains.
    """
    x_d, y_d, psi_d, u_d, v_d, r_d = desired
    c, s = math.cos(psi_d), math.sin(psi_d)
    dx_d, dy_d = u_d * c - v_d * s, u_d * s + v_d * c
    along, across = acceleration[0] - v_d * r_d, acceleration[1] + u_d * r_d
    c_psi, s_psi = math.cos(motion.psi), math.sin(motion.psi)
    ex, ey = motion.x - x_d, motion.y - y_d
    dex = motion.u * c_psi - motion.v * s_psi - dx_d
    dey = motion.u * s_psi + motion.v * c_psi - dy_d

    slope = g.k_p / g.v_max
    stretch = 1.0 + slope * slope * (ex * ex + ey * ey)
    gain = g.k_p / math.sqrt(stretch)
    bend = slope * slope * (ex * dex + ey * dey) / stretch
    gx, gy = gain * ex + xi[0], gain * ey + xi[1]
    return Wanted(
        dx_d - gx,
        dy_d - gy,
        along * c - across * s - gain * (dex - bend * ex),
        along * s + across * c - gain * (dey - bend * ey),
        gx * gx + gy * gy,
        dx_d * dx_d + dy_d * dy_d,
    )


def resolve(wanted: Wanted, psi: float) -> Across:
    """Wanted velocity and its derivative seen from the hull."""
    c, s = math.cos(psi), math.sin(psi)
    wx, wy, dwx, dwy, _, _ = wanted
    return Across(wx * c + wy * s, -wx * s + wy * c, dwx * c + dwy * s, -dwx * s + dwy * c)


def direction_of_travel(s: float, w_t: float, distance: float, u_d: float, fading: float, g: Gains) -> float:
    """The way the reference goes, while that is the larger part of w; else as before, until w points well the other way.

    Args:
        s: Direction so far.
        w_t: Wanted velocity along the hull, m/s.
        distance: |e|, m; beyond R_b the ship does not go astern.
        u_d: Surge velocity of the reference, m/s.
        fading: |g|², m²/s².
        g: Gains.
    """
    if u_d * u_d > max(fading, 0.04):
        return 1.0 if u_d > 0.0 else -1.0
    if s * w_t >= -g.c * g.rho:
        return s
    return -1.0 if s > 0.0 and distance < g.R_b else 1.0


def heading_error(w: Across, v: float, s: float, g: Gains) -> float:
    """The heading error epsilon = s·atan2(m, D) with m = w_n - v, in [-pi, pi].

    D is s·w_t, kept from zero: sqrt((s·w_t)² + q_m²) ahead, s·w_t + q_m astern, with q_m² = q² + (c·T_m·min(|m|, m_max))². At
    rest and for a small m, epsilon is m/q, which turns the ship at m/rho: a point rho ahead of midships then moves across the
    hull at w_n. The lever grows with m, for in a strong current a short one turns the ship faster than it can follow.
    """
    m = w.w_n - v
    D = s * w.w_t
    q_m = g.c * math.hypot(g.rho, g.T_m * min(abs(m), LARGEST_MISMATCH))
    return s * math.atan2(m, math.sqrt(D * D + q_m * q_m) if D >= 0.0 else D + q_m)


def carried_rate(w: Across, v: float, dv: float, r_d: float, s: float, g: Gains) -> float:
    """r_w, the derivative of atan2(w) - s·asin(v/W), which fades to r_d at rest.

    r_w = (w_t·dw_n - w_n·dw_t)/W² - s·(dv - v·(w·dw)/W²)/sqrt(W² - v²), every square in a denominator with q² added.

    Args:
        w: Wanted velocity and its derivative.
        v, dv: Sway velocity and its derivative.
        r_d: Yaw rate of the reference.
        s: Direction of travel.
        g: Gains.
    """
    q2 = (g.c * g.rho) ** 2
    square = w.w_t * w.w_t + w.w_n * w.w_n
    W2 = square + q2
    moving = square / W2
    swing = dv - v * (w.w_t * w.dw_t + w.w_n * w.dw_n) / W2
    hull = math.sqrt(max(square - v * v, 0.0) + q2)
    return (w.w_t * w.dw_n - w.w_n * w.dw_t) / W2 - s * moving * swing / hull + (1.0 - moving) * r_d


def approach_rate(epsilon: float, g: Gains) -> float:
    """The yaw rate at which a heading error is to fade: c·epsilon when small, sqrt(2·a·|epsilon|) when large, at most r_max.

    A ship that follows it never needs more yaw acceleration than a to stop in time.
    """
    rate = g.a_max / g.c * (math.sqrt(1.0 + 2.0 * g.c * g.c * abs(epsilon) / g.a_max) - 1.0)
    return math.copysign(min(rate, g.r_max), epsilon)


def rest(square: float, v: float, f_u: float, f_v: float, g: Gains) -> float:
    """How much the ship rests undisturbed, from 0 to 1.

    Args:
        square: W², m²/s².
        v: Sway velocity.
        f_u, f_v: Estimated accelerations; at rest, those of the disturbance.
        g: Gains.
    """
    return 1.0 / (1.0 + (square + v * v) / (g.v_0 * g.v_0) + (f_u * f_u + f_v * f_v) / (g.a_0 * g.a_0))


def drift(xi: Pair, motion: Motion, desired: Motion, carried: float, g: Gains) -> Pair:
    """The integral xi a period later: it grows near a moving reference and is held to xi_max.

    Args:
        xi: East and north, m/s.
        motion, desired: Ship and reference.
        carried: |dp_d|², m²/s²; a resting reference has no use for xi, its error fades without.
        g: Gains.
    """
    ex, ey = motion.x - desired.x, motion.y - desired.y
    slope = g.k_p / g.v_max
    if slope * slope * (ex * ex + ey * ey) >= 1.0:
        return xi
    step = g.T * g.k_i * carried / (carried + 0.01)
    x, y = xi[0] + step * ex, xi[1] + step * ey
    shrink = min(1.0, g.xi_max / max(math.hypot(x, y), 1e-9))
    return shrink * x, shrink * y

"""Station keeping of a ship whose yaw moment turns it about a pivot ahead of the origin, and the decay of a spin.

| symbol | meaning | unit |
|---|---|---|
| x_p | distance of the pivot ahead of the origin | m |
| x | distance of the pivot ahead of the controlled point, which is the origin at rest | m |
| v_p | sway velocity of the pivot, v + x_p·r, which the yaw moment does not accelerate | m/s |
| rho, rho_l | lever arm of station keeping, and in a current: the held point is that far ahead, or here behind the origin | m |
| c | current | m/s |
| w_n | velocity command across the hull | m/s |
| W | magnitude of the velocity command | m/s |
| W_0 | the same at which station keeping takes over from the approach | m/s |
| U_d | speed of the reference | m/s |

A moment that turns the ship to port moves the origin to starboard, x_p times as fast: the origin is held by turning to the side
to which the ship moves. A hull-fixed sway force F_v is then balanced by the damping of the turn, at r = F_v/(d_yr + d_v·rho),
and an earth-fixed force turns the stern to it. docs/guided.md derives both.
"""

from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import TURN
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.parameters import Gains

TURNS, PROGRESS, SLOWEST_SPIN = 3.0, 0.7, 0.1
"""Turns without progress after which a ship at rest turns more slowly; the share of its smallest error that counts as progress;
and the smallest share of its yaw rate."""


class Spin(NamedTuple):
    """Angle turned since the position error last fell, rad, and the error then, m."""

    angle: float = 0.0
    least: float = 1e12


NO_SPIN = Spin()
"""A ship that has not turned yet."""


@kernel
def pivot_ahead(reference_squared: float, g: Gains) -> float:
    """Distance x of the pivot ahead of the controlled point, x_p/(1 + (U_d/U_s)⁴): under way the pivot itself is controlled.

    Args:
        reference_squared: U_d², m²/s².
        g: Gains.
    """
    ratio = reference_squared / (g.U_s * g.U_s)
    return g.x_p / (1.0 + ratio * ratio)


@kernel
def lever_arm(current_at_rest: float, reference_squared: float, g: Gains) -> float:
    """The lever arm of station keeping: rho, and up to rho_l in a current.

    A ship at rest in a current c moves ahead through the water. Turned, it is first carried to the other side by -m11·u·r, which
    a point less than about (m11/d_v)·c ahead of the hull does not outweigh: it would oscillate about the current. A force that
    turns with the hull, on the other hand, moves the ship in proportion to the lever arm. The mean of c distinguishes the two.

    Args:
        current_at_rest: How credible the mean of c is, from 0 to 1.
        reference_squared: U_d², m²/s².
        g: Gains.
    """
    resting = g.U_xi * g.U_xi / (reference_squared + g.U_xi * g.U_xi)
    return g.rho + (max(g.rho_l, g.rho) - g.rho) * current_at_rest * resting


@kernel
def pivoting_rate(w_n: float, v_p: float, x: float, lever: float, g: Gains) -> float:
    """The yaw rate (v_p - w_n)/(x + lever), at which the point a lever arm behind the origin moves across the hull at w_n.

    Args:
        w_n: Velocity command across the hull, m/s.
        v_p: Sway velocity of the pivot, m/s.
        x: Distance of the pivot ahead of the controlled point, m.
        lever: Lever arm, m.
        g: Gains.
    """
    return clip((v_p - w_n) / (x + lever), g.r_rest)


@kernel
def keeps_station(keeping: bool, square: float, reference_squared: float, g: Gains) -> bool:
    """Whether the ship keeps station: W²/W_0² + U_d²/U_s² below 1/2, or below 2 if it did so in the last period.

    Approach and station keeping turn the ship to opposite sides, bow and stern first: a mixture would leave it on the beam.

    Args:
        keeping: Whether it did.
        square: W², m²/s².
        reference_squared: U_d², m²/s².
        g: Gains.
    """
    return square / (g.W_0 * g.W_0) + reference_squared / (g.U_s * g.U_s) < (2.0 if keeping else 0.5)


@kernel
def spin_damping(v_p: float, r: float, g: Gains) -> float:
    """Surge speed k_s·v_p·r/(r² + (k_p/4)²) that takes energy out of a spin.

    A hull that spins with the sway velocity v circles at the radius v/r, and the surge speed k_p·v/r that would pull it in feeds
    v by the Coriolis force m11·u·r: it spirals out where m11/m22·k_p exceeds the decay rate of the sway.

    Args:
        v_p: Sway velocity of the pivot, m/s.
        r: Yaw rate, rad/s.
        g: Gains.
    """
    return g.k_s * v_p * r / (r * r + 0.0625 * g.k_p * g.k_p)


@kernel
def count_turns(spin: Spin, distance: float, r: float, resting: bool, g: Gains) -> Spin:
    """The turns without progress one period later: none where the error falls, is small, or the reference moves.

    Args:
        spin: The turns so far.
        distance: Position error |e|, m.
        r: Yaw rate, rad/s.
        resting: Whether the reference is at rest.
        g: Gains.
    """
    if not resting or distance < max(PROGRESS * spin.least, g.e_spin):
        return Spin(0.0, distance)
    return Spin(spin.angle + g.T * abs(r), spin.least)


@kernel
def patience(spin: Spin) -> float:
    """The factor min(1, 2·pi·TURNS/angle), at least SLOWEST_SPIN, on the yaw-rate command of a ship that turns without progress.

    A faster turn than the sway can follow may go on for ever, at the full moment. A slower one ends it: the sway follows.
    """
    return max(SLOWEST_SPIN, min(1.0, TURN * TURNS / max(spin.angle, 1e-9)))


@kernel
def patient(rate: float, spin: Spin, g: Gains) -> float:
    """A yaw-rate command, limited by the patience with turns that bring the ship no closer."""
    return clip(rate, patience(spin) * max(2.0 * g.r_max, g.r_rest)) if spin.angle > 0.0 else rate


@kernel
def undisturbed_share(square: float, v: float, f_u: float, f_v: float, g: Gains) -> float:
    """Weight, from 0 to 1, of the reference's heading: 1 for an undisturbed ship at rest.

    It is 1/(1 + (W² + v²)/v_0² + (f_u² + f_v²)/a_0²). Only then may the reference's heading be taken: under a disturbance an
    underactuated ship must point against it to keep its position.

    Args:
        square: W², m²/s².
        v: Sway velocity, m/s.
        f_u, f_v: Estimated accelerations, m/s²; at rest they are those of the disturbance.
        g: Gains.

    Returns:
        The weight, in (0, 1].
    """
    return 1.0 / (1.0 + (square + v * v) / (g.v_0 * g.v_0) + (f_u * f_u + f_v * f_v) / (g.a_0 * g.a_0))

"""The drift of the water, learnt from the sway velocity of the ship while it turns.

| symbol | meaning | unit |
|---|---|---|
| c | drift, east and north: the current, and what the wind moves the ship by | m/s |
| c_h, c_n | the same ahead and to port | m/s |
| theta | sway velocity through the water per unit of phi, -m11/d_v | s |
| phi | (u - c_h)·r + (m22/m11)·dv, dv being the sway acceleration through the water | m/s² |
| e | v - c_n - theta·phi, what drift and turn leave unexplained | m/s |
| mu, mu_t | gains of the adaptation per radian of turn | - |
| c_0 | drift of which half is used, see `credible` | m/s |
| U, W | speed of the reference over ground and through the water, |dp_d| and |dp_d - c| | m/s |
| chi_c | course of the reference through the water minus that over ground | rad |

In a turn at the yaw rate r an earth-fixed drift changes c_n by -r·c_h. That is kinematics: a law that knows c need not wait for
the measured sway velocity. m22·dv = -m11·u·r - d_v·v gives v = c_n + theta·phi, whose unknowns are learnt with the angle of turn
in place of time: dc/d|psi| = mu·e to port, dtheta/d|psi| = mu_t·e/phi. A turn shows the drift from all sides. On a straight path,
where it cannot be separated from a force on the hull, nothing is learnt and nothing forgotten.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, magnitude
from vessel_hsmc_ros.core.limits import clip
from vessel_hsmc_ros.guided.parameters import Gains

MU, MU_T = 1.54, 0.19
"""Gains of the adaptation: they place three poles at 1/sqrt(3) per radian in a steady turn, so that an error decays within a
turn."""

ADDED = 1.4
"""m22/m11 of a ship; the sway follows u·r with the lag that it implies."""

SLOWEST = 0.025
"""Yaw rate below which theta adapts less, in terms of the largest innovation in yaw."""

SHARE = 0.7
"""Largest c that is used in terms of the speed of the reference, which therefore travels ahead through the water."""

STEADY = 0.4
"""The same for a hull whose own drift decays slowly: a faster turn through the water takes it to a larger drift angle."""

STEEPEST = 0.4
"""Surplus of surge over sway velocity, in terms of its speed, below which a reference allows less than STEADY."""

TURNS_WITH_SHIP, LASTS = 0.5, 0.8
"""Mean of the drift in terms of the mean of its magnitude, below which none is used at rest, and above which all is."""

FAR = 4.0
"""Distance from a reference at rest beyond which no drift is used, in terms of that where the feedback saturates."""

LASTING, PASSED = 0.05, 0.4
"""Share of c by which its mean follows it in a radian; PASSED where `sway_damping_rate` is declared. A c that turns with the ship
is no drift of the water."""


class Drift(NamedTuple):
    """The estimate: c towards the east and the north, and theta."""

    east: float
    north: float
    theta: float


class TurnInWater(NamedTuple):
    """The turn of the reference through the water, beyond that over ground: dchi_c, ddchi_c and the change of the sway rate."""

    rate: float
    acceleration: float
    dv: float


NO_DRIFT = Drift(0.0, 0.0, 0.0)
"""Still water, and a ship that no turn has shown yet."""


@kernel
def credible(drift: Drift, g: Gains) -> Drift:
    """The part c⁴/(c⁴ + c_0⁴) of the estimate that is used: until theta has converged, still water seems to drift a little."""
    square, doubt = drift.east * drift.east + drift.north * drift.north, g.c_doubt * g.c_doubt
    share = square * square / (square * square + doubt * doubt)
    return Drift(share * drift.east, share * drift.north, drift.theta)


@kernel
def in_body(drift: Drift, psi: float) -> tuple[float, float]:
    """The drift c_h and c_n, ahead of and to port of a hull of heading psi."""
    c, s = math.cos(psi), math.sin(psi)
    return drift.east * c + drift.north * s, -drift.east * s + drift.north * c


@kernel
def angle_to_learn_from(r: float, feedback_squared: float, reference_squared: float, near: bool, g: Gains) -> float:
    """The angle of turn of a period, and 0 where it shows nothing of the drift.

    Args:
        r: Yaw rate.
        feedback_squared: |g|² of the guidance, m²/s²; a ship far from the reference turns too hard to learn from.
        reference_squared: U², m²/s².
        near: Whether the ship keeps station.
        g: Gains.
    """
    if 2.0 * feedback_squared > g.v_max * g.v_max:
        return 0.0
    # Beside a slow reference a force on the hull makes the ship turn, and would look like a drift.
    moving = 1.0 if near else reference_squared / (reference_squared + g.U_xi * g.U_xi)
    return g.T * abs(clip(r, g.e_r_max)) * moving


@kernel
def mean(steady: tuple[float, float], east: float, north: float, share: float) -> tuple[float, float]:
    """The mean of the drift over the angle of turn, one period later.

    Args:
        steady: The mean.
        east, north: The estimate.
        share: Share of it that the period contributes.
    """
    return steady[0] + share * (east - steady[0]), steady[1] + share * (north - steady[1])


@kernel
def followed(drift: Drift, steady: tuple[float, float], size: float, motion: Motion, desired: Motion, g: Gains) -> Drift:
    """The part of the drift that the guidance reckons with: a ship at rest in a current is under way through the water.

    Args:
        drift: The estimate; a moving reference still travels ahead through the part of it that is used.
        steady: The mean of c, m/s: at rest only that is used, and only where it is credible and the ship near its reference.
        size: The mean of its magnitude, m/s.
        motion, desired: States of the ship and of the reference.
        g: Gains.
    """
    U = magnitude(desired.u, desired.v)
    most = SHARE * U
    if g.sway.a >= 0.0:
        # Where the reference drifts nearly as fast sideways as ahead, no heading gives a much faster turn through the water.
        most = STEADY * min(U, max(0.0, abs(desired.u) - abs(desired.v)) / STEEPEST)
    shrink = min(1.0, most / max(magnitude(drift.east, drift.north), 1e-9))
    # In units of the distance where the feedback saturates, beyond which nothing is learned either.
    distance = g.k_p / g.v_max * magnitude(motion.x - desired.x, motion.y - desired.y)
    near = max(0.0, 1.0 - distance * distance / (FAR * FAR))
    share = at_rest(U * U, g) * near * in_drift(steady, size, g)
    return Drift(shrink * drift.east + share * steady[0], shrink * drift.north + share * steady[1], drift.theta)


@kernel
def in_drift(steady: tuple[float, float], size: float, g: Gains) -> float:
    """How credible a drift is at rest: c⁴/(c⁴ + c_rest⁴) of its mean, and nothing where it turns with the ship.

    What turns with the hull is a force on it. The mean of such an estimate is small beside the mean of its magnitude.

    Args:
        steady: The mean of c over the angle of turn, m/s.
        size: The mean of its magnitude, m/s.
        g: Gains.
    """
    square, doubt = steady[0] * steady[0] + steady[1] * steady[1], g.c_rest * g.c_rest
    lasting = (math.sqrt(square) / max(size, 1e-9) - TURNS_WITH_SHIP) / (LASTS - TURNS_WITH_SHIP)
    return min(1.0, max(0.0, lasting)) * square * square / (square * square + doubt * doubt)


@kernel
def at_rest(reference_squared: float, g: Gains) -> float:
    """How nearly a reference is at rest over ground, 1 - U²/U_xi², and 0 for a faster one."""
    return max(0.0, 1.0 - reference_squared / (g.U_xi * g.U_xi))


@kernel
def speed_squared(used: Drift, reference_squared: float, g: Gains) -> float:
    """Square of the speed of the reference; that through the water, |c|², where it is at rest over ground.

    Args:
        used: The drift that the guidance reckons with.
        reference_squared: U², m²/s².
        g: Gains.
    """
    return reference_squared + at_rest(reference_squared, g) * (used.east * used.east + used.north * used.north)


@kernel
def learn_drift(drift: Drift, motion: Motion, v: float, f_v: float, turned: float, g: Gains) -> Drift:
    """The estimate of c and theta one period later.

    Args:
        drift: The estimate.
        motion: State of the ship.
        v: Its sway velocity, at the pivot.
        f_v: Sway acceleration of the pivot through the water.
        turned: Angle of turn of the period; 0 where it shows nothing.
        g: Gains.
    """
    c_h, c_n = in_body(drift, motion.psi)
    u, r = motion.u - c_h, clip(motion.r, g.e_r_max)
    phi = u * r + ADDED * clip(f_v, g.e_max)
    # An outlier must not dominate.
    e = clip(v - c_n - drift.theta * phi, g.e_max)
    k = MU * turned * e
    east, north = drift.east - k * math.sin(motion.psi), drift.north + k * math.cos(motion.psi)
    most = g.c_max
    shrink = min(1.0, most / max(magnitude(east, north), 1e-9))
    slowest = u * SLOWEST * g.e_r_max
    theta = drift.theta + MU_T * turned * e * phi / (phi * phi + slowest * slowest + 1e-9)
    return Drift(shrink * east, shrink * north, clip(theta, g.theta_max))


@kernel
def turn_in_water(drift: Drift, desired: Motion, dr: float, g: Gains) -> TurnInWater:
    """What the drift adds to the turn of the reference, and to the sway that the turn causes.

    With c_t and c_l along and to the left of the reference's velocity, U constant and N = (U·c_t - |c|²)/W²,
    dchi_c = r_d·N, ddchi_c = r_d²·U·c_l·(U² - |c|²)/W⁴ + dr_d·N, and dv = theta·d(W·(r_d + dchi_c) - U·r_d).

    Args:
        drift: The estimate.
        desired: State of the reference.
        dr: Its yaw acceleration.
        g: Gains.
    """
    along, left = in_body(drift, desired.psi + math.atan2(desired.v, desired.u))
    r, U = desired.r, magnitude(desired.u, desired.v)
    square = along * along + left * left
    # The resting speed keeps the quotients finite for a reference at rest, which has no drift.
    W2 = U * U - 2.0 * U * along + square + g.v_0 * g.v_0
    W, N = math.sqrt(W2), (U * along - square) / W2
    rate = r * N
    acceleration = r * r * U * left * (U * U - square) / (W2 * W2) + dr * N
    changed = W * (dr + acceleration) - U * dr - U * r * left / W * (r + rate)
    return TurnInWater(rate, acceleration, (drift.theta if desired.u >= 0.0 else -drift.theta) * changed)

"""The current, learnt from the sway velocity of the ship while it turns.

| symbol | meaning | unit |
|---|---|---|
| c | current, east and north, and what the wind moves the ship by | m/s |
| c_h, c_n | the same ahead and to port | m/s |
| theta | sway velocity through the water per unit of phi, -m11/d_v | s |
| phi | (u - c_h)·r + (m22/m11)·dv, dv being the sway acceleration through the water | m/s² |
| e | v - c_n - theta·phi, what current and turn leave unexplained | m/s |
| mu, mu_t | gains of the adaptation per radian of turn | - |
| c_0 | current of which half is used, see `credible_part` | m/s |
| U, W | speed of the reference over ground and through the water, |dp_d| and |dp_d - c| | m/s |
| chi_c | course of the reference through the water minus that over ground | rad |

In a turn at the yaw rate r an earth-fixed current changes c_n by -r·c_h. That is kinematics: a law that knows c need not wait
for the measured sway velocity. m22·dv = -m11·u·r - d_v·v gives v = c_n + theta·phi, whose unknowns are learnt with the angle of
turn in place of time: dc/d|psi| = mu·e to port, dtheta/d|psi| = mu_t·e/phi. A turn shows the current from all sides. On a
straight path, where it cannot be separated from a force on the hull, nothing is learnt and nothing forgotten.
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

SWAY_MASS_RATIO = 1.4
"""m22/m11 of a ship; the sway follows u·r with the lag that it implies."""

MIN_YAW_RATE = 0.025
"""Yaw rate below which theta adapts less, in terms of the largest innovation in yaw."""

MAX_CURRENT = 0.7
"""Largest c that is used in terms of the speed of the reference, which therefore travels ahead through the water."""

MAX_CURRENT_LOW_DAMPING = 0.4
"""The same for a hull with low sway damping: a faster turn through the water takes it to a larger drift angle."""

SURPLUS = 0.4
"""Surplus of surge over sway velocity, in terms of its speed, below which a reference allows less of the current."""

TURNS_WITH_SHIP, LASTING = 0.5, 0.8
"""Mean of the current in terms of the mean of its magnitude, below which none is used at rest, and above which all is."""

MAX_DISTANCE = 4.0
"""Distance from a reference at rest beyond which no current is used, in terms of that where the feedback saturates."""

MEAN_SHARE, MODEL_MEAN_SHARE = 0.05, 0.4
"""Share of c by which its mean follows it in a radian; MODEL_MEAN_SHARE where `sway_damping_rate` is declared. A c that
turns with the ship is no current."""


class Current(NamedTuple):
    """The estimate: c towards the east and the north, and theta."""

    east: float
    north: float
    theta: float


class TurnInWater(NamedTuple):
    """The turn of the reference through the water, beyond that over ground: dchi_c, ddchi_c and the change of the sway rate."""

    rate: float
    acceleration: float
    dv: float


STILL_WATER = Current(0.0, 0.0, 0.0)
"""Still water, and a ship that no turn has shown yet."""


@kernel
def credible_part(current: Current, g: Gains) -> Current:
    """The part c⁴/(c⁴ + c_0⁴) of the estimate that is used: until theta has converged, still water seems to move a little."""
    square, doubt = current.east * current.east + current.north * current.north, g.c_doubt * g.c_doubt
    share = square * square / (square * square + doubt * doubt)
    return Current(share * current.east, share * current.north, current.theta)


@kernel
def in_body(current: Current, psi: float) -> tuple[float, float]:
    """The current c_h and c_n, ahead of and to port of a hull of heading psi."""
    c, s = math.cos(psi), math.sin(psi)
    return current.east * c + current.north * s, -current.east * s + current.north * c


@kernel
def informative_angle(r: float, feedback_squared: float, reference_squared: float, keeping: bool, g: Gains) -> float:
    """The angle of turn of a period, and 0 where it shows nothing of the current.

    Args:
        r: Yaw rate.
        feedback_squared: |g|² of the guidance, m²/s²; a ship far from the reference turns too hard to learn from.
        reference_squared: U², m²/s².
        keeping: Whether the ship keeps station.
        g: Gains.
    """
    if 2.0 * feedback_squared > g.v_max * g.v_max:
        return 0.0
    # Beside a slow reference a force on the hull makes the ship turn, and would look like a current.
    moving = 1.0 if keeping else reference_squared / (reference_squared + g.U_xi * g.U_xi)
    return g.T * abs(clip(r, g.e_r_max)) * moving


@kernel
def mean(mean_current: tuple[float, float], east: float, north: float, share: float) -> tuple[float, float]:
    """The mean of the current over the angle of turn, one period later.

    Args:
        mean_current: The mean.
        east, north: The estimate.
        share: Share of it that the period contributes.
    """
    return mean_current[0] + share * (east - mean_current[0]), mean_current[1] + share * (north - mean_current[1])


@kernel
def guiding_current(
    current: Current, mean_current: tuple[float, float], mean_magnitude: float, motion: Motion, desired: Motion, g: Gains
) -> Current:
    """The part of the current that the guidance reckons with: a ship at rest in a current is under way through the water.

    Args:
        current: The estimate; a moving reference still travels ahead through the part of it that is used.
        mean_current: The mean of c, m/s. At rest only that is used, where it is credible and the ship near its reference.
        mean_magnitude: The mean of its magnitude, m/s.
        motion, desired: States of the ship and of the reference.
        g: Gains.
    """
    U = magnitude(desired.u, desired.v)
    most = MAX_CURRENT * U
    if g.sway.a >= 0.0:
        # Where the reference moves nearly as fast sideways as ahead, no heading gives a much faster turn through the water.
        most = MAX_CURRENT_LOW_DAMPING * min(U, max(0.0, abs(desired.u) - abs(desired.v)) / SURPLUS)
    shrink = min(1.0, most / max(magnitude(current.east, current.north), 1e-9))
    # In units of the distance where the feedback saturates, beyond which nothing is learned either.
    distance = g.k_p / g.v_max * magnitude(motion.x - desired.x, motion.y - desired.y)
    near = max(0.0, 1.0 - distance * distance / (MAX_DISTANCE * MAX_DISTANCE))
    share = at_rest(U * U, g) * near * current_at_rest(mean_current, mean_magnitude, g)
    return Current(
        shrink * current.east + share * mean_current[0], shrink * current.north + share * mean_current[1], current.theta
    )


@kernel
def current_at_rest(mean_current: tuple[float, float], mean_magnitude: float, g: Gains) -> float:
    """How credible a current is at rest: c⁴/(c⁴ + c_rest⁴) of its mean, and nothing where it turns with the ship.

    What turns with the hull is a force on it. The mean of such an estimate is small beside the mean of its magnitude.

    Args:
        mean_current: The mean of c over the angle of turn, m/s.
        mean_magnitude: The mean of its magnitude, m/s.
        g: Gains.
    """
    square, doubt = mean_current[0] * mean_current[0] + mean_current[1] * mean_current[1], g.c_rest * g.c_rest
    lasting = (math.sqrt(square) / max(mean_magnitude, 1e-9) - TURNS_WITH_SHIP) / (LASTING - TURNS_WITH_SHIP)
    return min(1.0, max(0.0, lasting)) * square * square / (square * square + doubt * doubt)


@kernel
def at_rest(reference_squared: float, g: Gains) -> float:
    """How nearly a reference is at rest over ground, 1 - U²/U_xi², and 0 for a faster one."""
    return max(0.0, 1.0 - reference_squared / (g.U_xi * g.U_xi))


@kernel
def speed_squared(guiding: Current, reference_squared: float, g: Gains) -> float:
    """Square of the speed of the reference; that through the water, |c|², where it is at rest over ground.

    Args:
        guiding: The current that the guidance reckons with.
        reference_squared: U², m²/s².
        g: Gains.
    """
    return reference_squared + at_rest(reference_squared, g) * (guiding.east * guiding.east + guiding.north * guiding.north)


@kernel
def learn_current(current: Current, motion: Motion, v: float, f_v: float, turned: float, g: Gains) -> Current:
    """The estimate of c and theta one period later.

    Args:
        current: The estimate.
        motion: State of the ship.
        v: Its sway velocity, at the pivot.
        f_v: Sway acceleration of the pivot through the water.
        turned: Angle of turn of the period; 0 where it shows nothing.
        g: Gains.
    """
    c_h, c_n = in_body(current, motion.psi)
    u, r = motion.u - c_h, clip(motion.r, g.e_r_max)
    phi = u * r + SWAY_MASS_RATIO * clip(f_v, g.e_max)
    # An outlier must not dominate.
    e = clip(v - c_n - current.theta * phi, g.e_max)
    k = MU * turned * e
    east, north = current.east - k * math.sin(motion.psi), current.north + k * math.cos(motion.psi)
    most = g.c_max
    shrink = min(1.0, most / max(magnitude(east, north), 1e-9))
    slowest = u * MIN_YAW_RATE * g.e_r_max
    theta = current.theta + MU_T * turned * e * phi / (phi * phi + slowest * slowest + 1e-9)
    return Current(shrink * east, shrink * north, clip(theta, g.theta_max))


@kernel
def turn_in_water(current: Current, desired: Motion, dr: float, g: Gains) -> TurnInWater:
    """What the current adds to the turn of the reference, and to the sway that the turn causes.

    With c_t and c_l along and to the left of the reference's velocity, U constant and N = (U·c_t - |c|²)/W²,
    dchi_c = r_d·N, ddchi_c = r_d²·U·c_l·(U² - |c|²)/W⁴ + dr_d·N, and dv = theta·d(W·(r_d + dchi_c) - U·r_d).

    Args:
        current: The estimate.
        desired: State of the reference.
        dr: Its yaw acceleration.
        g: Gains.
    """
    along, left = in_body(current, desired.psi + math.atan2(desired.v, desired.u))
    r, U = desired.r, magnitude(desired.u, desired.v)
    square = along * along + left * left
    # The resting speed keeps the quotients finite for a reference at rest, which has no current.
    W2 = U * U - 2.0 * U * along + square + g.v_0 * g.v_0
    W, N = math.sqrt(W2), (U * along - square) / W2
    rate = r * N
    acceleration = r * r * U * left * (U * U - square) / (W2 * W2) + dr * N
    changed = W * (dr + acceleration) - U * dr - U * r * left / W * (r + rate)
    return TurnInWater(rate, acceleration, (current.theta if desired.u >= 0.0 else -current.theta) * changed)

"""What the hierarchical law wants: the velocity that reduces the error, and the turn of the hull in a current.

The symbols are those of `hierarchical`.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.control.laws.hierarchical_parameters import LASTING, Gains
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, magnitude, to_body, wrap
from vessel_hsmc_ros.core.limits import clip


class Guidance(NamedTuple):
    """Errors, their rates and the wanted velocity with its rate, each along bow (1) and beam (2)."""

    e1: float
    e2: float
    psi_e: float
    de1: float
    de2: float
    w1: float
    w2: float
    dw1: float
    dw2: float


@kernel
def guidance(motion: Motion, desired: Motion, acceleration: Acceleration, g: Gains) -> Guidance:
    """The wanted velocity w = dp_d - f·e and its rate dw = ddp_d - f·de - df·e, resolved along the hull."""
    psi_e, r_d = wrap(motion.psi - desired.psi), desired.r
    e1, e2 = to_body(motion.x - desired.x, motion.y - desired.y, motion.psi)
    v1, v2 = to_body(desired.u, desired.v, psi_e)
    a1, a2 = to_body(acceleration.du - r_d * desired.v, acceleration.dv + r_d * desired.u, psi_e)
    de1, de2 = motion.u - v1, motion.v - v2
    d = magnitude(e1, e2)
    root = math.sqrt(1.0 + 2.0 * g.c * g.c * d / g.a)
    f = 2.0 * g.c / (1.0 + root)
    dd = (e1 * de1 + e2 * de2) / max(d, 1e-9)
    df = -f * g.c * g.c * dd / (g.a * root * (1.0 + root))
    return Guidance(
        e1, e2, psi_e, de1, de2, v1 - f * e1, v2 - f * e2, a1 - f * de1 - df * e1, a2 - f * de2 - df * e2
    )  # fmt: skip


@kernel
def turn_in_current(desired: Motion, acceleration: Acceleration, c: tuple[float, float, float], g: Gains) -> tuple[float, float]:
    """The yaw rate r_c of the reference in a current, and its rate: the hull points along its way through the water.

    r_c = s·r_d with the share s = v_d·(v_d - c)/|v_d - c|² by which the velocity through the water turns faster than v_d. In the
    axes of the reference the current turns by -r_d.
    """
    c1, c2 = to_body(c[0], c[1], desired.psi)
    u, v = desired.u - c1, desired.v - c2
    du, dv = acceleration.du - desired.r * c2, acceleration.dv + desired.r * c1
    least = g.U_c * g.U_c
    below = u * u + v * v + least
    share = (desired.u * u + desired.v * v + least) / below
    above = acceleration.du * u + desired.u * du + acceleration.dv * v + desired.v * dv
    dshare = (above - 2.0 * share * (u * du + v * dv)) / below
    return desired.r * share, acceleration.dr * share + desired.r * dshare


@kernel
def learned_current(motion: Motion, desired: Motion, c: tuple[float, float, float], g: Gains) -> tuple[float, float, float]:
    """The estimated current and the lasting sway velocity after a period: what the hull drifts sideways beyond the reference.

    The drift of a current turns with the hull, which tells it from what is fixed to the hull.
    """
    c_x, c_y, lasting = c
    cosine, sine = math.cos(motion.psi), math.sin(motion.psi)
    growth = g.T / g.T_c * clip(motion.v - desired.v - (c_y * cosine - c_x * sine) - lasting, g.U_c)
    return c_x - sine * growth, c_y + cosine * growth, lasting + LASTING * growth

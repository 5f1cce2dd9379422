"""Where the ship is by now: predicted from what was learnt and commanded, corrected by what is measured.

| symbol | meaning | unit |
|---|---|---|
| T | control period | s |
| z_i = exp(-w_i·T) | pole of channel i with the bandwidth w_i | - |
| nu | u, v or r | m/s, rad/s |
| f | its estimated unforced acceleration, the output of a network | m/s², rad/s² |
| b | acceleration by the commanded wrench, zero in sway | m/s², rad/s² |

Between two updates nu- = nu + T·(f + b). At an update the innovation e = nu_measured - nu- gives nu = nu- + (1 - z²)·e and
f += (1 - z)²/T·e: a critically damped observer with both poles at z for every T, 2·w and w² in continuous time. Position and
heading have one pole each.
"""

import math
from typing import NamedTuple

from vessel_hsmc_ros.core.kinematics import TURN


class Motion(NamedTuple):
    """A ship's state, by the symbols of (6)."""

    x: float
    y: float
    psi: float
    u: float
    v: float
    r: float


def correct(predicted: Motion, measured: Motion, z_p: float, z_h: float, z_u: float, z_v: float, z_r: float) -> Motion:
    """The prediction moved towards the measurement, the heading the short way round."""
    p, y = predicted, measured
    return Motion(
        p.x + (1.0 - z_p) * (y.x - p.x),
        p.y + (1.0 - z_p) * (y.y - p.y),
        math.remainder(p.psi + (1.0 - z_h) * math.remainder(y.psi - p.psi, TURN), TURN),
        p.u + (1.0 - z_u * z_u) * (y.u - p.u),
        p.v + (1.0 - z_v * z_v) * (y.v - p.v),
        p.r + (1.0 - z_r * z_r) * (y.r - p.r),
    )


def predict(motion: Motion, du: float, dv: float, dr: float, T: float) -> Motion:
    """The state a period later under held accelerations, the pose by the velocity of the period's middle."""
    x, y, psi, u, v, r = motion
    middle = psi + 0.5 * T * (r + 0.5 * T * dr)
    ahead, aside = T * (u + 0.5 * T * du), T * (v + 0.5 * T * dv)
    c, s = math.cos(middle), math.sin(middle)
    return Motion(
        x + ahead * c - aside * s,
        y + ahead * s + aside * c,
        math.remainder(psi + T * (r + 0.5 * T * dr), TURN),
        u + T * du,
        v + T * dv,
        r + T * dr,
    )

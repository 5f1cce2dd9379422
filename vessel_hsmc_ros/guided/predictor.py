"""Prediction of the ship's motion over one control period, corrected by the measurements.

| symbol | meaning | unit |
|---|---|---|
| T | control period | s |
| z_i = exp(-w_i·T) | discrete pole of channel i with bandwidth w_i | - |
| nu | u, v or r | m/s, rad/s |
| f | its estimated unforced acceleration, the output of a network | m/s², rad/s² |
| b | acceleration by the commanded wrench, zero in sway | m/s², rad/s² |

Between two steps nu- = nu + T·(f + b). At a step the innovation e = nu_measured - nu- gives nu = nu- + (1 - z²)·e and
f += (1 - z)²/T·e: a critically damped observer with both poles at z for every T; in continuous time its gains are 2·w and w².
Position and heading have one pole each.
"""

import math

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import TURN, Motion


@kernel
def correct(predicted: Motion, measured: Motion, z_p: float, z_h: float, z_u: float, z_v: float, z_r: float) -> Motion:
    """Correct the predicted motion by the measured one.

    Pose: first-order filter with poles z_p and z_h, the heading error wrapped. Velocities: nu = nu- + (1 - z²)·e.

    Args:
        predicted, measured: Motion at this step.
        z_p, z_h: Poles of position and heading.
        z_u, z_v, z_r: Poles of surge, sway and yaw velocity.

    Returns:
        The corrected motion, its heading in [-pi, pi].
    """
    p, y = predicted, measured
    return Motion(
        p.x + (1.0 - z_p) * (y.x - p.x),
        p.y + (1.0 - z_p) * (y.y - p.y),
        # The difference is wrapped before it is weighted, so that a correction across 180 degrees takes the short way.
        math.remainder(p.psi + (1.0 - z_h) * math.remainder(y.psi - p.psi, TURN), TURN),
        p.u + (1.0 - z_u * z_u) * (y.u - p.u),
        p.v + (1.0 - z_v * z_v) * (y.v - p.v),
        p.r + (1.0 - z_r * z_r) * (y.r - p.r),
    )


@kernel
def predict(motion: Motion, du: float, dv: float, dr: float, T: float) -> Motion:
    """The motion one period later under constant body accelerations; the pose is integrated by the midpoint rule.

    Args:
        motion: Motion at the start of the period.
        du, dv, dr: Body accelerations, held over the period.
        T: Control period, s.

    Returns:
        The motion at the end of the period, its heading in [-pi, pi].
    """
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

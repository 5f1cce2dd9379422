"""Switching functions of a sliding-mode law: sgn as printed in (21) and (27), and two continuous approximations."""

import math

from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import clip

SWITCHING = ("sgn", "saturation", "tanh")
SGN, SATURATION, TANH = range(3)
"""Indices of the switching functions in SWITCHING."""


@kernel
def sign(value: float) -> float:
    """The signum function of (21) and (27): -1, 0 or 1."""
    # math.copysign would give ±1 at zero; sgn 0 = 0 keeps a motion exactly on the surface undisturbed.
    if value > 0.0:
        return 1.0
    if value < 0.0:
        return -1.0
    return 0.0


@kernel
def switch(S: float, phi: float, kind: int) -> float:
    """The switching function of a surface: sgn S, sat(S/phi) or tanh(S/phi).

    The continuous functions avoid chattering: inside the boundary layer |S| < phi they act as a proportional gain.

    Args:
        S: Sliding surface.
        phi: Width of the boundary layer, in the unit of S, above 0.
        kind: Index in SWITCHING.

    Returns:
        A value in [-1, 1].
    """
    if kind == SGN:
        return sign(S)
    if kind == TANH:
        return math.tanh(S / phi)
    return clip(S / phi, 1.0)

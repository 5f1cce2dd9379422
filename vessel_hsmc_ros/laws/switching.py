"""What a sliding-mode law switches by: sgn as printed in (21) and (27), or one of its smooth stand-ins."""

import math

SWITCHING = ("sgn", "saturation", "tanh")


def sign(value: float) -> float:
    """The function sgn of (21) and (27): -1, 0 or 1."""
    if value > 0.0:
        return 1.0
    if value < 0.0:
        return -1.0
    return 0.0


def switch(S: float, phi: float, kind: str) -> float:
    """What stands for sgn S: sgn S itself, S/phi cut at -1 and 1, or tanh(S/phi).

    Args:
        S: Sliding surface.
        phi: Width of the boundary layer, in the unit of S, above 0.
        kind: One of SWITCHING.
    """
    if kind == "sgn":
        return sign(S)
    if kind == "tanh":
        return math.tanh(S / phi)
    return min(max(S / phi, -1.0), 1.0)

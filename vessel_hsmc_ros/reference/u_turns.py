"""U-turns between parallel legs, from the radius that the ship can turn with and the spacing of the legs.

| spacing | U-turn |
|---|---|
| at least that of two quarter turns | a quarter turn, a straight part, a quarter turn |
| at least that of a half turn | a half turn, with the radius that the spacing has |
| less | a teardrop: away by eps, back by 180 degrees + 2·eps, and by eps again |

The next leg begins abreast of the end of the last.
"""

import math
from collections.abc import Callable

from vessel_hsmc_ros.reference.route import Pieces, displacement, straight, turn

BISECTIONS = 60


def u_turn(spacing: float, radius: float, transition: float) -> Pieces:
    """The U-turn to a parallel leg, which begins abreast of the end of this one.

    Args:
        spacing: Distance to the next leg, m, positive to port.
        radius: Smallest radius, m.
        transition: Length of the transitions between straight and arc, m.
    """
    side, width = math.copysign(1.0, spacing), abs(spacing)
    quarter = displacement(turn(0.5 * math.pi, radius, transition))
    if width >= quarter.real + quarter.imag:
        corner = turn(side * 0.5 * math.pi, radius, transition)
        return (*corner, *straight(width - quarter.real - quarter.imag), *corner)
    if width >= displacement(turn(math.pi, radius, transition)).imag:
        # Half the spacing is the radius of a half circle without transitions, and so too large.
        fitting = _root(lambda r: displacement(turn(math.pi, r, transition)).imag - width, radius, 0.5 * width)
        return turn(side * math.pi, fitting, transition)
    eps = _root(lambda angle: width - displacement(_teardrop(angle, radius, transition)).imag, 0.0, 0.5 * math.pi)
    return _teardrop(eps, radius, transition, side)


def _teardrop(eps: float, radius: float, transition: float, side: float = 1.0) -> Pieces:
    away = turn(-side * eps, radius, transition)
    return (*away, *turn(side * (math.pi + 2.0 * eps), radius, transition), *away)


def _root(increasing: Callable[[float], float], low: float, high: float) -> float:
    """The zero of an increasing function by bisection."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if increasing(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)

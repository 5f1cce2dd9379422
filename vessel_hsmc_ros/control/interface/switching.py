"""Switching functions of a sliding-mode law, and the longest control period for which it is stable in discrete time.

The switching functions are sgn as printed in (21) and (27), and two continuous approximations.

With s = c·e + de and the reaching law ds = -k·s, the error follows dde = -(k + c)·de - k·c·e. A sampled law holds the right-hand
side constant over the period T. The two discrete poles lie inside the unit circle if and only if

    (k + c)·T < 2

| symbol | meaning | unit | equation |
|---|---|---|---|
| k | reaching gain | 1/s | (21), (27) |
| c | slope of the surface | 1/s | (12), (17), (23) |
| T | control period | s | - |

The ship's own damping d changes the limit by a relative (d·T)²/12, about 1e-6 here. For the tau_2 of the hierarchical law, c is
(b·c2 - a·z1·c1)/(b - a·z1), which is practically c2 as long as z1 is far below b/a.
"""

import math
from typing import Any

from vessel_hsmc_ros.core.exceptions import InstabilityError
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.limits import clip

SWITCHING = ("sgn", "saturation", "tanh")
SGN, _, TANH = range(3)  # indices of the switching functions in SWITCHING


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

    The continuous functions avoid chattering: inside the boundary layer |S| < phi they act as a proportional gain. `phi`: width
    of the boundary layer, in the unit of S, above 0. `kind`: index in SWITCHING. Returns a value in [-1, 1].
    """
    if kind == SGN:
        return sign(S)
    if kind == TANH:
        return math.tanh(S / phi)
    return clip(S / phi, 1.0)


LIMIT = 2.0


def check_step(parameters: Any, gain: str, slope: str, period: float, law: str) -> None:
    """Reject a reaching gain and a slope that are unstable at a control period.

    `gain`, `slope`: names of the parameters that hold the reaching gain k and the slope c. `period`: control period T, s.
    `law`: name of the law, for the error message. Raises InstabilityError if (k + c)·T is 2 or more.
    """
    k, c = getattr(parameters, gain), getattr(parameters, slope)
    if (k + c) * period < LIMIT:
        return
    # Not positive if the slope alone is too large for the period: then only a higher rate helps.
    largest = LIMIT / period - c
    remedy = f"a gain below {largest:g} 1/s or a rate" if largest > 0.0 else "a rate"
    raise InstabilityError(
        f"controller.{law}.{gain} = {k:g} 1/s is unstable at controller.rate_hz = {1.0 / period:g} Hz:"
        f" gain plus {slope} = {c:g} 1/s, times the period, is {(k + c) * period:g} and must be below {LIMIT:g},"
        f" so set {remedy} above {(k + c) / LIMIT:g} Hz"
    )

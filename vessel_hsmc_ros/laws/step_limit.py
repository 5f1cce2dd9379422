"""The longest control period at which a sliding surface is still reached.

A law that holds tau over a period T makes of the error e, with s = c·e + de and dds = -k·s on the surface, the motion
dde = -(k + c)·de - k·c·e with the right-hand side held. Its two discrete poles lie in the unit circle exactly when

    (k + c)·T < 2

| symbol | meaning | unit | equation |
|---|---|---|---|
| k | reaching gain | 1/s | (21), (27) |
| c | slope of the surface | 1/s | (12), (17), (23) |
| T | control period | s | - |

The ship's own damping d moves the limit by a share of (d·T)²/12, a millionth here. What counts as c for the hierarchical tau_2 is
(b·c2 - a·z1·c1)/(b - a·z1), which is c2 as long as z1 is far below b/a.
"""

from typing import Any

from vessel_hsmc_ros.core.exceptions import InstabilityError

LIMIT = 2.0


def check_step(parameters: Any, gain: str, slope: str, period: float, law: str) -> None:
    """Refuse a reaching gain and a slope that diverge at a period.

    Args:
        parameters: Those of the law.
        gain, slope: Names of the reaching gain and of the surface's slope among them.
        period: Time between two updates, s.
        law: Name of the law, for the message.

    Raises:
        InstabilityError: (k + c)·T is 2 or more.
    """
    k, c = getattr(parameters, gain), getattr(parameters, slope)
    if (k + c) * period < LIMIT:
        return
    room = LIMIT / period - c
    way_out = f"a gain below {room:g} 1/s or a rate" if room > 0.0 else "a rate"
    raise InstabilityError(
        f"controller.{law}.{gain} = {k:g} 1/s is unstable at controller.rate_hz = {1.0 / period:g} Hz:"
        f" gain plus {slope} = {c:g} 1/s, times the period, is {(k + c) * period:g} and must be below {LIMIT:g},"
        f" so take {way_out} above {(k + c) / LIMIT:g} Hz"
    )

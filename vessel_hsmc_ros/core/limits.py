"""The saturation function of control engineering, and what counts as saturated."""

from vessel_hsmc_ros.core.kernel import kernel

AT_LIMIT = 1.0 - 1e-6
"""A command is at its limit from this share of it on: a law that clips in other units, or a recorded number, is rounded."""


@kernel
def clip(value: float, limit: float) -> float:
    """Saturate a value symmetrically: min(max(value, -limit), limit), with limit >= 0; NaN stays NaN."""
    # Comparisons, because min and max order -0 and 0 differently when they are compiled.
    if value > limit:
        return limit
    if value < -limit:
        return -limit
    return value


@kernel
def between(value: float, low: float, high: float) -> float:
    """Limit a value to the interval from low to high; NaN stays NaN."""
    if value > high:
        return high
    if value < low:
        return low
    return value

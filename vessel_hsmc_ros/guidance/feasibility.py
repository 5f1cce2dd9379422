"""Whether a ship can travel a curve: drift angle, surge force and yaw moment over a period against their limits.

Calm water is assumed; what is left below the limits is available against disturbances.
"""

import math

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.quantities import quantity
from vessel_hsmc_ros.guidance.curve_motion import Demand, Pace, demand
from vessel_hsmc_ros.guidance.shapes import Shape
from vessel_hsmc_ros.plant.dynamics import Vessel

LARGEST_DRIFT = math.radians(45.0)  # largest drift angle, rad: beyond it the hull would travel more sideways than ahead
BISECTIONS = 20


def check_feasible(owner: str, shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> None:
    """Check that a ship can travel a curve within its limits.

    `owner`: name of the mode, for the error message. `vessel`: coefficients of (6). `limits`: largest drift angle, surge force
    and yaw moment; infinite where unknown. Raises ParameterError if a limit is exceeded; the message contains the demand, the
    limit and the largest feasible speed.
    """
    excesses = _excesses(demand(shape.curve, pace, vessel, limits.drift), limits)
    if excesses:
        remedy = _remedy(shape, pace, vessel, limits)
        raise ParameterError(f"{owner}: {shape.size} at {pace.speed:g} m/s needs {' and '.join(excesses)}; {remedy}")


def _remedy(shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> str:
    """What is feasible instead."""
    largest = _largest_speed(shape, pace, vessel, limits)
    if not largest:
        return "no speed is feasible; use a larger curve"
    steady = demand(shape.curve, pace._replace(rise_time=0.0), vessel, limits.drift)
    remedy = f"the largest feasible speed is {largest:g} m/s"
    return remedy if _excesses(steady, limits) else f"with a rise_time of {pace.rise_time:g} s {remedy}, with a longer one more"


def _excesses(needed: Demand, limits: Demand) -> list[str]:
    """The exceeded limits in words; a drift angle that is too large leaves force and moment unknown."""
    if needed.drift > limits.drift:
        return [f"a drift angle of {math.degrees(needed.drift):.0f}° (the largest is {math.degrees(limits.drift):.0f}°)"]
    rows = (
        ("a surge force", "surge_force_limit", "N", needed.surge_force, limits.surge_force),
        ("a yaw moment", "yaw_moment_limit", "N·m", needed.yaw_moment, limits.yaw_moment),
    )
    return [
        f"{what} of {quantity(value, unit)} (vessel.{name} is {quantity(limit, unit)})"
        for what, name, unit, value, limit in rows
        if value > limit
    ]


def _largest_speed(shape: Shape, pace: Pace, vessel: Vessel, limits: Demand) -> float:
    """The largest feasible speed below an infeasible one by bisection, rounded down to three digits; 0 if there is none."""

    def feasible(speed: float) -> bool:
        return not _excesses(demand(shape.curve, pace._replace(speed=speed), vessel, limits.drift), limits)

    low, high = 1e-3 * pace.speed, pace.speed
    if not feasible(low):
        return 0.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(middle) else (low, middle)
    digits = 2 - math.floor(math.log10(low))
    return math.floor(low * 10.0**digits) / 10.0**digits

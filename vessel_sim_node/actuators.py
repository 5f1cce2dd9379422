"""What the actuators make of a commanded wrench."""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.schema import parameter


@dataclass(frozen=True)
class ActuatorParameters:
    """Limits of thrust and yaw moment; infinite, as in the paper, unless said otherwise."""

    surge_force_limit: float = parameter(math.inf, "Largest surge force, either way.", unit="N", low=0.0, high=math.inf)
    yaw_moment_limit: float = parameter(math.inf, "Largest yaw moment, either way.", unit="N·m", low=0.0, high=math.inf)


def applied(command: tuple[float, float], limits: ActuatorParameters) -> tuple[float, float]:
    """The wrench that reaches the hull: the command cut at the limits.

    Args:
        command: Surge force [N] and yaw moment [N·m].
        limits: The actuators' limits.
    """
    force, moment = limits.surge_force_limit, limits.yaw_moment_limit
    return min(max(command[0], -force), force), min(max(command[1], -moment), moment)

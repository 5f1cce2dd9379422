"""The parameters of goals, and the goals that they schedule."""

from dataclasses import dataclass
from itertools import pairwise

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

NEVER = -1.0
"""A time that never comes, s: the default of a list, because ROS has no empty lists of numbers."""


@dataclass(frozen=True)
class GoalParameters:
    """Goals from the parameters file, for runs without a publisher of `goal_pose`."""

    poses: tuple[float, ...] = parameter(
        (0.0, 0.0, 0.0), "Goals: x [m], y [m], heading of the first, of the second and so on.", low=-1e6, high=1e6
    )
    times: tuple[float, ...] = parameter(
        (NEVER,), "Time at which each goal is set, increasing; below 0 for never.", unit="s", low=-1.0, high=1e9
    )
    astern_distance: float = parameter(
        -1.0,
        "Goals abaft the beam and nearer than this are approached astern; below 0 for 1.2 radii of gyration, 0.3 lengths of most"
        " hulls.",
        unit="m",
        low=-1.0,
        high=1e6,
    )


def scheduled_goals(p: GoalParameters) -> list[tuple[float, tuple[float, float, float]]]:
    """Times and poses of the goals in the parameters.

    Raises:
        ParameterError: poses and times differ in number, or the times do not increase.
    """
    if len(p.poses) != 3 * len(p.times):
        raise ParameterError(
            f"reference_ship.goal.poses with {len(p.poses)} numbers is not allowed: it takes x, y, heading for each of the"
            f" {len(p.times)} goal.times"
        )
    if any(later <= earlier for earlier, later in pairwise(time for time in p.times if time >= 0.0)):
        raise ParameterError(f"reference_ship.goal.times = {list(p.times)} is not allowed: it takes increasing times")
    return [(time, (p.poses[3 * i], p.poses[3 * i + 1], p.poses[3 * i + 2])) for i, time in enumerate(p.times)]

"""The parameters of goals, and the goals that they schedule."""

from dataclasses import dataclass
from itertools import pairwise

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter

NONE = (0.0,)
"""A list without a pose or waypoint: one number, which is neither, because the parameters files of ROS have no empty lists."""


@dataclass(frozen=True)
class GoalParameters:
    """Goals from the parameters file, for runs without a publisher of `goal_pose`."""

    poses: tuple[float, ...] = parameter(
        NONE, "Goals: x [m], y [m], heading of the first, of the second and so on; [0.0] for none.", low=-1e6, high=1e6
    )
    times: tuple[float, ...] = parameter(
        (0.0,), "Time at which each goal is set, increasing; below 0 for never.", unit="s", low=-1.0, high=1e9
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

    Raises ParameterError if poses and times differ in number, or the times do not increase.
    """
    times = given_times(p.times, p.poses, "reference_ship.goal.times", "reference_ship.goal.poses")
    if len(p.poses) != 3 * len(times) and p.poses != NONE:
        raise ParameterError(
            f"reference_ship.goal.poses must have x, y, heading for each of the {len(times)} goal.times"
            f" (got {len(p.poses)} numbers)"
        )
    if any(later <= earlier for earlier, later in pairwise(time for time in times if time >= 0.0)):
        raise ParameterError(f"reference_ship.goal.times must increase (got {list(times)})")
    return [(time, (p.poses[3 * i], p.poses[3 * i + 1], p.poses[3 * i + 2])) for i, time in enumerate(times)]


def given_times(times: tuple[float, ...], places: tuple[float, ...], name: str, places_name: str) -> tuple[float, ...]:
    """The times at which poses or waypoints are set; none without them.

    `times`: the times, s; below 0 for never. Raises ParameterError if there is a time, and nothing to set at it.
    """
    if places != NONE:
        return times
    if max(times, default=0.0) > 0.0:
        raise ParameterError(f"{places_name} must be given with {name} (got {name} = {list(times)} alone)")
    return ()

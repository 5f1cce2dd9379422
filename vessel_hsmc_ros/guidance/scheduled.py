"""The parameters of goals and paths, and the goals and waypoints that they schedule, for runs without a publisher of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.polyline import OVER, STOP, THROUGH, Waypoint

NONE = (0.0,)
"""A list without a pose or waypoint: one number, which is neither, because the parameters files of ROS have no empty lists."""

Point = tuple[float, float]
PATH = "reference_ship.path"
CORNERS = (THROUGH, OVER, STOP)


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


@dataclass(frozen=True)
class PathParameters:
    """Waypoints from the parameters file, for runs without a publisher of `path`."""

    waypoints: tuple[float, ...] = parameter(
        NONE, "Waypoints: x, y of the first, of the second and so on; [0.0] for none.", unit="m", low=-1e6, high=1e6
    )
    speeds: tuple[float, ...] = parameter(
        (0.0,), "Speed on the leg to each waypoint, or one for all; 0 for `motion.speed`.", unit="m/s", low=0.0, high=1e3
    )
    corners: tuple[str, ...] = parameter(
        (THROUGH,),
        "What to do at each waypoint, or at all: through, cut the corner; over, turn after it; stop, come to rest there.",
    )
    holds: tuple[float, ...] = parameter(
        (0.0,), "Time at rest at each waypoint, or at all; above 0 it is a stop.", unit="s", low=0.0, high=1e6
    )
    headings: tuple[float, ...] = parameter(
        (-1.0,),
        "Heading to turn to on the spot at each waypoint that is a stop, or the last; below 0 for none.",
        unit="rad",
        low=-1.0,
        high=6.3,
    )
    corner_radius: float = parameter(
        0.0, "Radius of the corners; 0 for the smallest at the speed of the legs.", unit="m", low=0.0, high=1e6
    )
    time: float = parameter(0.0, "Time at which the path is set; below 0 for never.", unit="s", low=-1.0, high=1e9)


def scheduled_path(p: PathParameters, speed: float) -> tuple[float, list[Waypoint]] | None:
    """Time and waypoints of the path in the parameters; None without one.

    `speed`: on legs without a speed of their own, m/s. Raises ParameterError as from `waypoints_of`, or there is a time and no
    waypoint.
    """
    if not given_times((p.time,), p.waypoints, f"{PATH}.time", f"{PATH}.waypoints"):
        return None
    waypoints = waypoints_of(p, speed)
    return (p.time, waypoints) if p.time >= 0.0 else None


def waypoints_of(p: PathParameters, speed: float) -> list[Waypoint]:
    """The waypoints of the parameters.

    `speed`: on legs without a speed of their own, m/s. Raises ParameterError if the number of coordinates is odd, there are
    more or fewer speeds, corners, holds or headings than waypoints, or there is a heading where the vessel does not stop.
    """
    numbers = p.waypoints
    if len(numbers) % 2:
        raise ParameterError(f"{PATH}.waypoints must be x, y for each waypoint (got {len(numbers)} numbers)")
    unknown = [corner for corner in p.corners if corner not in CORNERS]
    if unknown:
        raise ParameterError(f"{PATH}.corners must be any of {', '.join(CORNERS)} (got {unknown[0]})")
    n = len(numbers) // 2
    speeds, corners = _each("speeds", p.speeds, n), _each("corners", p.corners, n)
    holds, headings = _each("holds", p.holds, n), _each("headings", p.headings, n)
    points = []
    for i, (corner, own, hold, heading) in enumerate(zip(corners, speeds, holds, headings, strict=True)):
        kind = STOP if hold else corner
        turns = heading >= 0.0 and (kind == STOP or i == n - 1)
        if heading >= 0.0 and not turns and len(p.headings) > 1:
            raise ParameterError(
                f"{PATH}.headings must be below 0 where the vessel does not stop, because under way it points along its course"
                f" (got {heading:g} rad at waypoint {i + 1}, with the corner {corner})"
            )
        place = complex(numbers[2 * i], numbers[2 * i + 1])
        points.append(Waypoint(place, kind, own or speed, hold=hold, heading=heading if turns else None))
    return points


def _each(name: str, values: Sequence[Any], n: int) -> Sequence[Any]:
    if len(values) not in (1, n):
        raise ParameterError(f"{PATH}.{name} must have one value, or {n} for {n} waypoints (got {len(values)})")
    return values if len(values) == n else list(values) * n

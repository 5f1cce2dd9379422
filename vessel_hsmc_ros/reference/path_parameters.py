"""The parameters of paths, and the waypoints that they contain."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.reference.goal_parameters import NEVER

Point = tuple[float, float]


@dataclass(frozen=True)
class PathParameters:
    """Waypoints from the parameters file, for runs without a publisher of `path`."""

    waypoints: tuple[float, ...] = parameter(
        (0.0, 0.0), "Waypoints: x, y of the first, of the second and so on.", unit="m", low=-1e6, high=1e6
    )
    time: float = parameter(NEVER, "Time at which the path is set; below 0 for never.", unit="s", low=-1.0, high=1e9)
    radius: float = parameter(
        10.0, "Acceptance radius of a waypoint, for switching to the next leg.", unit="m", low=0.1, high=1e6
    )


def points_of(parameters: PathParameters) -> list[Point]:
    """The waypoints of the parameters.

    Raises:
        ParameterError: the number of coordinates is odd.
    """
    numbers = parameters.waypoints
    if len(numbers) % 2:
        raise ParameterError(
            f"reference_ship.path.waypoints with {len(numbers)} numbers is not allowed: it takes x, y for each waypoint"
        )
    return list(zip(numbers[::2], numbers[1::2], strict=True))

"""The parameters of the actions: when a goal is reached or given up, and what the vessel does then."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.guidance.waypoints import NONE

OWNER = "reference_ship.actions"


@dataclass(frozen=True)
class ActionParameters:
    """When a goal is reached or given up, and what follows.

    Raises:
        ParameterError: the home is no x, y, or the datum no latitude and longitude.
    """

    reach: float = parameter(
        0.0,
        "Distance of the vessel from the end of a goal within which it is reached; 0 for two radii of gyration, half a length of"
        " most hulls.",
        unit="m",
        low=0.0,
        high=1e4,
    )
    patience: float = parameter(
        30.0,
        "Time without coming nearer, once the reference has arrived, after which a goal counts as not reached.",
        unit="s",
        low=1.0,
        high=1e5,
    )
    tolerance: float = parameter(
        5.0,
        "Longest safe action of the controller, or time without odometry, that does not end a goal.",
        unit="s",
        low=0.0,
        high=1e4,
    )
    at_end: str = parameter(
        "hold",
        "What the vessel does at the end of a mission, with a low battery and without its operator: hold, keep station; stop, the"
        " controller commands zero until ~/rearm; return, sail to `home`.",
        choices=("hold", "stop", "return"),
    )
    home: tuple[float, ...] = parameter(
        NONE, "x, y to return to; [0.0] for those of `initial_pose`.", unit="m", low=-1e6, high=1e6
    )
    datum: tuple[float, ...] = parameter(
        NONE,
        "Latitude and longitude of the origin of the odometry, degrees, for follow_gps_waypoints; [0.0] for those on odom/datum.",
        low=-180.0,
        high=180.0,
    )
    battery: float = parameter(
        0.0,
        "Share of the charge on battery_state below which every goal ends with the action of `at_end`, and none is taken; 0 for"
        " none.",
        low=0.0,
        high=1.0,
    )
    operator_timeout: float = parameter(
        0.0, "Silence on operator_heartbeat after which the same happens; 0 for never.", unit="s", low=0.0, high=1e5
    )

    def __post_init__(self) -> None:
        for name, what in (("home", "x and y"), ("datum", "a latitude and a longitude")):
            if getattr(self, name) != NONE and len(getattr(self, name)) != 2:
                raise ParameterError(f"{OWNER}.{name} must be {what} (got {list(getattr(self, name))})")
        if not abs(self.datum[0]) < 90.0:
            raise ParameterError(
                f"{OWNER}.datum must be a latitude within -90 and 90 degrees, then a longitude (got {list(self.datum)})"
            )

"""The parameters of the standard manoeuvres."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter

KINDS = ("turning_circle", "zigzag", "spiral", "crash_stop", "speed_run", "bollard_pull")
"""The manoeuvres, in the order of their numbers in the kernel."""

SIDES = ("port", "starboard")

FULL_RUDDER_DEG = 35.0
"""The rudder angle that stands for the whole yaw moment."""


@dataclass(frozen=True)
class ManoeuvreParameters:
    """Which manoeuvre, and its numbers; docs/manoeuvres.md defines the manoeuvres."""

    kind: str = parameter("turning_circle", "The manoeuvre.", choices=KINDS)
    side: str = parameter("starboard", "Side of the first turn.", choices=SIDES)
    approach_time: float = parameter(
        30.0, "Duration of the approach, a straight run at the initial heading.", unit="s", low=0.0, high=1e6
    )
    approach_share: float = parameter(
        0.85, "Surge force of the approach and of turns, as a share of vessel.surge_force_limit.", low=0.0, high=1.0
    )
    rudder_deg: float = parameter(
        FULL_RUDDER_DEG,
        "Rudder angle of turning circle, zig-zag and spiral. The ship is commanded by a yaw moment: 35° stands for"
        " vessel.yaw_moment_limit, smaller angles for a proportional part of it.",
        unit="°",
        low=0.0,
        high=FULL_RUDDER_DEG,
    )
    switch_heading_deg: float = parameter(
        10.0, "Change of heading at which the zig-zag reverses the rudder.", unit="°", low=0.1, high=90.0
    )
    steps: int = parameter(
        9,
        "Number of yaw moments of a spiral from one side to the other, of which zero is one if it is odd; number of surge forces"
        " of speed runs.",
        low=2,
        high=101,
    )
    hold_time: float = parameter(60.0, "Duration of each step of a spiral and of each speed run.", unit="s", low=0.01, high=1e6)
    astern_share: float = parameter(
        1.0, "Surge force astern of the crash stop, as a share of vessel.surge_force_limit.", low=0.0, high=1.0
    )

"""Parameters that all nodes of the closed loop have."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def rate(description: str) -> float:
    """Declare a rate with a default of 100 Hz."""
    return parameter(100.0, description, unit="Hz", low=1.0, high=1000.0)


@dataclass(frozen=True)
class CommonParameters:
    """Parameters of every node of the closed loop."""

    lockstep: bool = parameter(
        False,
        "Lockstep: one step at a time with the plant, as fast as the machine allows; false runs in real time on the node's"
        " clock. A scenario that leaves it out runs in lockstep.",
    )
    recorded: bool = parameter(
        False, "A recorder takes part: wait with publishing until it and the readers of every topic are connected."
    )
    frame_prefix: str = parameter(
        "", "Prefix of the frames odom and base_link, such as alpha/, so that several vessels have frames of their own."
    )
    ride_through: bool = parameter(
        False,
        "In lockstep, bridge refused and missing inputs as in real time, by the age of their stamps, and answer every step; false"
        " ends the run with an error.",
    )

"""The ship model for users of the node's package: public names of `vessel_hsmc_ros.plant`."""

from vessel_hsmc_ros.plant.dynamics import (
    ShipParameters,
    Vessel,
    VesselParameters,
    Wrench,
    acceleration,
    damping_force,
    derivative,
    rk4,
    unforced_acceleration,
)

__all__ = [
    "ShipParameters",
    "Vessel",
    "VesselParameters",
    "Wrench",
    "acceleration",
    "damping_force",
    "derivative",
    "rk4",
    "unforced_acceleration",
]

"""The ship model for users of the node's package: public names of `vessel_hsmc_ros.plant`."""

from vessel_hsmc_ros.plant.dynamics import Vessel, Wrench, acceleration, damping_force, derivative, rk4, unforced_acceleration
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters, VesselParameters

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

"""The model knowledge of a control law: two inertias and the actuator limits."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.schema import parameter


@dataclass(frozen=True)
class KnownVessel(NamedVessel):
    """What a law knows of the ship; the paper's own laws do not use the limits."""

    surge_inertia: float = parameter(120e3, "Mass with added mass in surge.", unit="kg", low=1e-3, high=1e12, symbol="m11")
    yaw_inertia: float = parameter(
        636e5, "Moment of inertia with added inertia in yaw.", unit="kg·m²", low=1e-3, high=1e15, symbol="m33"
    )
    surge_force_limit: float = parameter(
        2e5,
        "Largest surge force to command, in either direction; not used by the paper's own laws.",
        unit="N",
        low=1e-3,
        high=1e12,
    )
    yaw_moment_limit: float = parameter(
        3e6,
        "Largest yaw moment to command, in either direction; not used by the paper's own laws.",
        unit="N·m",
        low=1e-3,
        high=1e15,
    )

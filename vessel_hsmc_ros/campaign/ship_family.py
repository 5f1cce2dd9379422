"""A family of ships on which no law was tuned: dimensionless numbers from which `ship_expansion` makes the scenario of one ship.

A ship of the family is the paper's ship, Froude-scaled to a length, with other proportions of its inertias, damping, limits and
actuators. What its owner declares of it, its reference, its loads, sensors and rates are numbers of the family too, in the ship's
own units: length L, top speed U, T = sqrt(yaw inertia / largest yaw moment), and the largest surge force F. A campaign draws
them by the names `ship.<number>`; docs/campaigns.md explains the file.
"""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter

SHIP = "ship."
"""Prefix of the names of these numbers in a campaign file."""

REFERENCES = ("circle", "straight", "slalom", "figure_eight", "arc", "survey", "rest")

KNOWLEDGE = ("declared", "nothing", "everything", "true_values")


def factor(what: str) -> float:
    """Declare a factor on the value of the paper's ship."""
    return parameter(1.0, f"{what}, relative to the scaled ship of the paper.", low=0.01, high=100.0)


def delay(default: float, what: str, unit: str) -> float:
    """Declare a delay of the actuators in units of the ship."""
    return parameter(default, f"{what}, if there is any.", unit=unit, low=0.0, high=10.0)


def error(what: str) -> float:
    """Declare the factor by which a declaration differs from the truth."""
    return parameter(1.0, f"Declared {what}, relative to the true one.", low=0.01, high=100.0)


def switch(description: str) -> bool:
    """Declare a property that a ship has or has not."""
    return parameter(False, description)


def angle(description: str) -> float:
    """Declare a direction, counter-clockwise from east."""
    return parameter(0.0, description, unit="rad", low=-2.0 * math.pi, high=2.0 * math.pi)


@dataclass(frozen=True)
class ShipFamily:
    """The numbers of one ship, its owner's declarations and its day; by default the paper's ship on a circle in calm water."""

    length: float = parameter(32.0, "Length of the hull; everything else is scaled with it.", unit="m", low=0.1, high=1000.0)
    surge_to_sway_inertia: float = parameter(0.675, "m11/m22; m11 is that of the scaled ship.", low=0.1, high=2.0)
    yaw_inertia: float = factor("Yaw inertia")
    coupled: bool = switch("Whether sway and yaw are coupled in the inertia matrix.")
    percussion_point: float = parameter(0.0, "m23/m22, if coupled.", unit="L", low=-0.2, high=0.2)
    surge_damping: float = factor("Damping in surge")
    sway_damping: float = factor("Damping in sway")
    yaw_damping: float = factor("Damping in yaw")
    surge_force_limit: float = factor("Largest surge force")
    yaw_moment_limit: float = factor("Largest yaw moment")

    has_lag: bool = switch("Whether the actuators have a first-order lag.")
    has_rate: bool = switch("Whether the actuators have a limited rate.")
    has_dead_time: bool = switch("Whether the actuators have a dead time.")
    lag: float = delay(0.1, "Time constant of the lag", "T")
    time_to_full: float = delay(1.0, "Time from zero to the limit", "T")
    dead_time: float = delay(0.05, "Dead time", "T")
    surge_delays: float = parameter(1.0, "Factor on all delays in surge.", low=0.1, high=10.0)
    yaw_delays: float = parameter(1.0, "Factor on all delays in yaw.", low=0.1, high=10.0)

    knowledge: str = parameter(
        "declared",
        "What the law is given besides inertias and limits: what is declared with its errors; nothing; everything, exactly; or"
        " the true values of what is declared.",
        choices=KNOWLEDGE,
    )
    declares_lag: bool = switch("Whether the lags are declared.")
    declares_rate: bool = switch("Whether the rates are declared.")
    declares_dead_time: bool = switch("Whether the dead times are declared.")
    declares_coupling: bool = switch("Whether the coupling of sway and yaw is declared.")
    declares_sway_damping: bool = switch("Whether sway damping rate and Coriolis ratio are declared if the hull needs them.")
    declared_lag: float = error("lag")
    declared_rate: float = error("rate")
    declared_dead_time: float = error("dead time")
    declared_coupling: float = error("coupling of sway and yaw")
    declared_sway_damping_rate: float = error("sway damping rate")
    declared_coriolis_ratio: float = error("Coriolis ratio")
    declared_surge_inertia: float = error("surge inertia")
    declared_sway_inertia: float = error("sway inertia")
    declared_yaw_inertia: float = error("yaw inertia")

    reference: str = parameter("circle", "What the ship follows.", choices=REFERENCES)
    radius: float = parameter(6.0, "Radius of turns; an arc has four times that.", unit="L", low=0.5, high=1000.0)
    speed: float = parameter(0.5, "Speed of the reference.", unit="U", low=0.01, high=1.0)
    to_port: bool = parameter(True, "Whether the reference turns to port first.")

    has_current: bool = switch("Whether there is a current.")
    has_wind: bool = switch("Whether there is a wind, with gusts of a tenth of its force.")
    current: float = parameter(0.1, "Speed of the current, if there is any.", unit="U", low=0.0, high=1.0)
    current_direction: float = angle("Direction to which the current flows; the reference begins eastward.")
    wind: float = parameter(0.1, "Force of the wind, if there is any.", unit="F", low=0.0, high=1.0)
    wind_direction: float = angle("Direction of the force of the wind.")

    noisy: bool = switch("Whether pose alone is measured, with noise, and the observer is on.")
    position_noise: float = parameter(0.005, "Standard deviation of a position, if noisy.", unit="L", low=1e-6, high=1.0)
    heading_noise: float = parameter(0.01, "Standard deviation of a heading, if noisy.", unit="rad", low=1e-6, high=1.0)

    control_rate_hz: float = parameter(50.0, "Rate of the control law.", unit="Hz", low=0.1, high=1000.0)
    start_distance: float = parameter(0.2, "Distance of the start from that of the reference.", unit="L", low=0.0, high=100.0)
    start_direction: float = angle("Direction of the start from that of the reference.")
    start_heading: float = angle("Heading at the start; that of the reference is 0.")

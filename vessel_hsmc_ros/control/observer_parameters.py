"""The tuning of the observer, and what it is told of hull and actuators beside the inertia."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def tuning(default: float, description: str, unit: str) -> float:
    """Declare a standard deviation or intensity of the filter."""
    return parameter(default, description, unit=unit, low=1e-9, high=1e6)


def decay(default: float, what: str, symbol: str) -> float:
    """Declare the rate at which a velocity left alone fades, as a ship that coasts shows it."""
    return parameter(default, f"Rate at which {what} left alone fades, roughly.", unit="1/s", low=0.0, high=1e2, symbol=symbol)


@dataclass(frozen=True)
class ObserverParameters:
    """What the observer expects of sensors, hull, forces and waves; decays are the paper's linear damping over the inertia."""

    enabled: bool = parameter(False, "Give the law estimates from the measured pose instead of what is measured.")
    position_noise: float = tuning(0.5, "Standard deviation of a sample of x and of y.", "m")
    heading_noise: float = tuning(0.005, "Standard deviation of a sample of the heading.", "rad")
    surge_decay: float = decay(0.18, "a surge velocity", "d_1")
    sway_decay: float = decay(0.83, "a sway velocity", "d_2")
    yaw_decay: float = decay(0.126, "a yaw rate", "d_3")
    actuator_lag: float = parameter(
        0.0, "Time constant with which the actuators follow their command.", unit="s", low=0.0, high=1e3, symbol="T_l"
    )
    velocity_walk: float = tuning(0.01, "Unexplained change of surge and sway velocity in one second.", "m/s")
    yaw_rate_walk: float = tuning(0.0002, "Unexplained change of the yaw rate in one second.", "rad/s")
    force_walk: float = tuning(0.01, "Change of the unknown accelerations along and across the hull in one second.", "m/s²")
    moment_walk: float = tuning(0.0007, "Change of the unknown yaw acceleration in one second.", "rad/s²")
    weather_walk: float = tuning(0.003, "Change of the unknown accelerations east and north in one second.", "m/s²")
    wave_period: float = parameter(0.0, "Period of the waves to filter out; 0 filters none.", unit="s", low=0.0, high=60.0)
    wave_damping: float = parameter(0.1, "Damping of the waves' model.", low=0.01, high=0.9)
    wave_position: float = tuning(0.2, "Standard deviation of the waves' motion in x and in y.", "m")
    wave_heading: float = tuning(0.01, "Standard deviation of the waves' motion in heading.", "rad")

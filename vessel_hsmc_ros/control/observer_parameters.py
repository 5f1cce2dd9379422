"""The parameters of the observer: noise levels, and model parameters of hull, actuators and waves."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def tuning(default: float, description: str, unit: str) -> float:
    """Declare a standard deviation or noise intensity of the filter; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-9, high=1e6)


def decay(default: float, what: str, symbol: str) -> float:
    """Declare the linear damping of a velocity, which can be identified in a coasting manoeuvre.

    Args:
        default: Decay rate, 1/s.
        what: The velocity, for the description.
        symbol: Symbol in the model.
    """
    return parameter(
        default, f"Decay rate of {what} without inputs; a rough value suffices.", unit="1/s", low=0.0, high=1e2, symbol=symbol
    )


@dataclass(frozen=True)
class ObserverParameters:
    """Assumptions on sensors, hull, disturbances and waves; default decay rates are the paper's linear damping over inertia."""

    enabled: bool = parameter(False, "Give the law the state estimated from the measured pose instead of the measured state.")
    position_noise: float = tuning(0.5, "Standard deviation of a sample of x and of y.", "m")
    heading_noise: float = tuning(0.005, "Standard deviation of a sample of the heading.", "rad")
    surge_decay: float = decay(0.18, "a surge velocity", "d_1")
    sway_decay: float = decay(0.83, "a sway velocity", "d_2")
    yaw_decay: float = decay(0.126, "a yaw rate", "d_3")
    actuator_lag: float = parameter(
        0.0, "Time constant of the first-order lag of the actuators.", unit="s", low=0.0, high=1e3, symbol="T_l"
    )
    velocity_walk: float = tuning(
        0.01, "Process noise of surge and sway velocity: standard deviation of the change in one second.", "m/s"
    )
    yaw_rate_walk: float = tuning(
        0.0002, "Process noise of the yaw rate: standard deviation of the change in one second.", "rad/s"
    )
    force_walk: float = tuning(
        0.01, "Process noise of the body-fixed disturbance: standard deviation of the change in one second.", "m/s²"
    )
    moment_walk: float = tuning(
        0.0007, "Process noise of the yaw disturbance: standard deviation of the change in one second.", "rad/s²"
    )
    weather_walk: float = tuning(
        0.003, "Process noise of the earth-fixed disturbance: standard deviation of the change in one second.", "m/s²"
    )
    wave_period: float = parameter(
        0.0, "Peak period of the waves to filter out; 0 for no wave filter.", unit="s", low=0.0, high=60.0
    )
    wave_damping: float = parameter(0.1, "Damping ratio of the wave filter.", low=0.01, high=0.9)
    wave_position: float = tuning(0.2, "Standard deviation of the wave-frequency motion in x and in y.", "m")
    wave_heading: float = tuning(0.01, "Standard deviation of the wave-frequency motion in heading.", "rad")

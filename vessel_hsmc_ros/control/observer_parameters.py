"""The parameters of the observer: noise levels, and model parameters of hull, actuators and waves."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def tuning(default: float, description: str, unit: str) -> float:
    """Declare a standard deviation or noise intensity of the filter; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-9, high=1e6)


def walk(what: str, unit: str) -> float:
    """Declare the process noise of a state; -1, the default, derives it from the ship's inertia and limits."""
    return parameter(
        -1.0,
        f"Process noise of {what}: standard deviation of the change in one second; -1: derived from the vessel.",
        unit=unit,
        low=-1.0,
        high=1e6,
    )


def wave(what: str, unit: str) -> float:
    """Declare the standard deviation of the wave-frequency motion; -1, the default, derives it from period and length."""
    return parameter(
        -1.0,
        f"Standard deviation of the wave-frequency motion in {what}; -1: that of a fully developed sea of the wave period.",
        unit=unit,
        low=-1.0,
        high=1e6,
    )


def decay(what: str, symbol: str) -> float:
    """Declare the linear damping of a velocity; -1, the default, estimates it.

    Args:
        what: The velocity, for the description.
        symbol: Symbol in the model.
    """
    return parameter(-1.0, f"Decay rate of {what} without inputs; -1: estimated.", unit="1/s", low=-1.0, high=1e2, symbol=symbol)


@dataclass(frozen=True)
class ObserverParameters:
    """What the filter assumes of sensors, hull, disturbances and waves."""

    enabled: bool = parameter(False, "Give the law the state estimated from the measured pose instead of the measured state.")
    position_noise: float = tuning(0.5, "Standard deviation of a sample of x and of y.", "m")
    heading_noise: float = tuning(0.005, "Standard deviation of a sample of the heading.", "rad")
    surge_decay: float = decay("a surge velocity", "d_1")
    sway_decay: float = decay("a sway velocity", "d_2")
    yaw_decay: float = decay("a yaw rate", "d_3")
    actuator_lag: float = parameter(
        -1.0,
        "Time constant of the first-order lag of both actuators; -1: those declared of the vessel.",
        unit="s",
        low=-1.0,
        high=1e3,
        symbol="T_l",
    )
    velocity_walk: float = walk("surge and sway velocity", "m/s")
    yaw_rate_walk: float = walk("the yaw rate", "rad/s")
    force_walk: float = walk("the body-fixed disturbance", "m/s²")
    moment_walk: float = walk("the yaw disturbance", "rad/s²")
    weather_walk: float = walk("the current, which stands for wind and wave drift too", "m/s")
    wave_period: float = parameter(
        0.0, "Peak period of the waves to filter out; 0 for no wave filter.", unit="s", low=0.0, high=60.0
    )
    wave_damping: float = parameter(0.1, "Damping ratio of the wave filter.", low=0.01, high=0.9)
    wave_position: float = wave("x and in y", "m")
    wave_heading: float = wave("heading", "rad")

"""The gains of line-of-sight guidance with PID control."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import parameter


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class LosPidParameters:
    """Gains; docs/baselines.md describes how they were tuned."""

    guidance: str = parameter("ilos", "Line-of-sight guidance: with an integral, or adaptive (ALOS).", choices=("ilos", "alos"))
    lookahead_time: float = gain(4.0, "Lookahead distance divided by the reference's speed.", "s", "T_D")
    lookahead_distance: float = gain(9.5, "Smallest lookahead distance.", "m", "D_min", low=1e-3)
    drift_gain: float = gain(1.2, "Integral gain of the line-of-sight guidance, which compensates a drift.", "", "k_s")
    along_gain: float = gain(0.9, "Gain from the along-track error to the commanded speed.", "1/s", "k_x")
    catch_up_speed: float = gain(4.0, "Largest difference between commanded and reference speed.", "m/s", "v_e")
    surge_gain: float = gain(1.75, "Proportional gain of the speed controller.", "1/s", "k_u")
    surge_integral_gain: float = gain(0.9, "Integral gain of the speed controller.", "1/s²", "k_iu")
    yaw_bandwidth: float = gain(0.8, "Bandwidth of the heading autopilot.", "rad/s", "w_psi")
    yaw_damping: float = gain(1.3, "Damping ratio of the heading autopilot.", "", "zeta")
    yaw_integral_gain: float = gain(0.04, "Integral gain of the heading autopilot.", "1/s³", "k_ipsi")
    command_bandwidth: float = gain(2.0, "Bandwidth of the commanded-heading filter.", "rad/s", "w_c", low=1e-3)
    capture_radius: float = gain(
        0.1, "Distance in station keeping within which the ship takes the reference's heading.", "m", "R"
    )

"""Parameters of the PX4 node, which connects a boat whose autopilot is PX4 over DDS, in real time."""

from dataclasses import dataclass

from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.safety.parameters import FreshnessParameters
from vessel_hsmc_ros.scenario.common_parameters import CommonParameters, command_timeout, ramp_time


@dataclass(frozen=True)
class Px4Parameters(CommonParameters):
    """Parameters of px4, which connects the nodes with PX4 over its DDS bridge, in real time."""

    surge_force_limit: float = parameter(1.0, "The force at full throttle.", unit="N", low=1e-6, high=1e15)
    yaw_moment_limit: float = parameter(1.0, "The moment at full steering.", unit="N·m", low=1e-6, high=1e15)
    heartbeat_timeout: float = parameter(
        3.0, "Time without a VehicleStatus after which the autopilot counts as lost.", unit="s", low=0.5, high=60.0
    )
    command_timeout: float = command_timeout()
    ramp_time: float = ramp_time()
    rate_hz: float = parameter(25.0, "Rate of the setpoints; PX4 needs more than 2 Hz.", unit="Hz", low=5.0, high=200.0)
    freshness: FreshnessParameters = group(FreshnessParameters)

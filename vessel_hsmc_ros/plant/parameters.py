"""The parameters of the plant: initial state, hull, disturbances, actuators and sensors."""

import math
from dataclasses import dataclass

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.plant.actuators import ActuatorParameters
from vessel_hsmc_ros.plant.disturbance import CurrentParameters, EarthFixedParameters, PeriodicParameters
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters, initial_pose, initial_velocity
from vessel_hsmc_ros.plant.sensors import SensorParameters
from vessel_hsmc_ros.plant.waves import WaveParameters


@dataclass(frozen=True)
class DisturbanceParameters:
    """The disturbances of the plant; their wrenches add up."""

    periodic: PeriodicParameters = group(PeriodicParameters, tunable=True)
    earth_fixed: EarthFixedParameters = group(EarthFixedParameters, tunable=True)
    current: CurrentParameters = group(CurrentParameters, tunable=True)
    waves: WaveParameters = group(WaveParameters)


@dataclass(frozen=True)
class PlantParameters:
    """The plant: initial state, coefficients, disturbances, actuators and sensors."""

    initial_pose: tuple[float, ...] = initial_pose((5.0, 1.0, math.pi / 4))
    initial_velocity: tuple[float, ...] = initial_velocity()
    substeps: int = parameter(1, "Integration steps between two odometry messages.", low=1, high=1000)
    seed: int = parameter(0, "Seed of all random numbers; runs with the same seed are bit-identical.", low=0, high=2**31 - 1)
    vessel: ShipParameters = group(ShipParameters)
    disturbance: DisturbanceParameters = group(DisturbanceParameters)
    actuators: ActuatorParameters = group(ActuatorParameters)
    sensors: SensorParameters = group(SensorParameters)

    def __post_init__(self) -> None:
        if self.by_thrusters and not self.vessel.thrusters:
            raise ParameterError("vessel_sim.actuators.kind = thrusters is not allowed without vessel.thrusters.names")

    @property
    def by_thrusters(self) -> bool:
        """Whether thrusters drive the ship, not a wrench."""
        return self.actuators.kind == "thrusters"

"""An observer on a ship whose true motion is known."""

import math

import numpy as np

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.core.kinematics import wrap
from vessel_hsmc_ros.plant.devices import ActuatorParameters, SensorParameters
from vessel_hsmc_ros.plant.simulator import DisturbanceParameters, PlantParameters, Simulator

STEP = 50_000_000
POSE_ONLY = SensorParameters(position_noise=0.5, heading_noise=0.005, measures_velocity=False)


def sail(sensors=POSE_ONLY, disturbances=None, seconds=160, known=None, actuators=None, frequency=0.05, **tuning):
    """A ship that oscillates under a known wrench: estimation errors and deviations of the covariance, at 20 Hz."""
    simulator = Simulator(
        PlantParameters(
            sensors=sensors, disturbance=disturbances or DisturbanceParameters(), actuators=actuators or ActuatorParameters()
        ),
        0.05,
    )
    observer = Observer(ObserverParameters(**tuning), known or KnownVessel(**INSTANT))
    errors, claims = [], []
    wrench = (0.0, 0.0)
    for k in range(20 * seconds):
        disturbance = simulator.disturbance(0.05 * k)
        error = np.array(observer.update(k * STEP, simulator.measured(k * STEP), wrench)) - simulator.state
        error[2] = wrap(error[2])
        errors.append(error)
        claims.append(observer.deviation)
        wrench = (1e5, 1e6 * math.sin(frequency * 0.05 * k))
        simulator.advance(simulator.applied(wrench), disturbance)
    settled = slice(20 * seconds // 4, None)
    return np.array(errors)[settled], np.array(claims)[settled]


def rms(errors):
    return np.sqrt(np.mean(errors**2, axis=0))

"""The station-keeping task of VRX with the plant of this package: thrusters in, what its sensors and its scoring say out.

Names, frames and the score are those of VRX (github.com/osrf/vrx: vrx_gz/src/vrx_gz/bridges.py and payload_bridges.py,
vrx_gz/src/StationkeepingScoringPlugin.cc, vrx_gz/worlds/stationkeeping_task.sdf). The pose error is

    distance + 0.75^distance · |heading error|

in m and rad, and the score its mean over the run.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.geodesy import Plane
from vessel_hsmc_ros.core.kernel import between
from vessel_hsmc_ros.core.kinematics import Motion, wrap
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.sensors import SensorParameters
from vessel_hsmc_ros.plant.simulator import Simulator
from vessel_hsmc_ros.scenario.parameters import SimParameters

ORIGIN = -33.724223, 150.679736  # latitude and longitude of the world's origin, degrees
ANTENNA = -0.85, 0.0  # place of the GPS ahead and to port of the vessel's origin, m
RATE = 100.0  # steps a second
HEADING_DECAY = 0.75  # by which a metre of distance lessens the weight of the heading


class Goal(NamedTuple):
    """The station: x east and y north, m, and heading from east, rad."""

    x: float
    y: float
    psi: float


def pose_error(motion: Motion, goal: Goal) -> float:
    """The score of a moment, m."""
    distance = math.hypot(motion.x - goal.x, motion.y - goal.y)
    return distance + math.pow(HEADING_DECAY, distance) * abs(wrap(motion.psi - goal.psi))


class World:
    """The vessel with its thrusters, in the sea of some parameters, and the score of its station.

    As in Gazebo, a thruster holds its last thrust and angle.

    Raises:
        ParameterError: the vessel has no thrusters.

    Attributes:
        steps: Number of steps since the start.
        error, mean: Pose error of the last step, and its mean, m.
    """

    def __init__(self, parameters: SimParameters, goal: Goal) -> None:
        self.thrusters = parameters.vessel.thrusters.thrusters()
        if not self.thrusters:
            raise ParameterError("vessel.thrusters.names must name thrusters (got none)")
        perfect = replace(parameters, rate_hz=RATE, sensors=SensorParameters())
        self._plant, self.goal, self._plane = Simulator(perfect, 1.0 / RATE), goal, Plane(*ORIGIN)
        self._thrusts = [0.0] * len(self.thrusters)
        self._angles = [t.angle for t in self.thrusters]
        self.steps = 0
        self.error = self.mean = pose_error(self.motion, goal)
        self._total = 0.0
        self._before = self.motion

    @property
    def motion(self) -> Motion:
        """The true motion."""
        return self._plant.state

    @property
    def stamp(self) -> int:
        """Time since the start, ns."""
        return round(self.steps * 1e9 / RATE)

    def thrust(self, index: int, force: float) -> None:
        """Take the thrust of a thruster, N, within its limits; one that is not finite does not count."""
        t = self.thrusters[index]
        if math.isfinite(force):
            self._thrusts[index] = between(force, -t.thrust_astern, t.thrust_ahead)

    def turn(self, index: int, angle: float) -> None:
        """Take the angle of a thruster, rad, counter-clockwise; one that is not finite does not count."""
        if math.isfinite(angle):
            self._angles[index] = wrap(angle)

    def wrench(self) -> Wrench:
        """Surge and sway force, N, and yaw moment, N·m, of the thrusters."""
        parts = list(zip(self.thrusters, self._thrusts, self._angles, strict=True))
        surge = sum(force * math.cos(angle) for _, force, angle in parts)
        sway = sum(force * math.sin(angle) for _, force, angle in parts)
        yaw = sum(force * (t.x * math.sin(angle) - t.y * math.cos(angle)) for t, force, angle in parts)
        return surge, sway, yaw

    def step(self) -> None:
        """Advance by one step, and score its end. Raises SimulationError if the motion diverges."""
        self._before = self.motion
        self._plant.advance(self.wrench(), self._plant.disturbance(self.steps / RATE))
        self.steps += 1
        self.error = pose_error(self.motion, self.goal)
        self._total += self.error
        self.mean = self._total / self.steps

    def fix(self) -> tuple[float, float]:
        """Latitude and longitude of the antenna, degrees."""
        m, (ahead, port) = self.motion, ANTENNA
        c, s = math.cos(m.psi), math.sin(m.psi)
        return self._plane.coordinates(m.x + ahead * c - port * s, m.y + ahead * s + port * c)

    def goal_coordinates(self) -> tuple[float, float]:
        """Latitude and longitude of the station, degrees."""
        return self._plane.coordinates(self.goal.x, self.goal.y)

    def acceleration(self) -> tuple[float, float]:
        """Specific force ahead and to port in the last step, m/s²."""
        m, b = self.motion, self._before
        return (m.u - b.u) * RATE - m.v * m.r, (m.v - b.v) * RATE + m.u * m.r

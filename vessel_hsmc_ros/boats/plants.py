"""The plant behind other programs: as the physics of ArduPilot's simulated autopilot (SITL), and as the world of VRX.

The autopilot sends its outputs in binary: a magic number, the rate that it would like, Hz, a count of frames, and 16 or 32 pulse
widths, µs. The physics answers with a line of JSON between line breaks: time, rates and specific force of the body, and position,
attitude and velocity from north, east and down.

Names, frames and the score of VRX's station keeping: github.com/osrf/vrx, vrx_gz/src/vrx_gz/bridges.py and payload_bridges.py,
vrx_gz/src/StationkeepingScoringPlugin.cc, vrx_gz/worlds/stationkeeping_task.sdf. The score is the mean over the run of

    distance + 0.75^distance · |heading error|     in m and rad
"""

import json
import math
import socket
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from vessel_hsmc_ros.boats.autopilot import Pulses, skid_steering, thrusts, wrench_of
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.kernel import between
from vessel_hsmc_ros.core.kinematics import Motion, Plane, wrap
from vessel_hsmc_ros.core.thruster_layout import FIXED
from vessel_hsmc_ros.core.timing import NANOSECONDS
from vessel_hsmc_ros.plant.devices import SensorParameters
from vessel_hsmc_ros.plant.dynamics import Wrench
from vessel_hsmc_ros.plant.simulator import Simulator, within
from vessel_hsmc_ros.plant.thruster_plant import make_plant
from vessel_hsmc_ros.scenario.parameters import SimParameters

PACKETS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}  # the forms of a packet by their magic numbers
GRAVITY = 9.80665

SEPARATORS = ",", ":"  # the autopilot looks for the values next to the colons: after a blank it finds no vector


class Outputs(NamedTuple):
    """The outputs of a frame: the rate that the autopilot would like, Hz, the number of the frame, and pulse widths, µs."""

    rate: int
    number: int
    pulses: tuple[int, ...]


def read_outputs(packet: bytes) -> Outputs | None:
    """The outputs of a packet; None if it is not one of the autopilot."""
    form = PACKETS.get(int.from_bytes(packet[:2], "little"))
    if form is None or len(packet) != form.size:
        return None
    _, rate, number, *pulses = form.unpack(packet)
    return Outputs(rate, number, tuple(pulses))


def write_state(time: float, motion: Motion, acceleration: tuple[float, float, float]) -> bytes:
    """The answer to a frame.

    The accelerometer of a level ship shows the acceleration of the rotating body, (du - v·r, dv + u·r), and gravity.
    `acceleration`: du, dv, dr, the derivatives of the velocities in the body frame.
    """
    du, dv, _ = acceleration
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    east, north = motion.u * c - motion.v * s, motion.u * s + motion.v * c
    content = {
        "timestamp": time,
        "imu": {
            "gyro": [0.0, 0.0, -motion.r],
            "accel_body": [du - motion.v * motion.r, -(dv + motion.u * motion.r), -GRAVITY],
        },
        "position": [motion.y, motion.x, 0.0],
        "attitude": [0.0, 0.0, wrap(0.5 * math.pi - motion.psi)],
        "velocity": [north, east, 0.0],
    }
    return f"\n{json.dumps(content, separators=SEPARATORS)}\n".encode()


PORT = 9002  # where ArduPilot sends its outputs to
LONGEST_PACKET = 1024


class Wiring(NamedTuple):
    """The outputs, from 1 on, that drive the ship, and their pulse widths."""

    servos: tuple[int, ...]
    pulses: Pulses


class Physics:
    """The ship of a scenario, which sends a state for the outputs of each frame.

    A frame with the next number advances the ship by a period; one that is repeated is answered again; a number that goes back
    is a new start of the autopilot, with which the ship starts anew. `parameters`: those of the plant. The autopilot has sensors
    of its own: noise, bias and delays of these do not count. `wiring`: with thrusters an output for each, else those of skid
    steering, left and right. `time`: time of the physics, s. `frames`, `lost`, `repeated`, `starts`: numbers of frames, and of
    new starts.
    """

    def __init__(self, parameters: SimParameters, wiring: Wiring) -> None:
        self._thrusters = parameters.vessel.thrusters.thrusters() if parameters.by_thrusters else []
        if any(t.kind != FIXED for t in self._thrusters):
            raise ParameterError("vessel.thrusters.kinds must all be fixed with ardupilot")
        if len(wiring.servos) != (count := len(self._thrusters) or 2):
            raise ParameterError(f"--servos must be {count} numbers (got {','.join(map(str, wiring.servos))})")
        self._limits = within(parameters.actuators, parameters.vessel)
        limits = self._limits.surge_force_limit, self._limits.yaw_moment_limit
        if not self._thrusters and math.inf in limits:
            raise ParameterError(
                "vessel.surge_force_limit and vessel.yaw_moment_limit must be finite with ardupilot, for full throttle and"
                f" steering (got {limits[0]:g} N and {limits[1]:g} N·m)"
            )
        self._wiring, self._period = wiring, 1.0 / parameters.rate_hz
        self._plant = make_plant(replace(parameters, sensors=SensorParameters()), self._period)
        self.frames = self.lost = self.repeated = self.starts = 0
        self._number = -1
        self._begin()

    def _begin(self) -> None:
        self._plant.reset()
        self._steps = 0
        self._before = self._plant.measured(0)
        self._answer = b""

    @property
    def time(self) -> float:
        """Time of the physics, s."""
        return self._steps * self._period

    def answer(self, outputs: Outputs) -> bytes:
        """The state after a frame."""
        if outputs.number == self._number and self._answer:
            self.repeated += 1
            return self._answer
        if outputs.number < self._number or self._number < 0:
            self.starts += 1
            self._begin()
        else:
            self.lost += outputs.number - self._number - 1
        self._number = outputs.number
        self.frames += 1
        pulses, share = outputs.pulses, self._wiring.pulses.share
        self._answer = self._advance([share(pulses[n - 1]) if n <= len(pulses) else 0.0 for n in self._wiring.servos])
        return self._answer

    def _advance(self, shares: Sequence[float]) -> bytes:
        if self._thrusters:
            wrench = self._plant.applied_thrusts(thrusts(shares, self._thrusters), [t.angle for t in self._thrusters])
        else:
            limits = self._limits.surge_force_limit, self._limits.yaw_moment_limit
            wrench = self._plant.applied(skid_steering(shares, limits))
        self._plant.advance(wrench, self._plant.disturbance(self.time))
        self._steps += 1
        now = self._plant.measured(round(self.time * NANOSECONDS))
        du, dv, dr = ((b - a) / self._period for a, b in zip(self._before[3:], now[3:], strict=True))
        self._before = now
        return write_state(self.time, now, (du, dv, dr))


def serve(physics: Physics, address: tuple[str, int], duration: float, report: Callable[[str], None]) -> None:
    """Answer the frames that come to an address until the physics has reached a time."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        try:
            server.bind(address)
        except OSError as error:
            raise RunError(f"{address[0]}:{address[1]} cannot be listened on: {error.strerror}") from None
        host, port = server.getsockname()
        report(f"waiting for ArduPilot on {host}:{port}: start it with --model JSON:{host}")
        server.settimeout(1.0)
        starts = 0
        while not duration or physics.time < duration:
            try:
                packet, sender = server.recvfrom(LONGEST_PACKET)
            except TimeoutError:  # a moment in which Ctrl-C has its effect
                continue
            if (outputs := read_outputs(packet)) is None:
                continue
            server.sendto(physics.answer(outputs), sender)
            if physics.starts != starts:
                starts = physics.starts
                report(f"autopilot at {sender[0]}:{sender[1]}, which would like {outputs.rate} Hz: the ship starts")


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

    As in Gazebo, a thruster holds its last thrust and angle. `steps`: number of steps since the start. `error`, `mean`: pose
    error of the last step, and its mean, m.
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
        return wrench_of(self.thrusters, self._thrusts, self._angles)

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

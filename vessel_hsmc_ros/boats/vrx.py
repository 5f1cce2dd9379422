"""The plant behind the topics of VRX, many times faster than Gazebo: for teams that try their software without it.

    python -m vessel_hsmc_ros.boats.vrx --speed 10 --goal 10,5,0.5

subscribes to  /wamv/thrusters/<name>/thrust and .../pos (std_msgs/Float64)
publishes      /clock; /wamv/sensors/gps/gps/fix (NavSatFix, 20 Hz); /wamv/sensors/imu/imu/data (Imu, 100 Hz);
               /vrx/stationkeeping/goal (PoseStamped: latitude, longitude), .../pose_error, .../mean_pose_error (Float32)

Other nodes need `use_sim_time: true`. The vessel is the WAM-V 16 of the library in calm water, with the thrusters left and right,
or that of a scenario with thrusters, with its wind, waves and current. A machine that is too slow slows the clock; it loses no
step.
"""

import argparse
import contextlib
import sys
import time
from functools import partial
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float32, Float64

from vessel_hsmc_ros.boats.plants import RATE, Goal, World
from vessel_hsmc_ros.core.exceptions import ParameterError, VesselHsmcError
from vessel_hsmc_ros.core.kinematics import GRAVITY, quaternion_from_heading
from vessel_hsmc_ros.nodes.executor import Queues
from vessel_hsmc_ros.scenario.own_ship import scenario_for
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel

FIX_EVERY, GOAL_EVERY = 5, 100  # steps between two fixes, and between two goals and clocks of slower readers
FRAME = "wamv/wamv"
BEHIND = 0.2  # time by which the steps may be behind before the pace begins anew, s: a slow machine does not catch up in a rush


class Vrx(Node):
    """Publishes what the world's sensors and scoring say, and takes the thrusts. `world`: the plant."""

    def __init__(self, world: World, **options: Any) -> None:
        super().__init__("vrx", **options)
        self.world = world
        inputs = []
        for index, thruster in enumerate(world.thrusters):
            for name, take in (("thrust", world.thrust), ("pos", world.turn)):
                topic = f"/wamv/thrusters/{thruster.name}/{name}"
                inputs.append(self.create_subscription(Float64, topic, partial(self._take, take, index), 1))
        self._queues = Queues(inputs, burst=1)
        sensor = qos_profile_sensor_data
        self._clock = self.create_publisher(Clock, "/clock", 10)
        self._fix = self.create_publisher(NavSatFix, "/wamv/sensors/gps/gps/fix", sensor)
        self._imu = self.create_publisher(Imu, "/wamv/sensors/imu/imu/data", sensor)
        self._goal = self.create_publisher(PoseStamped, "/vrx/stationkeeping/goal", 10)
        self._errors = [self.create_publisher(Float32, f"/vrx/stationkeeping/{n}", 10) for n in ("pose_error", "mean_pose_error")]

    @staticmethod
    def _take(take: Any, index: int, message: Float64) -> None:
        take(index, message.data)

    def listen(self) -> None:
        """Take the latest thrusts and angles; without an executor, whose turn takes longer than several steps."""
        self._queues.serve()

    def step(self) -> None:
        """Advance the world by one step, and publish what is due."""
        world = self.world
        world.step()
        stamp = Time(sec=world.stamp // 10**9, nanosec=world.stamp % 10**9)
        self._clock.publish(Clock(clock=stamp))
        self._imu.publish(self._imu_message(stamp))
        if world.steps % FIX_EVERY == 0:
            fix = NavSatFix()
            fix.header.stamp, fix.header.frame_id = stamp, f"{FRAME}/gps_wamv_link"
            fix.latitude, fix.longitude = world.fix()
            self._fix.publish(fix)
            for publisher, value in zip(self._errors, (world.error, world.mean), strict=True):
                publisher.publish(Float32(data=value))
        if world.steps % GOAL_EVERY == 0:
            self._publish_goal(stamp)

    def _imu_message(self, stamp: Time) -> Imu:
        m, imu = self.world.motion, Imu()
        imu.header.stamp, imu.header.frame_id = stamp, f"{FRAME}/imu_wamv_link"
        imu.orientation.z, imu.orientation.w = quaternion_from_heading(m.psi)
        imu.angular_velocity.z = m.r
        imu.linear_acceleration.x, imu.linear_acceleration.y = self.world.acceleration()
        imu.linear_acceleration.z = GRAVITY
        return imu

    def _publish_goal(self, stamp: Time) -> None:
        goal = PoseStamped()
        goal.header.stamp = stamp
        goal.pose.position.x, goal.pose.position.y = self.world.goal_coordinates()
        goal.pose.orientation.z, goal.pose.orientation.w = quaternion_from_heading(self.world.goal.psi)
        self._goal.publish(goal)

    def run(self, speed: float, duration: float) -> None:
        """Step at a multiple of real time until some simulated time, s, is over; 0: until a signal ends it."""
        begun, first = time.monotonic(), self.world.steps
        while rclpy.ok(context=self.context) and (not duration or self.world.steps < duration * RATE):
            self.listen()
            ahead = (self.world.steps - first) / RATE / speed - (time.monotonic() - begun)
            if ahead < -BEHIND:
                begun, first = time.monotonic(), self.world.steps
            if ahead > 0.0:
                time.sleep(min(ahead, 0.01))
            else:
                self.step()


def wam_v() -> Scenario:
    """The WAM-V 16 in calm water."""
    return parse_scenario(scenario_for(read_vessel("wam_v_16").values, "wam_v_16", thrusters=True), "vrx")


def read_goal(text: str) -> Goal:
    """The station of an option. Raises ParameterError if it is none."""
    try:
        return Goal(*map(float, text.split(",")))
    except (TypeError, ValueError):
        raise ParameterError(f"--goal must be x,y,heading in m and rad from east, such as 10,5,0.5 (got {text})") from None


def main(arguments: list[str] | None = None) -> int:
    """Serve the plant of a scenario until a signal or its duration ends it."""
    parser = argparse.ArgumentParser(prog="vrx", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("scenario", nargs="?", help="a scenario whose vessel has thrusters, or its file; the WAM-V by default")
    parser.add_argument("--speed", type=float, default=1.0, help="multiple of real time")
    parser.add_argument("--goal", default="0,0,0", help="station: x,y,heading")
    parser.add_argument("--duration", type=float, default=0.0, help="simulated time after which it ends, s; 0: never")
    given = parser.parse_args(arguments)
    try:
        if not given.speed > 0.0:
            raise ParameterError(f"--speed must be above 0 (got {given.speed:g})")
        world = World((load_scenario(given.scenario) if given.scenario else wam_v()).vessel_sim, read_goal(given.goal))
        rclpy.init()
        node = Vrx(world)
        with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
            node.run(given.speed, given.duration)
        print(f"{world.steps / RATE:.1f} s simulated, mean pose error {world.mean:.3f} m")
    except VesselHsmcError as error:
        print(f"vrx: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

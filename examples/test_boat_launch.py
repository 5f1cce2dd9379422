"""A test of a boat by launch, to copy: it starts boat, reference and controller, and waits until the boat follows its path.

launch_test examples/test_boat_launch.py        # in a sourced workspace; or pytest, in a version below 8
"""

import math
import sys
import time
import unittest
from functools import partial
from pathlib import Path

import pytest

REASON = "comes with a ROS install only: source it, colcon build, and run this again"
launch_testing = pytest.importorskip("launch_testing.actions", reason=f"launch_testing {REASON}")

import rclpy  # noqa: E402
from ament_index_python import get_package_share_directory  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from launch.actions import ExecuteProcess, IncludeLaunchDescription  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rclpy.qos import qos_profile_sensor_data  # noqa: E402

from launch import LaunchDescription  # noqa: E402

BOAT = Path(__file__).with_name("my_boat.py")
CONTROLLER = Path(get_package_share_directory("vessel_hsmc_ros"), "launch", "controller.launch.py")


@pytest.mark.launch_test
def generate_test_description():
    """What is launched."""
    boat = ExecuteProcess(cmd=[sys.executable, str(BOAT), "--boat"])
    controller = IncludeLaunchDescription(str(CONTROLLER), launch_arguments=[("params_file", str(BOAT.with_suffix(".yaml")))])
    return LaunchDescription([boat, controller, launch_testing.ReadyToTest()])


class TestBoat(unittest.TestCase):
    """The boat's motion while all runs."""

    def setUp(self):
        rclpy.init()
        self.addCleanup(rclpy.shutdown)
        self.node, self.latest = rclpy.create_node("test"), {}
        for kind, topic in ((Odometry, "odom"), (PoseStamped, "reference/pose")):
            self.node.create_subscription(kind, topic, partial(self.latest.__setitem__, topic), qos_profile_sensor_data)

    def test_the_boat_follows_its_path(self):
        deadline = time.monotonic() + 90.0
        while not self.follows():
            assert time.monotonic() < deadline, f"it does not follow: {self.latest}"
            rclpy.spin_once(self.node, timeout_sec=1.0)

    def follows(self):
        """Whether the boat has made way and is close to its reference."""
        if len(self.latest) < 2:
            return False
        at, wanted = self.latest["odom"].pose.pose.position, self.latest["reference/pose"].pose.position
        return at.x > 4.0 and math.hypot(at.x - wanted.x, at.y - wanted.y) < 0.5

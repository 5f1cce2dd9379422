"""The launch file, launched. It needs what comes with a ROS install only; test_run.py makes the same assertions without."""

import tempfile
import time
import unittest
from pathlib import Path

import pytest

WHERE_TO_RUN = "comes with a ROS install only: source it, colcon build, and run this again"
launch = pytest.importorskip("launch", reason=f"launch {WHERE_TO_RUN}")
launch_testing = pytest.importorskip("launch_testing", reason=f"launch_testing {WHERE_TO_RUN}")
pytest.importorskip("launch_ros", reason=f"launch_ros {WHERE_TO_RUN}")

import rclpy  # noqa: E402
from launch.actions import IncludeLaunchDescription  # noqa: E402
from launch.launch_description_sources import PythonLaunchDescriptionSource  # noqa: E402
from launch_testing.actions import ReadyToTest  # noqa: E402
from launch_testing.asserts import assertExitCodes  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

from vessel_hsmc_ros.core.install_paths import share_directory  # noqa: E402
from vessel_hsmc_ros.nodes import qos  # noqa: E402

OUTPUT = Path(tempfile.mkdtemp(prefix="launched_"))
SCENARIO = OUTPUT / "ten_seconds.yaml"
SCENARIO.write_text("/**/vessel_sim: {ros__parameters: {duration: 10.0}}\n")
NAMESPACE = "launched"


@pytest.mark.launch_test
def generate_test_description():
    source = PythonLaunchDescriptionSource(str(share_directory() / "launch" / "closed_loop.launch.py"))
    arguments = {"scenario": SCENARIO, "namespace": NAMESPACE, "output": OUTPUT, "record": "true", "law": "hierarchical_printed"}
    included = IncludeLaunchDescription(source, launch_arguments=[(key, str(value)) for key, value in arguments.items()])
    return launch.LaunchDescription([included, ReadyToTest()])


class TestTheClosedLoop(unittest.TestCase):
    def test_it_runs_to_its_end(self, proc_info):
        context = rclpy.Context()
        rclpy.init(context=context, args=[])
        node = rclpy.create_node("listener", context=context)
        odometry = []
        node.create_subscription(Odometry, f"/{NAMESPACE}/odom", odometry.append, qos.LOSSLESS)
        executor = rclpy.executors.SingleThreadedExecutor(context=context)
        executor.add_node(node)
        end = time.monotonic() + 60.0
        while not odometry and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.1)
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
        assert odometry
        proc_info.assertWaitForShutdown(process="vessel_sim_node", timeout=30.0)


@launch_testing.post_shutdown_test()
class TestAfterwards(unittest.TestCase):
    def test_every_node_ended_well(self, proc_info):
        assertExitCodes(proc_info)

    def test_the_bag_is_complete(self):
        (bag,) = OUTPUT.glob("*/bag")
        with AnyReader([bag]) as reader:
            counts = {c.topic: c.msgcount for c in reader.connections}
        assert counts[f"/{NAMESPACE}/odom"] == counts[f"/{NAMESPACE}/controller/state"] == counts["/clock"] == 1001

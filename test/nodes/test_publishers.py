"""Which publishers of a topic live, of those that the ROS graph shows."""

import subprocess
import sys
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest
from durations import rest_long
from geometry_msgs.msg import WrenchStamped

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.connections import SETTLED, UNKNOWN, Publishers

PROGRAM = """
import rclpy
from geometry_msgs.msg import WrenchStamped
from vessel_hsmc_ros.nodes import qos
rclpy.init()
node = rclpy.create_node("other")
publisher = node.create_publisher(WrenchStamped, "cmd_wrench", qos.{profile})
node.create_timer(0.1, lambda: publisher.publish(WrenchStamped()))
rclpy.spin(node)
"""
OFFERED, PLAIN = "offered(False, 10.0)", "STREAM"

DEATH = 12.0
"""Time within which a killed process must be found, s: less than the 20 s for which the graph shows it."""


@pytest.fixture
def start() -> Iterator[Any]:
    processes: list[subprocess.Popen[bytes]] = []

    def started(profile: str) -> subprocess.Popen[bytes]:
        processes.append(subprocess.Popen([sys.executable, "-c", PROGRAM.format(profile=profile)]))
        return processes[-1]

    yield started
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.parametrize("other", rest_long([OFFERED, PLAIN]))
def test_a_killed_publisher_does_not_count_although_the_graph_shows_it(bench: Any, start: Any, other: str) -> None:
    publishers = Publishers(bench.probe, WrenchStamped, "cmd_wrench")
    first = start(OFFERED)
    bench.until(lambda: publishers.count() == 1)
    start(other)
    bench.until(lambda: publishers.count() == 2)
    first.kill()
    bench.until(lambda: publishers.count() == 1, DEATH)
    assert bench.probe.count_publishers("cmd_wrench") == 2
    assert publishers.watching


@pytest.mark.parametrize("profile", rest_long([OFFERED, PLAIN]))
def test_publishers_that_live_all_count(bench: Any, start: Any, profile: str) -> None:
    publishers = Publishers(bench.probe, WrenchStamped, "cmd_wrench")
    bench.probe.create_publisher(WrenchStamped, "cmd_wrench", qos.offered(False, 10.0))
    start(profile)
    bench.until(lambda: publishers.count() == 2)
    end = time.monotonic() + SETTLED + 2.0
    bench.until(lambda: time.monotonic() > end or publishers.count() != 2)
    assert publishers.count() == 2
    assert publishers.conflict().startswith("/cmd_wrench has 2 publishers and may have one")
    assert publishers.conflict().endswith(f"They are /other, {bench.probe.get_fully_qualified_name()}")
    assert publishers.others() == "/other"


@pytest.mark.parametrize(
    ("names", "others"),
    [
        (["own", "pd"], "/pd"),
        (["own", "own"], "/own"),
        (["own", "pd", "course"], "/course, /pd"),
        (["own", UNKNOWN], "a node whose name is not known yet"),
    ],
)
def test_the_other_publishers_of_a_topic_are_named(names: list[str], others: str) -> None:
    own = SimpleNamespace(
        resolve_topic_name=lambda topic: f"/{topic}",
        get_fully_qualified_name=lambda: "/own",
        get_publishers_info_by_topic=lambda _: [SimpleNamespace(node_namespace="/", node_name=name) for name in names],
    )
    assert Publishers(cast("Any", own), WrenchStamped, "cmd_wrench").others() == others

import math
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry, Path
from vessel_hsmc_msgs.msg import ReferenceState
from visualization_msgs.msg import Marker, MarkerArray

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.markers import SPACING, MarkerNode

STEP = 10_000_000


@pytest.fixture
def sail(bench: Any) -> Any:
    """Publishes odometry of a pose and a time repeatedly until the markers show it."""
    odometry, markers = bench.publisher(Odometry, "odom", lockstep=False), bench.collect(MarkerArray, "markers", qos.STREAM)

    def at(step: Any, x: Any, heading: float = 0.0) -> Any:
        message = conv.new_odometry()
        conv.write_odometry(message, conv.time_message(step * STEP), np.array([x, 2.0, heading, 1.0, 0.0, 0.0]))

        def seen() -> Any:
            odometry.publish(message)
            return markers and conv.nanoseconds(markers[-1].markers[0].header.stamp) == step * STEP

        bench.until(seen)
        return markers[-1].markers

    return at


def test_a_hull_is_shown_at_the_pose_of_the_ship_and_none_for_a_missing_reference(bench: Any, sail: Any) -> None:
    bench.start(MarkerNode, hull__length=40.0, hull__beam=10.0)
    (ship,) = sail(7, 3.0, heading=math.pi / 2)
    assert (ship.ns, ship.type, ship.header.frame_id) == ("ship", Marker.TRIANGLE_LIST, "odom")
    assert (ship.pose.position.x, ship.pose.position.y) == (3.0, 2.0)
    assert ship.pose.orientation.z == pytest.approx(math.sqrt(0.5))
    assert len(ship.points) % 3 == 0
    assert max(p.x for p in ship.points) - min(p.x for p in ship.points) == pytest.approx(40.0)
    assert max(p.y for p in ship.points) - min(p.y for p in ship.points) == pytest.approx(10.0)


def test_the_sides_of_a_fence_are_lines_in_the_frame_of_the_odometry(bench: Any, sail: Any) -> None:
    bench.start(MarkerNode, fence__outside=[0.0, 0.0, 10.0, 0.0, 10.0, 10.0, 0.0, 0.0])
    ship, fence = sail(7, 3.0)
    assert (ship.ns, fence.ns, fence.type, fence.header.frame_id) == ("ship", "fence", Marker.LINE_LIST, "odom")
    assert [(p.x, p.y) for p in fence.points] == [(0, 0), (10, 0), (10, 0), (10, 10), (10, 10), (0, 0)]


def test_the_reference_has_a_hull_and_a_path_of_its_own(bench: Any, sail: Any) -> None:
    references, paths = (
        bench.publisher(ReferenceState, "reference", lockstep=False),
        bench.collect(Path, "reference/path", qos.STREAM),
    )
    bench.start(MarkerNode)
    message = conv.new_reference()
    conv.write_reference(message, conv.time_message(STEP), np.array([9.0, 1.0, 0.0, 2.0, 0.0, 0.0]), np.zeros(3))
    bench.until(lambda: references.publish(message) or paths)
    assert paths[-1].poses[0].pose.position.x == 9.0
    bench.until(lambda: len(sail(1, 0.0)) == 2)


def test_a_path_takes_a_stamped_pose_each_half_metre_and_drops_the_oldest(bench: Any, sail: Any) -> None:
    paths = bench.collect(Path, "ship/path", qos.STREAM)
    bench.start(MarkerNode, rate_hz=100.0, path_rate_hz=50.0, path_poses=5)
    for step in range(20):
        sail(step, 0.2 * step)
    bench.until(lambda: paths and conv.nanoseconds(paths[-1].header.stamp) == 19 * STEP)
    poses = paths[-1].poses
    assert len(poses) == 5
    places = [pose.pose.position.x for pose in poses]
    assert np.diff(places) == pytest.approx(0.6)  # the first beyond SPACING
    assert places[-1] == pytest.approx(3.6), "the oldest are left out"
    assert SPACING == 0.5
    assert [conv.nanoseconds(pose.header.stamp) // STEP for pose in poses] == [round(x / 0.2) for x in places]


def test_where_tf2_is_installed_the_transform_is_that_of_the_odometry(bench: Any, sail: Any) -> None:
    kind = pytest.importorskip("tf2_msgs.msg", reason="tf2_msgs comes with a ROS install only").TFMessage
    transforms = bench.collect(kind, "/tf", qos.STREAM)
    bench.start(MarkerNode)
    sail(3, 4.0)
    (transform,) = bench.until(lambda: transforms and transforms[-1].transforms)
    assert isinstance(transform, TransformStamped)
    assert (transform.header.frame_id, transform.child_frame_id, transform.transform.translation.x) == ("odom", "base_link", 4.0)

"""The transform of the odometry: what it has, who publishes it, and that one node does by default."""

import math
import sys
from types import SimpleNamespace
from typing import Any, cast

import pytest
from geometry_msgs.msg import TransformStamped
from hypothesis import given
from hypothesis import strategies as st
from nav_msgs.msg import Odometry

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes.odometry_output import transform_of, transform_publisher
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS
from vessel_sim_node.node import VesselSimNode

PLACES = st.floats(-1e6, 1e6)
SOURCES = ("vessel_sim", "navsat_odom", "mavlink", "px4")


@pytest.mark.long
@given(x=PLACES, y=PLACES, psi=st.floats(-math.pi, math.pi), frame=st.text(max_size=9), child=st.text(max_size=9))
def test_the_transform_has_pose_frames_and_stamp_of_the_odometry(x: float, y: float, psi: float, frame: str, child: str) -> None:
    odometry = conv.new_odometry()
    odometry.header.frame_id, odometry.child_frame_id = frame, child
    conv.write_odometry(odometry, conv.time_message(1_234_567_890), Motion(x, y, psi, 1.0, 2.0, 3.0))
    transform = transform_of(odometry)
    assert transform.header == odometry.header
    assert transform.child_frame_id == child
    translation = transform.transform.translation
    assert (translation.x, translation.y, translation.z) == (x, y, 0.0)
    assert transform.transform.rotation == odometry.pose.pose.orientation


class Topic(list[tuple[str, str, int]]):
    """A publisher that keeps frames and stamps of its messages: the odometry that they refer to is written anew each time."""

    def publish(self, message: Any) -> None:
        (transform,) = message.transforms
        assert isinstance(transform, TransformStamped)
        self.append((transform.header.frame_id, transform.child_frame_id, conv.nanoseconds(transform.header.stamp)))


@pytest.fixture
def tf2(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message of /tf, which no wheel has."""
    monkeypatch.setitem(sys.modules, "tf2_msgs", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", cast("Any", SimpleNamespace(TFMessage=SimpleNamespace)))


class PublishingSim(VesselSimNode):
    """The plant's node, whose /tf is kept."""

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: Any, **options: Any) -> Any:
        if topic != "/tf":
            return super().create_publisher(msg_type, topic, qos_profile, **options)
        self.transforms = Topic()
        return self.transforms


@pytest.mark.usefixtures("tf2")
def test_the_plant_publishes_the_transform_of_each_odometry_where_that_is_wanted(bench: Any) -> None:
    received = bench.collect(Odometry, "boat/odom", 10)
    node = bench.start(PublishingSim, lockstep=False, namespace="boat", publish_tf=True, frame_prefix="boat/")
    bench.until(lambda: len(node.transforms) > 2 and received)
    assert {sent[:2] for sent in node.transforms} == {("boat/odom", "boat/base_link")}
    assert conv.nanoseconds(received[0].header.stamp) in {sent[2] for sent in node.transforms}


@pytest.mark.usefixtures("tf2")
def test_by_default_no_source_of_odometry_publishes_it_and_the_marker_node_does() -> None:
    for name in SOURCES:
        parameters = {**NODES, **WATCHERS}[name]
        assert schema.entries(parameters)["publish_tf"].default is False
        node = SimpleNamespace(NAME=name, parameters=SimpleNamespace(publish_tf=False), create_publisher=pytest.fail)
        transform_publisher(cast("Any", node))(Odometry())
    assert schema.entries(WATCHERS["markers"])["publish_tf"].default is True


@pytest.mark.parametrize("name", SOURCES)
def test_a_transform_that_cannot_be_published_is_refused_at_the_start(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setitem(sys.modules, "tf2_msgs.msg", None)
    monkeypatch.setitem(sys.modules, "tf2_msgs", None)
    node = SimpleNamespace(NAME=name, parameters=SimpleNamespace(publish_tf=True))
    with pytest.raises(InstallationError, match=rf"^{name}.publish_tf must be false without tf2_msgs.*\(got true\)$"):
        transform_publisher(cast("Any", node))

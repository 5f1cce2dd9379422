"""The marker node: ship and reference as shapes, paths and a transform, for RViz, Foxglove and the like.

It takes only the latest odometry and reference, a few times a second and best effort, so that its load on a run is negligible.
"""

import math
from collections.abc import Iterable
from functools import partial
from typing import Any

from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Odometry, Path
from std_msgs.msg import ColorRGBA
from vessel_hsmc_msgs.msg import ReferenceState
from visualization_msgs.msg import Marker, MarkerArray

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.fence import Fence, fence_of
from vessel_hsmc_ros.core.hull import triangles
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WATCHER_NICENESS, VesselNode
from vessel_hsmc_ros.nodes.odometry_output import transform_publisher
from vessel_hsmc_ros.scenario.parameters import MarkerParameters

SPACING = 0.5  # distance between two poses of a path, m
COLOURS = {"ship": (0.0, 0.45, 0.70, 0.9), "reference": (0.84, 0.37, 0.0, 0.4)}
FENCE_COLOUR, FENCE_WIDTH = (0.8, 0.2, 0.2, 0.9), 0.2  # of the sides of the fence, m


class MarkerNode(VesselNode):
    """Publishes `markers`, with the fence, paths, and /tf where tf2_msgs is installed, in the frames of the odometry."""

    NAME = "markers"
    INTERFACE = """
        subscribes to  odom, reference
        publishes      markers, ship/path, reference/path, /tf (where tf2_msgs is installed)
    """
    PARAMETERS = MarkerParameters
    NICENESS = WATCHER_NICENESS
    POLL_PERIOD = 0.05

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._latest: dict[str, Any] = {}
        self._paths = {name: Path() for name in COLOURS}
        hull = triangles(self.parameters.hull.of(self.parameters.vessel))
        self._ships = [self._shape(name, Marker.TRIANGLE_LIST, colour, hull) for name, colour in COLOURS.items()]
        fence = fence_of(self.parameters.fence, "markers.fence")
        self._fence = None if fence is None else self._lines(fence)
        self._marker_publisher = self.create_publisher(MarkerArray, "markers", qos.STREAM)
        self._path_publishers = {name: self.create_publisher(Path, f"{name}/path", qos.STREAM) for name in COLOURS}
        try:
            self._publish_transform = transform_publisher(self)
        except InstallationError:
            self.get_logger().info("tf2_msgs is not installed: no transform is published; the frame odom needs none")
            self._publish_transform = lambda _: None
        for kind, topic, name in ((Odometry, "odom", "ship"), (ReferenceState, "reference", "reference")):
            subscription = self.create_subscription(kind, topic, partial(self._latest.__setitem__, name), qos.LATEST)
            self.direct_subscriptions.append(subscription)
        self.create_timer(1.0 / self.parameters.rate_hz, self._publish, clock=self.wall)
        self.create_timer(1.0 / self.parameters.path_rate_hz, self._publish_paths, clock=self.wall)

    def _lines(self, fence: Fence) -> Marker:
        """The sides of a fence as lines."""
        ends = [place for side in zip(fence.begin, fence.end, strict=True) for place in side]
        marker = self._shape("fence", Marker.LINE_LIST, FENCE_COLOUR, [(place.real, place.imag) for place in ends])
        marker.scale.x = FENCE_WIDTH
        return marker

    def _shape(self, name: str, kind: int, colour: tuple[float, ...], points: Iterable[Any]) -> Marker:
        """A marker of points in the plane; its frame is that of the latest message."""
        marker = Marker(ns=name, id=[*COLOURS, "fence"].index(name), type=kind, action=Marker.ADD)
        marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        marker.color = ColorRGBA(**dict(zip("rgba", colour, strict=True)))
        marker.points = [Point(x=float(x), y=float(y), z=0.0) for x, y in points]
        return marker

    def _publish(self) -> None:
        """Update markers and paths from the latest messages, and publish the markers and the transform."""
        # Without a message there is no pose: a hull at the origin would be wrong.
        known = [marker for marker in self._ships if marker.ns in self._latest]
        for marker in known:
            message = self._latest[marker.ns]
            marker.header, marker.pose = message.header, message.pose.pose if marker.ns == "ship" else message.pose
            self.stamp = conversions.nanoseconds(message.header.stamp)
            self._extend(marker.ns, marker)
        ship = self._latest.get("ship")
        if self._fence and ship:
            self._fence.header = ship.header
            known.append(self._fence)
        if known:
            self._marker_publisher.publish(MarkerArray(markers=known))
        if ship:
            self._publish_transform(ship)

    def _extend(self, name: str, marker: Marker) -> None:
        """Append the pose of a marker to a path if it is at least SPACING from the last one."""
        path, position = self._paths[name], marker.pose.position
        path.header = marker.header
        last = path.poses[-1].pose.position if path.poses else None
        if last is None or math.hypot(position.x - last.x, position.y - last.y) >= SPACING:
            path.poses.append(PoseStamped(header=marker.header, pose=marker.pose))
            del path.poses[: -self.parameters.path_poses]  # the oldest, so that the message stays bounded

    def _publish_paths(self) -> None:
        """Publish paths that have a subscriber: they are the longest messages and cost the most."""
        for name, publisher in self._path_publishers.items():
            if self._paths[name].poses and publisher.get_subscription_count():
                publisher.publish(self._paths[name])

    def status(self) -> tuple[bytes, str, dict[str, Any]]:
        """Number of poses in each path."""
        return OK, "publishing", {f"{name}_path": len(path.poses) for name, path in self._paths.items()}

"""A client of running nodes: finds them, calls their services, changes their parameters, sends them goals and paths."""

import math
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from typing import Any, NamedTuple, TypeVar

import rclpy
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rcl_interfaces.msg import ParameterDescriptor
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParametersAtomically
from rclpy.action import ActionClient, get_action_names_and_types
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import NavSatFix
from vessel_hsmc_msgs.msg import Event, ReferenceState

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.core.install_paths import discovery
from vessel_hsmc_ros.core.kinematics import Motion
from vessel_hsmc_ros.core.node_list import REFERENCE
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.topics import DATUM, EVENTS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.node_parameters import plain
from vessel_hsmc_ros.nodes.ros_environment import loopback_down, start_error
from vessel_hsmc_ros.nodes.vessel_sight import read_datum
from vessel_hsmc_ros.scenario.parameters import NODES, WATCHERS

DISCOVERY_LIMIT = 5.0
"""Longest search for a node, s; with the package's profile of Fast DDS nodes find each other within a second."""

ANSWER_LIMIT, REPEAT_AFTER = 6.0, 2.0
"""Longest wait for a response, s, and the time after which a request is repeated: a response is lost if the server has not
discovered the client yet."""

CONFIRMATION_LIMIT = 2.0  # longest wait for the event that confirms a message, s
PLANNING_LIMIT = 8.0  # further wait for a path, s, which a busy machine plans slowly; a refusal is known before
T = TypeVar("T")


class Service(NamedTuple):
    """A service of a node: the node's name, the service's name below it, and its type."""

    node: str
    name: str
    kind: Any


class Remote:
    """A connection with the nodes of one vessel, on a ROS context of its own; a context manager.

    `namespace`: the vessel's namespace, without slashes at its ends. `node`: the node through which it communicates; its name is
    hidden, so that recorders ignore it.
    """

    def __init__(self, namespace: str = "") -> None:
        self._prefix = f"/{namespace}/" if namespace else "/"
        self._context = rclpy.Context()
        try:
            rclpy.init(context=self._context, args=[], signal_handler_options=SignalHandlerOptions.NO)
            with discovery():
                self.node = rclpy.create_node(
                    f"_vessel_hsmc_{os.getpid()}", context=self._context, start_parameter_services=False, enable_rosout=False
                )
        except RuntimeError as error:
            raise RunError(f"cannot connect: {start_error(error)}") from None
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def __enter__(self) -> "Remote":
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def name(self, relative: str) -> str:
        """The full name of a node or a topic of the vessel; one with a leading slash is returned as it is."""
        return relative if relative.startswith("/") else self._prefix + relative

    def until(self, condition: Callable[[], T], limit: float) -> T:
        """Serve callbacks until a condition holds, at most for a time, s; returns the condition's last value."""
        end = time.monotonic() + limit
        while not (result := condition()) and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)
        return result

    def nodes(self) -> list[str]:
        """Full names of the nodes in the domain, without hidden ones."""
        names = self.node.get_node_names_and_namespaces()
        return sorted({f"{namespace.rstrip('/')}/{name}" for name, namespace in names if not name.startswith("_")})

    def require(self, *names: str) -> None:
        """Wait until nodes of the vessel are in the ROS graph."""

        def missing() -> list[str]:
            there = self.nodes()
            return [self.name(name) for name in names if self.name(name) not in there]

        if not self.until(lambda: not missing(), DISCOVERY_LIMIT):
            raise RunError(self._not_found(missing()))

    def connect(self, services: Sequence[Service]) -> list[Client]:
        """Clients of services that are all ready, so that a call of several nodes reaches all of them or none."""
        self.require(*(service.node for service in services))
        names = [f"{self.name(service.node)}/{service.name}" for service in services]
        clients = [self.node.create_client(service.kind, name) for service, name in zip(services, names, strict=True)]
        if not self.until(lambda: all(client.service_is_ready() for client in clients), DISCOVERY_LIMIT):
            lacking = [name for client, name in zip(clients, names, strict=True) if not client.service_is_ready()]
            raise RunError(f"no service {', '.join(lacking)} within {DISCOVERY_LIMIT:g} s: is it a node of this package?")
        return clients

    def call(self, client: Client, request: Any) -> Any:
        """Call a service and return its response. Raises RunError if no response was received in time."""
        end = time.monotonic() + ANSWER_LIMIT
        while (left := end - time.monotonic()) > 0.0:
            future = client.call_async(request)
            if self.until(future.done, min(left, REPEAT_AFTER)):
                return future.result()
        raise RunError(f"no response from {client.srv_name} within {ANSWER_LIMIT:g} s: does its node hang?")

    def publish(self, message: Any, topic: str, reader: str, patience: float = 0.0) -> str:
        """Publish one message for a node.

        `topic`: relative to the vessel's namespace. `reader`: the node that has to receive it and confirms it by an event.
        `patience`: further wait for the event if the node does not report a problem, s. Returns the text of the event; empty if
        none was received in time.
        """
        events: list[Event] = []
        statuses: dict[str, DiagnosticStatus] = {}

        def take_status(message: DiagnosticArray) -> None:
            statuses.update({f"/{status.name}": status for status in message.status})

        self.node.create_subscription(DiagnosticArray, "/diagnostics", take_status, qos.WATCHED)
        confirming = self.node.create_subscription(Event, self.name(EVENTS), events.append, qos.LOSSLESS)
        publisher = self.node.create_publisher(type(message), self.name(topic), qos.STREAM)

        def connected() -> bool:
            readers = self.node.get_subscriptions_info_by_topic(publisher.topic_name)
            found = any(f"{info.node_namespace.rstrip('/')}/{info.node_name}" == self.name(reader) for info in readers)
            return found and publisher.get_subscription_count() >= len(readers) and confirming.get_publisher_count() > 0

        if not self.until(connected, DISCOVERY_LIMIT):
            raise RunError(f"{self.name(reader)} does not subscribe to {publisher.topic_name}")
        publisher.publish(message)

        def confirmed() -> list[str]:
            return [str(event.text) for event in events if event.node == reader]

        if not self.until(confirmed, CONFIRMATION_LIMIT):
            # The status is from after the message: nodes publish theirs more often than the time that has passed.
            status = statuses.get(self.name(reader))
            if status is not None and status.level == DiagnosticStatus.WARN:
                raise RunError(f"{self.name(reader)}: {status.message}")
            self.until(confirmed, patience)
        return confirmed()[-1] if confirmed() else ""

    def receive(self, kind: Any, topic: str, profile: QoSProfile = qos.LATEST, limit: float | None = None) -> Any:
        """The next message on a topic of the vessel, or the latched one; None if there is none within a time, s."""
        received: list[Any] = []
        subscription = self.node.create_subscription(kind, self.name(topic), received.append, profile)
        self.until(lambda: received, limit or DISCOVERY_LIMIT)
        self.node.destroy_subscription(subscription)
        return received[-1] if received else None

    def _not_found(self, missing: Sequence[str]) -> str:
        """Which nodes were not found where, and which were, in one line."""
        what = f"no node {', '.join(missing)} in ROS domain {os.environ.get('ROS_DOMAIN_ID', '0')}"
        if not (there := self.nodes()):
            return f"{what}, nor any other: does the run use the same ROS_DOMAIN_ID?{loopback_down()}"
        names = [name.rsplit("/", 1)[-1] for name in missing]
        elsewhere = sorted({full.rsplit("/", 1)[0] or "/" for full in there if full.rsplit("/", 1)[-1] in names})
        hint = f"; for these the namespace is {' or '.join(elsewhere)}" if elsewhere else ""
        return f"{what}: found are {', '.join(there)}{hint}"


DECLARED = NODES | WATCHERS


class Change(NamedTuple):
    """A change of a parameter: `node.parameter`, the value before and the value after it."""

    name: str
    old: Any
    new: Any


def get_parameters(remote: Remote, node: str, names: Iterable[str]) -> dict[str, Any]:
    """Values of some parameters of a node; None for those that it does not have."""
    lister, getter = remote.connect(
        [Service(node, "list_parameters", ListParameters), Service(node, "get_parameters", GetParameters)]
    )
    wanted = list(names)
    known = set(remote.call(lister, ListParameters.Request()).result.names)
    there = [name for name in wanted if name in known]  # rclpy answers with no value at all where one is not declared
    values = remote.call(getter, GetParameters.Request(names=there)).values
    found = {name: plain(parameter_value_to_python(value)) for name, value in zip(there, values, strict=True)}
    return {name: found.get(name) for name in wanted}


def change_parameters(remote: Remote, changes: Mapping[str, object]) -> list[Change]:
    """Change parameters of running nodes. All are checked first, and those of one node are changed together or not at all.

    `changes`: new values by `node.parameter`. Returns old and new values.
    """
    by_node: dict[str, dict[str, object]] = {}
    for key, value in changes.items():
        node, dot, name = key.partition(".")
        if not (node and dot and name):
            raise ParameterError(f"{key} is not a parameter: it must be node.parameter, such as controller.guided.position_gain")
        if node not in DECLARED and (near := schema.meant(node, DECLARED)):
            raise ParameterError(f"{node} is not a node{near}")
        by_node.setdefault(node, {})[name] = value
    remote.require(*by_node)
    checked = {node: _checked(remote, node, values) for node, values in by_node.items()}
    made: list[Change] = []
    for node, parameters in checked.items():
        names = [parameter.name for parameter in parameters]
        old = get_parameters(remote, node, names)
        (setter,) = remote.connect([Service(node, "set_parameters_atomically", SetParametersAtomically)])
        request = SetParametersAtomically.Request(parameters=[parameter.to_parameter_msg() for parameter in parameters])
        result = remote.call(setter, request).result
        if not result.successful:
            raise ParameterError(result.reason)
        made += [Change(f"{node}.{p.name}", old[p.name], plain(p.value)) for p in parameters]
    return made


def _checked(remote: Remote, node: str, values: Mapping[str, object]) -> list[Parameter]:
    """The new parameters of a node, checked against its own descriptions."""
    lister, describer = remote.connect(
        [Service(node, "list_parameters", ListParameters), Service(node, "describe_parameters", DescribeParameters)]
    )
    known = set(remote.call(lister, ListParameters.Request()).result.names)
    every = known.union(schema.entries(DECLARED[node]) if node in DECLARED else ())
    for name in values:
        if name not in every:
            raise ParameterError(f"{node}.{name} is not a parameter: {schema.suggestion(name, every)}")
        if name not in known:
            raise ParameterError(f"{node}.{name} is not in use: it is of a law or mode that the node does not run")
    descriptors = remote.call(describer, DescribeParameters.Request(names=list(values))).descriptors
    return [_parameter(node, d, value) for d, value in zip(descriptors, values.values(), strict=True)]


def _parameter(node: str, descriptor: ParameterDescriptor, value: Any) -> Parameter:
    """A parameter with a new value."""
    name = f"{node}.{descriptor.name}"
    if descriptor.read_only:
        start = f"start it with --set {name}={value}"
        raise ParameterError(f"{name} is set at the start and cannot be changed while the node runs: {start}")
    kind = Parameter.Type(descriptor.type)
    if kind in (Parameter.Type.DOUBLE, Parameter.Type.DOUBLE_ARRAY):
        value = [_as_float(item) for item in value] if isinstance(value, list) else _as_float(value)
    must_be = descriptor.additional_constraints.rstrip(".") or f"Must be a value of type {kind.name.lower()}"
    refused = ParameterError(f"{name} {must_be[0].lower()}{must_be[1:]} (got {value})")
    if kind is Parameter.Type.INTEGER and isinstance(value, bool):  # which Python counts among the integers
        raise refused
    try:
        parameter = Parameter(descriptor.name, kind, value)
    except (TypeError, ValueError, AssertionError):
        raise refused from None
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    numbers = value if isinstance(value, list) else [value]
    if any(not r.from_value <= number <= r.to_value for r in ranges for number in numbers):
        raise refused
    return parameter


def _as_float(value: Any) -> Any:
    """A whole number as a float; other values as they are."""
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


Pose = tuple[float, float, float]  # x, y, heading


def send_goal(remote: Remote, x: float, y: float, heading: float | None) -> str:
    """Send a goal; returns a line that confirms it.

    `heading`: None for the bearing of the goal from where the reference is now.
    """
    return _confirmed("goal", remote.publish(_goal_pose(remote, x, y, heading, "goal"), "goal_pose", REFERENCE))


def send_path(remote: Remote, poses: Sequence[Pose]) -> str:
    """Send a path of waypoints; returns a line that confirms it."""
    return _confirmed("path", remote.publish(_path(remote, poses), "path", REFERENCE, PLANNING_LIMIT))


def _goal_pose(remote: Remote, x: float, y: float, heading: float | None, *modes: str) -> PoseStamped:
    """A goal in the frame of the reference, which must be in one of some modes."""
    frame = frame_of(remote, *modes)
    return pose_message((x, y, bearing(remote, x, y) if heading is None else heading), frame)


def _path(remote: Remote, poses: Sequence[Pose]) -> Path:
    path = Path()
    path.header.frame_id = frame_of(remote, "path")
    path.poses = [pose_message(pose, path.header.frame_id) for pose in poses]
    return path


def bearing(remote: Remote, x: float, y: float) -> float:
    """The direction from the reference to a point. Raises RunError if the position of the reference is not known."""
    if (message := remote.receive(ReferenceState, "reference")) is None:
        raise RunError(f"{remote.name('reference')} had no message within {DISCOVERY_LIMIT:g} s: give the heading")
    present, *_ = conversions.read_reference(message)
    return math.atan2(y - present.y, x - present.x)


def stated_datum(remote: Remote) -> tuple[float, float] | None:
    """Latitude and longitude of the origin of the odometry, degrees; None where no node states them."""
    remote.require(REFERENCE)
    message = remote.receive(NavSatFix, DATUM, qos.LATCHED, CONFIRMATION_LIMIT)
    found = None if message is None else read_datum(message)
    if found is None and remote.node.count_publishers(remote.name(DATUM)):
        raise RunError(f"{remote.name(DATUM)} must have a datum (got none): has the odometry had its first fix?")
    return found


def frame_of(remote: Remote, *modes: str) -> str:
    """The frame in which the reference node takes goals or paths. Raises RunError if it is in no mode that takes them."""
    values = get_parameters(remote, REFERENCE, ("mode", "frame_prefix", "frames"))
    if values["mode"] not in modes:
        raise RunError(
            f"{remote.name(REFERENCE)} accepts no {modes[0]}: its mode is {values['mode']};"
            f" start the run with --set reference_ship.mode={modes[0]}"
        )
    return str(values["frame_prefix"]) + str([*values["frames"], conversions.WORLD][0])


def pose_message(pose: Pose, frame: str) -> PoseStamped:
    """A pose without a stamp, so that its time is that of its receipt, in lockstep too."""
    message = conversions.new_pose()
    message.header.frame_id = frame
    conversions.write_pose(message.pose, Motion(*pose, 0.0, 0.0, 0.0))
    return message


def _confirmed(kind: str, text: str) -> str:
    return f"{kind}: {text}" if text else f"{kind} sent; {REFERENCE} reported no new {kind} within {CONFIRMATION_LIMIT:g} s"


LOOK = 0.5  # time after which it is looked at whether the server is still there, s
GONE = 5.0  # time after which a server that is not there has ended, s


class Progress(NamedTuple):
    """How far a goal has come; legs and time are 0 where the type of the action has none."""

    distance: float  # m
    speed: float  # m/s
    leg: int
    legs: int
    time_left: float  # s


class Result(NamedTuple):
    """How a goal has ended."""

    reached: bool
    text: str


Show = Callable[[Progress], None]


def sail_to(remote: Remote, x: float, y: float, heading: float | None, show: Show) -> Result:
    """Sail to a pose, and wait for the end.

    `heading`: None for the bearing of the goal from where the reference is now.
    """
    return _sail(remote, "navigate_to_pose", {"pose": _goal_pose(remote, x, y, heading, "goal", "path")}, show)


def sail_along(remote: Remote, poses: Sequence[Pose], show: Show) -> Result:
    """Sail along waypoints, and wait for the end; raises as `sail_to`."""
    return _sail(remote, "follow_path", {"path": _path(remote, poses)}, show)


def _sail(remote: Remote, name: str, fields: dict[str, Any], show: Show) -> Result:
    kind = _type(remote, name)
    client = ActionClient(remote.node, kind, remote.name(name))
    if not remote.until(client.server_is_ready, DISCOVERY_LIMIT):
        raise RunError(f"no action {remote.name(name)} within {DISCOVERY_LIMIT:g} s")
    sending: Any = None
    try:
        for _ in range(int(ANSWER_LIMIT / REPEAT_AFTER)):  # a response is lost if the server has not discovered the client yet
            sending = client.send_goal_async(kind.Goal(**fields), lambda message: show(_progress(message.feedback)))
            if remote.until(sending.done, REPEAT_AFTER):
                break
        if not sending.done() or not sending.result().accepted:
            raise RunError(f"{remote.name(REFERENCE)} has not accepted the goal within {ANSWER_LIMIT:g} s")
        response = _awaited(remote, client, sending.result())
    except KeyboardInterrupt:  # the goal is cancelled, also one that has not been accepted yet
        if sending is not None and remote.until(sending.done, REPEAT_AFTER) and sending.result().accepted:
            remote.until(sending.result().cancel_goal_async().done, ANSWER_LIMIT)
        raise
    finally:
        client.destroy()
    reached, result = response.status == GoalStatus.STATUS_SUCCEEDED, response.result
    text = getattr(result, "error_msg", "") or ("reached" if reached else f"ended with code {result.error_code}")
    return Result(reached, str(text))


def _type(remote: Remote, name: str) -> Any:
    """The type that the server has: that of nav2_msgs, or of this package."""
    full = remote.name(name)

    def kinds() -> list[str]:
        return list(dict(get_action_names_and_types(remote.node)).get(full, []))

    if not remote.until(kinds, DISCOVERY_LIMIT):
        raise RunError(f"{remote.name(REFERENCE)} has no action {full}: is it of an older version?")
    package, _, kind = kinds()[0].split("/")
    try:
        return getattr(import_module(f"{package}.action"), kind)
    except (ImportError, AttributeError):
        raise RunError(f"{package}/action/{kind}, the type of {full}, is not installed here") from None


def _awaited(remote: Remote, client: ActionClient, handle: Any) -> Any:
    """Wait for the result. Raises RunError if the server has ended without one."""
    result, absent = handle.get_result_async(), 0.0
    while not remote.until(result.done, LOOK):
        absent = 0.0 if client.server_is_ready() else absent + LOOK
        if absent > GONE:
            raise RunError(f"{remote.name(REFERENCE)} has ended before the goal")
    return result.result()


def _progress(feedback: Any) -> Progress:
    left = getattr(feedback, "distance_remaining", getattr(feedback, "distance_to_goal", 0.0))
    time = getattr(feedback, "estimated_time_remaining", None)
    legs = int(getattr(feedback, "leg", 0)), int(getattr(feedback, "legs", 0))
    return Progress(float(left), float(getattr(feedback, "speed", 0.0)), *legs, float(time.sec) if time else 0.0)

"""What a remote sends and what it takes for an answer, step by step and without other nodes."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.parameter import Parameter
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.core.exceptions import ParameterError, RunError
from vessel_hsmc_ros.messages.conversions import WORLD
from vessel_hsmc_ros.nodes import remote
from vessel_hsmc_ros.nodes.remote import (
    Change,
    Remote,
    Service,
    change_parameters,
    get_parameters,
    send_goal,
    send_path,
)

FLOAT, FLOATS, WHOLE, WORDS, FLAG = (
    ParameterType.PARAMETER_DOUBLE,
    ParameterType.PARAMETER_DOUBLE_ARRAY,
    ParameterType.PARAMETER_INTEGER,
    ParameterType.PARAMETER_STRING_ARRAY,
    ParameterType.PARAMETER_BOOL,
)


def descriptor(name: str, kind: int, **more: Any) -> ParameterDescriptor:
    if kind in (FLOAT, FLOATS):
        more["floating_point_range"] = [FloatingPointRange(from_value=0.0, to_value=10.0)]
    if kind == WHOLE:
        more["integer_range"] = [IntegerRange(from_value=1, to_value=5)]
    return ParameterDescriptor(name=name, type=kind, **more)


class Nodes(Remote):
    """A connection with nodes that are dictionaries of their parameters; it notes what is set."""

    def __init__(self, **nodes: dict[str, tuple[ParameterDescriptor, Any]]) -> None:
        self._prefix = "/boat/"
        self._nodes, self.set, self.refused = nodes, list[tuple[str, dict[str, Any]]](), ""

    def require(self, *names: str) -> None:
        for name in names:
            if name not in self._nodes:
                raise RunError(f"no node {name}")

    def connect(self, services: Any) -> Any:
        self.require(*(service.node for service in services))
        return list(services)

    def call(self, client: Any, request: Any) -> Any:
        answer: dict[str, Any] = {
            "list_parameters": self._list,
            "describe_parameters": self._describe,
            "get_parameters": self._get,
            "set_parameters_atomically": self._set,
        }
        return answer[client.name](self._nodes[client.node], request, client.node)

    def _list(self, node: Any, _request: Any, _name: str) -> Any:
        return SimpleNamespace(result=SimpleNamespace(names=[*node]))

    def _describe(self, node: Any, request: Any, _name: str) -> Any:
        return SimpleNamespace(descriptors=[node[name][0] for name in request.names])

    def _get(self, node: Any, request: Any, _name: str) -> Any:
        none = Parameter("none").get_parameter_value()
        values = [Parameter(n, value=node[n][1]).get_parameter_value() if n in node else none for n in request.names]
        return SimpleNamespace(values=values)

    def _set(self, node: Any, request: Any, name: str) -> Any:
        if self.refused == name:
            return SimpleNamespace(result=SetParametersResult(successful=False, reason="it does not fit"))
        values = {each.name: Parameter.from_parameter_msg(each).value for each in request.parameters}
        self.set.append((name, {key: [*v] if hasattr(v, "tolist") else v for key, v in values.items()}))
        for key, value in values.items():
            node[key] = node[key][0], value
        return SimpleNamespace(result=SetParametersResult(successful=True))


def two_nodes() -> Nodes:
    controller = {
        "law": (ParameterDescriptor(name="law", type=ParameterType.PARAMETER_STRING, read_only=True), "pd"),
        "gain": (descriptor("gain", FLOAT), 1.0),
        "other": (descriptor("other", FLOAT), 2.0),
        "pair": (descriptor("pair", FLOATS), [1.0, 2.0]),
        "number": (descriptor("number", WHOLE), 2),
        "words": (descriptor("words", WORDS), ["a"]),
        "flag": (descriptor("flag", FLAG), False),
    }
    return Nodes(controller=controller, vessel_sim={"force": (descriptor("force", FLOAT), 3.0)})


def test_the_parameters_of_each_node_are_changed_in_one_request_each_and_old_values_are_those_before() -> None:
    nodes = two_nodes()
    made = change_parameters(nodes, {"controller.gain": 0, "vessel_sim.force": 10, "controller.pair": [3, 4.5]})
    assert nodes.set == [("controller", {"gain": 0.0, "pair": [3.0, 4.5]}), ("vessel_sim", {"force": 10.0})]
    assert made == [
        Change("controller.gain", 1.0, 0.0),
        Change("controller.pair", [1.0, 2.0], [3.0, 4.5]),
        Change("vessel_sim.force", 3.0, 10.0),
    ]
    again = change_parameters(nodes, {"controller.gain": 5.0})
    assert again == [Change("controller.gain", 0.0, 5.0)]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gain", -0.1), ("gain", 10.1), ("gain", True), ("gain", "much"), ("gain", None), ("gain", [1.0]), ("gain", math.nan),
        ("pair", [1.0, 11.0]), ("pair", [-1, 1.0]), ("pair", 1.0), ("pair", [True, 1.0]),
        ("number", 0), ("number", 6), ("number", 2.0), ("number", True), ("words", [1]), ("words", "a"), ("flag", 1),
        ("law", "pd"), ("unknown", 1.0),
    ],
)  # fmt: skip
def test_of_changes_of_which_one_is_not_allowed_none_is_made(name: str, value: Any) -> None:
    for changes in (
        {"vessel_sim.force": 4.0, "controller.other": 4.0, f"controller.{name}": value},
        {f"controller.{name}": value, "controller.other": 4.0, "vessel_sim.force": 4.0},
    ):
        nodes = two_nodes()
        with pytest.raises(ParameterError, match=f"controller.{name}"):
            change_parameters(nodes, changes)
        assert nodes.set == []


@pytest.mark.parametrize(
    ("name", "value"),
    [("gain", 0), ("gain", 10), ("gain", 0.0), ("number", 1), ("number", 5), ("pair", [0, 10]), ("pair", []), ("flag", True)],
)
def test_the_limits_themselves_and_empty_lists_are_allowed(name: str, value: Any) -> None:
    nodes = two_nodes()
    change_parameters(nodes, {f"controller.{name}": value})
    assert nodes.set == [("controller", {name: value})]


@pytest.mark.parametrize("key", ["gain", ".gain", "controller.", ""])
def test_a_change_without_a_node_or_a_parameter_is_refused(key: str) -> None:
    with pytest.raises(ParameterError, match="must be node"):
        change_parameters(two_nodes(), {"vessel_sim.force": 1.0, key: 1.0})


def test_a_node_that_refuses_a_change_is_an_error_with_its_reason() -> None:
    nodes = two_nodes()
    nodes.refused = "controller"
    with pytest.raises(ParameterError, match="it does not fit"):
        change_parameters(nodes, {"controller.gain": 2.0})


def test_parameters_that_a_node_lacks_are_none_and_each_has_its_own_value() -> None:
    found = get_parameters(two_nodes(), "controller", ["other", "none", "pair", "gain", "law"])
    assert found == {"other": 2.0, "none": None, "pair": [1.0, 2.0], "gain": 1.0, "law": "pd"}


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("los_pid.surge_gain", "not in use"),
        ("los_pid.surge_gian", "did you mean los_pid.surge_gain"),
        ("gian", "did you mean gain"),
    ],
)
def test_a_change_of_a_law_that_does_not_run_is_refused_as_such_and_a_misspelt_one_with_the_nearest_name(
    name: str, reason: str
) -> None:
    with pytest.raises(ParameterError, match=reason):
        change_parameters(two_nodes(), {f"controller.{name}": 1.0})


class Talking(Remote):
    """A remote whose node notes what is published, and in whose time events and statuses arrive."""

    def __init__(self, arriving: list[Any]) -> None:
        self._prefix, self.published = "/boat/", list[tuple[str, Any]]()
        self._arriving, self._callbacks = iter(arriving), dict[Any, Any]()
        self.names = dict[Any, str]()
        self._executor: Any = SimpleNamespace(spin_once=self._spin)
        self.node: Any = SimpleNamespace(
            create_subscription=self._subscribe,
            create_publisher=self._publisher,
            get_subscriptions_info_by_topic=lambda _: [SimpleNamespace(node_namespace="/boat", node_name="reference_ship")],
            destroy_subscription=lambda _: None,
        )

    def _spin(self, timeout_sec: float) -> None:
        assert timeout_sec > 0.0
        message = next(self._arriving, None)
        if message is not None and self.published:
            self._callbacks[type(message)](message)

    def _subscribe(self, kind: Any, name: str, callback: Any, _qos: Any) -> Any:
        self._callbacks[kind], self.names[kind] = callback, name
        return SimpleNamespace(get_publisher_count=lambda: 1)

    def _publisher(self, _kind: Any, name: str, _qos: Any) -> Any:
        def publish(message: Any) -> None:
            self.published.append((name, message))

        return SimpleNamespace(topic_name=name, publish=publish, get_subscription_count=lambda: 1)


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """What does not arrive at once does not arrive."""
    monkeypatch.setattr(remote, "CONFIRMATION_LIMIT", 0.05)
    monkeypatch.setattr(remote, "PLANNING_LIMIT", 0.05)


def status(level: bytes, name: str = "boat/reference_ship") -> DiagnosticArray:
    return DiagnosticArray(status=[DiagnosticStatus(name=name, level=level, message="too far")])


OTHER, OWN = Event(node="controller", text="enabled"), Event(node="reference_ship", text="x = 1")
LATER = Event(node="reference_ship", text="x = 2")
WARN, OK, ERROR = DiagnosticStatus.WARN, DiagnosticStatus.OK, DiagnosticStatus.ERROR


@pytest.mark.parametrize(
    ("arriving", "text"),
    [
        ([OWN], "x = 1"),
        ([OTHER, OWN], "x = 1"),
        ([OTHER], ""),
        ([], ""),
        ([status(OK)], ""),
        ([status(ERROR)], ""),
        ([status(WARN, "boat/controller")], ""),
        ([status(WARN, "other/reference_ship")], ""),
        ([status(WARN), OWN], "x = 1"),
        ([status(WARN), status(OK)], ""),
    ],
)
def test_only_an_event_of_the_reader_confirms_a_message(arriving: list[Any], text: str) -> None:
    talking = Talking(arriving)
    assert talking.publish(PoseStamped(), "goal_pose", "reference_ship") == text
    assert [name for name, _ in talking.published] == ["/boat/goal_pose"]
    assert talking.names == {DiagnosticArray: "/diagnostics", Event: "/boat/events"}


@pytest.mark.parametrize("arriving", [[status(WARN)], [OTHER, status(OK), status(WARN)], [status(ERROR), status(WARN)]])
def test_a_reader_that_warns_without_a_confirmation_has_refused_the_message(arriving: list[Any]) -> None:
    with pytest.raises(RunError, match="/boat/reference_ship: too far"):
        Talking(arriving).publish(PoseStamped(), "goal_pose", "reference_ship")


def test_with_patience_a_late_confirmation_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "CONFIRMATION_LIMIT", 0.0)
    talking = Talking([None] * 3 + [OWN])
    assert talking.publish(PoseStamped(), "path", "reference_ship", patience=5.0) == "x = 1"


@pytest.mark.parametrize(("heading", "expected"), [(0.0, 0.0), (-1.5, -1.5), (None, 0.25)])
def test_a_goal_is_sent_in_the_frame_of_the_reference_with_a_heading_of_zero_too(
    monkeypatch: pytest.MonkeyPatch, heading: float | None, expected: float
) -> None:
    talking = Talking([OWN])
    settings: dict[str, Any] = {"mode": "goal", "frame_prefix": "boat/", "frames": ["map", "odom"]}
    monkeypatch.setattr(remote, "get_parameters", lambda *_: settings)
    monkeypatch.setattr(remote, "bearing", lambda *_: 0.25)
    assert send_goal(talking, 0.0, -3.0, heading) == "goal: x = 1"
    ((name, message),) = talking.published
    pose = message.pose
    assert (name, message.header.frame_id, message.header.stamp.sec) == ("/boat/goal_pose", "boat/map", 0)
    assert (pose.position.x, pose.position.y) == (0.0, -3.0)
    assert 2.0 * math.atan2(pose.orientation.z, pose.orientation.w) == pytest.approx(expected)
    settings |= {"mode": "path", "frames": []}
    with pytest.raises(RunError, match="accepts no goal: its mode is path"):
        send_goal(Talking([OWN]), 0.0, 0.0, 0.0)
    talking = Talking([])
    assert send_path(talking, [(1.0, 2.0, 0.0), (3.0, 4.0, 0.5)]).startswith("path sent; reference_ship reported no new path")
    ((_, message),) = talking.published
    assert [(pose.pose.position.x, pose.pose.position.y) for pose in message.poses] == [(1.0, 2.0), (3.0, 4.0)]
    assert {message.header.frame_id, *(pose.header.frame_id for pose in message.poses)} == {f"boat/{WORLD}"}


class Future:
    """An answer that comes when it is awaited often enough."""

    def __init__(self, number: int, answered: int) -> None:
        self._number, self._answered = number, answered

    def done(self) -> bool:
        return self._number >= self._answered

    def result(self) -> int:
        return self._number


@pytest.mark.parametrize(("answered", "result"), [(1, 1), (2, 2), (3, 3), (99, None)])
def test_a_request_is_repeated_until_there_is_a_response(
    monkeypatch: pytest.MonkeyPatch, answered: int, result: int | None
) -> None:
    monkeypatch.setattr(remote, "ANSWER_LIMIT", 30.0 if result else 0.05)
    monkeypatch.setattr(remote, "REPEAT_AFTER", 0.001)
    received: list[Any] = []

    def call(request: Any) -> Future:
        received.append(request)
        return Future(len(received), answered)

    client: Any = SimpleNamespace(call_async=call, srv_name="/boat/controller/enable")
    if result is None:
        with pytest.raises(RunError, match="no response from /boat/controller/enable"):
            Talking([]).call(client, "request")
    else:
        assert Talking([]).call(client, "request") == result
        assert received == ["request"] * result


def test_clients_are_those_of_the_services_in_their_order() -> None:
    talking = Talking([])
    made: list[Any] = []

    def create(kind: Any, name: str) -> Any:
        made.append(name)
        return SimpleNamespace(kind=kind, srv_name=name, service_is_ready=lambda: True)

    talking.node.create_client = create
    talking.node.get_node_names_and_namespaces = lambda: [("a", "/boat"), ("b", "/boat/"), ("_c", "/boat")]
    assert talking.nodes() == ["/boat/a", "/boat/b"]
    clients = talking.connect([Service("b", "pause", int), Service("a", "reset", str)])
    assert [(client.kind, client.srv_name) for client in clients] == [(int, "/boat/b/pause"), (str, "/boat/a/reset")]

"""What the observer of a vessel makes of its messages, step by step: the latest of each, in any order, in its own namespace."""

import math
from collections import deque
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from vessel_hsmc_msgs.msg import Event

from vessel_hsmc_ros.cli.watch import missing_inputs
from vessel_hsmc_ros.core.exceptions import RunError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import observation
from vessel_hsmc_ros.nodes.observation import EVENTS_SHOWN, NodeStatus, Observation

SECOND = 1_000_000_000
PLANT_LIMITS = {"actuators.surge_force_limit": 3.0, "actuators.yaw_moment_limit": 2.0}
OWN_LIMITS = {"vessel.surge_force_limit": 30.0, "vessel.yaw_moment_limit": 20.0}


class Vessel:
    """Stands for the connection with a vessel: has the messages that wait on each topic, and the nodes with their parameters."""

    def __init__(self, namespace: str = "") -> None:
        self.prefix = f"/{namespace}/" if namespace else "/"
        self.waiting: dict[str, deque[Any]] = {}
        self.limits: dict[str, dict[str, float]] = {}
        self.node = SimpleNamespace(create_subscription=self._subscribe)

    def _subscribe(self, kind: Any, topic: str, callback: Any, *_: Any) -> Any:
        queue = self.waiting.setdefault(topic, deque())
        take = lambda *_: (queue.popleft(), {}) if queue else None  # noqa: E731
        handle = SimpleNamespace(take_message=take)
        return SimpleNamespace(handle=handle, msg_type=kind, raw=False, callback=callback, _callback_type=None)

    def name(self, relative: str) -> str:
        return relative if relative.startswith("/") else self.prefix + relative

    def until(self, condition: Any, _limit: float) -> Any:
        return condition()

    def nodes(self) -> list[str]:
        return [self.name(node) for node in self.limits]

    def require(self, *_: str) -> None:
        """Both are there."""

    def put(self, topic: str, *messages: Any) -> None:
        self.waiting.setdefault(self.name(topic), deque()).extend(messages)


def status(name: str, level: bytes = DiagnosticStatus.OK, message: str = "running", stamp: int = 0, **values: Any) -> Any:
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    made = DiagnosticArray(status=[DiagnosticStatus(name=name, level=level, message=message, values=pairs)])
    made.header.stamp = conv.time_message(stamp)
    return made


def event(seconds: float, text: str) -> Event:
    made = Event(node="controller", kind="stop", text=text)
    made.header.stamp = conv.time_message(round(seconds * SECOND))
    return made


def wrench(force: float) -> Any:
    made = conv.new_wrench()
    conv.write_wrench(made, conv.time_message(0), (force, -force))
    return made


@pytest.fixture
def observed(monkeypatch: pytest.MonkeyPatch) -> Any:
    def parameters(remote: Vessel, node: str, names: Any) -> dict[str, Any]:
        return {name: remote.limits[node].get(name) for name in names}

    monkeypatch.setattr(observation, "get_parameters", parameters)

    def make(vessel: Any) -> Observation:
        vessel.put("cmd_wrench", wrench(1.0))
        return Observation(vessel)

    return make


def test_the_latest_events_are_shown_in_the_order_of_their_times_whenever_they_arrive(observed: Any) -> None:
    vessel = Vessel()
    made = observed(vessel)
    vessel.put("events", *(event(k, f"{k}") for k in (7, 3, 8, 1)))
    assert made.look().events == [f"controller stop: {k}" for k in (1, 3, 7, 8)]
    vessel.put("events", *(event(k, f"{k}") for k in (2, 9, 10)))
    assert made.look().events == [f"controller stop: {k}" for k in (2, 3, 7, 8, 9, 10)][-EVENTS_SHOWN:]


@pytest.mark.parametrize("namespace", ["", "alpha"])
def test_the_latest_status_of_each_node_of_the_vessel_is_shown_with_its_level(observed: Any, namespace: str) -> None:
    vessel = Vessel(namespace)
    made, own = observed(vessel), f"{namespace}/" if namespace else ""
    levels = (DiagnosticStatus.ERROR, DiagnosticStatus.WARN, DiagnosticStatus.STALE, DiagnosticStatus.OK)
    for level, shown in zip(levels, ("error", "warning", "stale", "ok"), strict=True):
        vessel.put("/diagnostics", status(f"{own}controller", level, "as it is", law="guided"))
        vessel.put("/diagnostics", status("beta/controller", DiagnosticStatus.ERROR), status(f"{own}controller: guard"))
        assert made.look().nodes == {"controller": NodeStatus(shown, "as it is", {"law": "guided"})}


def test_ages_count_from_the_receipt_of_each_input_for_itself(observed: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(observation, "time", SimpleNamespace(monotonic=lambda: now[0]))
    vessel = Vessel()
    made = observed(vessel)
    now[0] = 103.0
    vessel.put("odom", conv.new_odometry())
    assert made.look().ages == {"cmd_wrench": 3.0, "odom": 0.0}
    now[0] = 104.5
    vessel.put("cmd_wrench", wrench(5.0), wrench(6.0))
    found = made.look()
    assert (found.ages, found.wrench, found.desired) == ({"cmd_wrench": 0.0, "odom": 1.5}, (6.0, -6.0), None)


class Waiting(Vessel):
    """A vessel whose messages arrive one by one, every 0.1 s; `until` waits for a condition on its clock."""

    def __init__(self, messages: list[tuple[str, Any]], there: tuple[str, ...], now: list[float]) -> None:
        super().__init__()
        self.messages, self.now, self.limits = messages, now, {name: {} for name in there}

    def until(self, condition: Any, limit: float) -> Any:
        end = self.now[0] + limit
        while not condition() and self.now[0] < end:
            self.now[0] += 0.1
            for topic, message in self.messages[:1]:
                self.put(topic, message)
            del self.messages[:1]


BOAT = ("controller", "reference_ship")


@pytest.mark.parametrize(
    ("silent", "there", "wait", "missing"),
    [
        ((), BOAT, observation.SHORTEST_LOOK, ""),
        ((), (*BOAT, "vessel_sim"), observation.LOOK, ""),
        (("odom",), BOAT, observation.LOOK, "no odom within 3 s"),
        (("odom", "reference"), BOAT, observation.LOOK, "no odom and no reference within 3 s"),
    ],
)
def test_the_first_state_has_every_input_and_node_or_names_what_did_not_arrive(
    monkeypatch: pytest.MonkeyPatch, silent: tuple[str, ...], there: tuple[str, ...], wait: float, missing: str
) -> None:
    """On a boat there is no node of the plant, for which nothing waits."""
    now = [100.0]
    monkeypatch.setattr(observation, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(observation, "get_parameters", lambda _, __, names: dict.fromkeys(names, 1.0))
    inputs = [("odom", conv.new_odometry()), ("reference", conv.new_reference()), ("cmd_wrench", wrench(1.0))]
    messages = [each for each in inputs if each[0] not in silent] + [("/diagnostics", status(node)) for node in BOAT]
    snapshot = Observation(Waiting(messages, there, now)).look()  # type: ignore[arg-type]
    assert now[0] - 100.0 == pytest.approx(wait, abs=0.2)
    assert missing_inputs(snapshot) == missing
    assert snapshot.ages.keys() == {name for name, _ in inputs if name not in silent}


@pytest.mark.parametrize("frame", ["child", "parent"])
def test_velocities_are_shown_along_the_hull_in_whichever_frame_the_controller_takes_them(observed: Any, frame: str) -> None:
    vessel = Vessel()
    vessel.limits = {"controller": {**OWN_LIMITS, "odometry.twist_frame": frame}}  # type: ignore[dict-item] # the one text
    made, message = observed(vessel), conv.new_odometry()
    conv.write_odometry(message, conv.time_message(0), np.array([1.0, 2.0, 0.5 * math.pi, 3.0, -0.5, 0.1]))
    vessel.put("odom", message)
    ship = made.look().ship
    assert (ship.u, ship.v) == pytest.approx((3.0, -0.5) if frame == "child" else (-0.5, -3.0))
    assert (ship.x, ship.y, ship.r) == pytest.approx((1.0, 2.0, 0.1))


def test_the_time_is_that_of_the_plant_counted_on_by_the_odometry_and_never_back(observed: Any) -> None:
    vessel = Vessel()
    made = observed(vessel)
    assert made.look().time is None
    vessel.put("/diagnostics", status("vessel_sim", stamp=1000 * SECOND, simulated_time=12.5))
    assert made.look().time is None, "without odometry"
    for seconds, shown in ((1000.25, 12.75), (1000.5, 13.0), (999.0, 12.5)):
        odometry = conv.new_odometry()
        odometry.header.stamp = conv.time_message(round(seconds * SECOND))
        vessel.put("odom", odometry)
        assert made.look().time == pytest.approx(shown)
    vessel.put("/diagnostics", status("controller", stamp=5 * SECOND, simulated_time=99.0))
    assert made.look().time == pytest.approx(12.5), "of the plant alone"


@pytest.mark.parametrize(
    ("nodes", "limits"),
    [
        ({"vessel_sim": PLANT_LIMITS, "controller": OWN_LIMITS}, (3.0, 2.0)),
        ({"controller": OWN_LIMITS}, (30.0, 20.0)),
        ({"vessel_sim": {}, "controller": OWN_LIMITS}, (30.0, 20.0)),
        ({"drive": OWN_LIMITS}, (math.inf, math.inf)),
    ],
)
def test_limits_are_those_of_the_plant_or_else_of_the_controller(observed: Any, nodes: Any, limits: tuple[float, float]) -> None:
    vessel = Vessel("alpha")
    vessel.limits = nodes
    assert observed(vessel).look().limits == limits


def test_a_vessel_that_publishes_nothing_is_an_error_that_names_its_nodes() -> None:
    with pytest.raises(RunError, match="/alpha/vessel_sim and /alpha/controller published nothing for 5 s"):
        Observation(Vessel("alpha"))  # type: ignore[arg-type] # stands for it

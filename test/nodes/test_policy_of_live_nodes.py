"""What real nodes publish, subscribe to and serve, beside what the SROS2 policy allows them: no less, and nothing more."""

from contextlib import suppress
from fnmatch import fnmatch
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from bag_making import write_run
from definitions import module
from durations import rest_long
from rclpy.action import get_action_server_names_and_types_by_node
from thruster_layouts import LAYOUTS

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.boats.drive import DriveNode, WatchdogNode
from vessel_hsmc_ros.boats.mavlink import MavlinkNode
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.messages.raw import message_class
from vessel_hsmc_ros.messages.topics import RECORDED_TOPICS, THRUSTER_DEMAND, WATCHED_TOPICS
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.fault_relay import FaultRelayNode
from vessel_hsmc_ros.nodes.live import LiveNode
from vessel_hsmc_ros.nodes.markers import MarkerNode
from vessel_hsmc_ros.nodes.recorder import RecorderNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.replay import Playing, ReplayNode
from vessel_hsmc_ros.nodes.thruster_allocation import ThrusterAllocationNode
from vessel_sim_node.node import VesselSimNode

POLICY = ElementTree.parse(share_directory() / "config" / "security" / "policy.xml").getroot()  # noqa: S314 - our own file

RUDDER = {f"vessel__thrusters__{name}": value for name, value in LAYOUTS["rudder_and_bow_thruster"].items()}
TWIN = {f"vessel__thrusters__{name}": value for name, value in LAYOUTS["twin"].items()}
ANY_PORT = {"connection": "udpin:127.0.0.1:0", "use_sim_time": True}
LOCKSTEP, REAL_TIME = {"lockstep": True}, {"lockstep": False}
SIMULATED = REAL_TIME | {"use_sim_time": True}
BY_THRUSTERS = RUDDER | {"actuators__kind": "thrusters"}
DECLARED = {"actions__battery": 0.2, "actions__operator_timeout": 3.0, "actions__at_end": "stop"}
DEMANDS = ["thrusters/left/thrust"]

CONFIGURATIONS: dict[Any, list[dict[str, Any]]] = {
    ControllerNode: [REAL_TIME | {"observer__enabled": True}, SIMULATED, LOCKSTEP],
    ReferenceShipNode: [SIMULATED | {"mode": "path"}, REAL_TIME | {"mode": "goal", **DECLARED}, LOCKSTEP],
    VesselSimNode: [
        LOCKSTEP | {"sensors__position_noise": 0.1},
        SIMULATED,
        REAL_TIME | RUDDER | {"actuators__kind": "thrusters"},
    ],
    ThrusterAllocationNode: [SIMULATED | RUDDER],
    WatchdogNode: [SIMULATED],
    DriveNode: [SIMULATED | {"form": form} for form in ("normalised", "cmd_vel", "helm", "pwm")],
    RecorderNode: [REAL_TIME | {"topics": [*RECORDED_TOPICS, *DEMANDS, "watched_wrench"]}],
    MarkerNode: [SIMULATED],
    LiveNode: [SIMULATED | {"port": 0}],
    MavlinkNode: [
        REAL_TIME | ANY_PORT,
        REAL_TIME | ANY_PORT | {"form": "guided"},
        REAL_TIME | ANY_PORT | TWIN | {"form": "channels"},
    ],
    FaultRelayNode: [SIMULATED | {"topics": ["odom", "reference", "cmd_wrench", *DEMANDS]}],
}
"""Settings of each node that together need everything that it may do."""

if module("px4_msgs.msg"):
    from vessel_hsmc_ros.boats.px4 import Px4Node

    CONFIGURATIONS[Px4Node] = [SIMULATED]

PASSES = 4

CLIENTS = {f"/*/{service}" for service in ("list_parameters", "get_parameters")}
UNSEEN: dict[tuple[Any, str], set[str]] = {
    (ControllerNode, "subscribe"): {"/cmd_wrench", "/rosout"},  # while another node publishes it; with a black box
    (MarkerNode, "publish"): {"/tf"},  # where tf2_msgs is installed
    (RecorderNode, "request"): CLIENTS,  # for a moment, when a node appears
    (LiveNode, "subscribe"): {"/" + topic.lstrip("/") for topic in WATCHED_TOPICS} - {"/clock"} | {"/thrusters/*"},  # on demand
}
"""What a node needs at times that these settings do not show."""


def allowed(node: str, rule: str) -> set[str]:
    """The full names, or patterns, that a node may publish, subscribe to, serve, request or execute."""
    lists = POLICY.iterfind(f".//profile[@node='{node}']/*[@{rule}='ALLOW']")
    names = [entry.text or "" for each in lists for entry in each]
    return {f"/{node}/{name[2:]}" if name.startswith("~/") else "/" + name.lstrip("/") for name in names}


def live(probe: Any, name: str) -> dict[str, set[str]]:
    """What a node of the graph publishes, subscribes to, serves, requests and executes."""
    queries = {
        "publish": probe.get_publisher_names_and_types_by_node,
        "subscribe": probe.get_subscriber_names_and_types_by_node,
        "reply": probe.get_service_names_and_types_by_node,
        "request": probe.get_client_names_and_types_by_node,
    }
    seen = {rule: {found for found, _ in query(name, "/") if "/_action/" not in found} for rule, query in queries.items()}
    return {**seen, "execute": {found for found, _ in get_action_server_names_and_types_by_node(probe, name, "/")}}


def announce(bench: Any, kind: Any) -> None:
    """Publish what a node may subscribe to: in lockstep, and in a recorder, only that makes it subscribe."""
    own = allowed(kind.NAME, "publish") | {"/rosout"}
    types = {**RECORDED_TOPICS, "watched_wrench": RECORDED_TOPICS["cmd_wrench"]} | dict.fromkeys(DEMANDS, THRUSTER_DEMAND)
    for topic, name in types.items():
        if not any(fnmatch("/" + topic.lstrip("/"), each) for each in own):
            bench.probe.create_publisher(message_class(name), topic, qos.data(lockstep=True))


@pytest.mark.parametrize("kind", rest_long(CONFIGURATIONS, 6), ids=[kind.NAME for kind in CONFIGURATIONS])
def test_a_live_node_has_what_the_policy_allows_and_nothing_more(bench: Any, tmp_path: Path, kind: Any) -> None:
    announce(bench, kind)
    rules = {rule: allowed(kind.NAME, rule) for rule in ("publish", "subscribe", "reply", "request", "execute")}
    used: dict[str, set[str]] = {rule: UNSEEN.get((kind, rule), set()).copy() for rule in rules}
    # A node of another test that was killed stays in the graph until its lease ends.
    bench.until(lambda: kind.NAME not in bench.probe.get_node_names())
    # A busy machine shows a node late: the settings come again until all has been seen.
    for number, settings in enumerate(CONFIGURATIONS[kind] * PASSES):
        folder = {"directory": str(tmp_path / str(number))} if kind is RecorderNode else {}
        node = bench.start(kind, **settings, **folder)

        def is_complete() -> bool:
            for rule, names in live(bench.probe, kind.NAME).items():
                used[rule] |= names
            return all(any(fnmatch(name, allow) for name in used[rule]) for rule, given in rules.items() for allow in given)

        with suppress(AssertionError):
            bench.until(is_complete, 0.5 * (1 + number))
        complete = is_complete()
        bench.stop(node)
        if complete:
            break
    for rule, names in used.items():
        assert {name for name in names if not any(fnmatch(name, allow) for allow in rules[rule])} == set(), f"beyond: {rule}"
        assert {allow for allow in rules[rule] if not any(fnmatch(name, allow) for name in names)} == set(), f"unused: {rule}"


def test_a_live_replay_has_what_the_policy_allows_where_it_publishes_no_commands(bench: Any, tmp_path: Path) -> None:
    write_run(tmp_path / "bag", 3)
    node = ReplayNode(open_bag(tmp_path / "bag"), Playing(topics=["/odom", "/controller/state"]), context=bench.context)
    bench.nodes.append(node)
    bench.until(lambda: "/replay/pause" in live(bench.probe, "replay")["reply"])
    for rule, names in live(bench.probe, "replay").items():
        assert names <= allowed("replay", rule), rule
    commands = {"cmd_wrench", "thrusters/left/thrust", "watched_wrench"}
    assert not {name for name in commands for allow in allowed("replay", "publish") if fnmatch(f"/{name}", allow)}
    recorded = {"/" + topic.lstrip("/") for topic in RECORDED_TOPICS}
    assert allowed("replay", "publish") == recorded - {"/cmd_wrench"}

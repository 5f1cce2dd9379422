"""The SROS2 policy: a profile for every node, in the form of its schema, and only topics that exist."""

from xml.etree import ElementTree

import pytest

from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.node_list import PROGRAMS
from vessel_hsmc_ros.messages.topics import WATCHED_TOPICS

POLICY = ElementTree.parse(share_directory() / "config" / "security" / "policy.xml").getroot()  # noqa: S314 - our own file
CHILDREN = {
    "policy": {"enclaves"},
    "enclaves": {"enclave"},
    "enclave": {"profiles"},
    "profiles": {"profile"},
    "profile": {"topics", "services", "actions"},
    "topics": {"topic"},
    "services": {"service"},
    "actions": {"action"},
}
QUALIFIERS = {"topics": {"publish", "subscribe"}, "services": {"reply", "request"}, "actions": {"call", "execute"}}
NODES = (*PROGRAMS, "replay")
SENSORS = {"fix", "fix_2", "imu", "heading", "fix_velocity", "course", "speed"}
DRIVES = {"normalised_wrench", "cmd_vel", "throttle", "steering"}
PX4 = {f"fmu/in/{name}" for name in ("offboard_control_mode", "rover_throttle_setpoint", "rover_steering_setpoint")}
PX4 |= {f"fmu/out/{name}" for name in ("vehicle_odometry", "vehicle_status")}
BEYOND = {
    "thrusters/*",
    "watched_wrench",
    "~/transition_event",
    "relayed/*",
    "battery_state",
    "operator_heartbeat",
    *SENSORS,
    *DRIVES,
    *PX4,
}
"""Topics that are not in the lists of recorded and watched ones."""


def allowed(node: str, rule: str) -> set[str]:
    """The names that a node may publish, subscribe to, serve or request."""
    lists = POLICY.iterfind(f".//profile[@node='{node}']/*[@{rule}='ALLOW']")
    return {entry.text or "" for each in lists for entry in each}


def test_the_policy_has_the_form_of_version_0_2_0() -> None:
    assert (POLICY.tag, POLICY.get("version")) == ("policy", "0.2.0")
    for element in POLICY.iter():
        assert {child.tag for child in element} <= CHILDREN.get(element.tag, set())
        if element.tag in QUALIFIERS:
            assert element.attrib.keys() <= QUALIFIERS[element.tag]
            assert set(element.attrib.values()) == {"ALLOW"}
        assert len(element) or (element.text or "").strip()


def test_every_node_has_a_profile_in_an_enclave_of_its_own() -> None:
    profiles = {enclave.get("path"): [p.get("node") for p in enclave.iter("profile")] for enclave in POLICY.iter("enclave")}
    missing = set(NODES) - {node for nodes in profiles.values() for node in nodes}
    assert not missing
    assert profiles == {f"/vessel_hsmc/{node}": [node] for nodes in profiles.values() for node in nodes}


def test_the_policy_names_no_topic_that_the_package_does_not_have() -> None:
    for node in NODES:
        for rule in ("publish", "subscribe"):
            assert allowed(node, rule) <= WATCHED_TOPICS.keys() | BEYOND


def test_only_the_controller_may_command_the_ship() -> None:
    assert [node for node in NODES if "cmd_wrench" in allowed(node, "publish")] == ["controller"]


@pytest.mark.parametrize("node", NODES)
def test_no_rule_admits_everything(node: str) -> None:
    assert not {"*", "/*"} & (allowed(node, "publish") | allowed(node, "subscribe") | allowed(node, "reply"))

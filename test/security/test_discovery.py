"""Nodes that this package starts stay on the local host unless the user chooses otherwise."""

import os
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from harness import Command
from sockets import sockets_of

from vessel_hsmc_ros.core.install_paths import (
    OLD_PROFILES,
    PEERS,
    PROFILES,
    RANGE,
    TRANSPORTS,
    discovery,
    discovery_profiles,
    profiles_folder,
    share_directory,
)

DEADLINE = 60.0


@pytest.fixture
def _unset(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (PROFILES, OLD_PROFILES, RANGE, PEERS, TRANSPORTS):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def node(tmp_path: Path) -> Iterator[Callable[[str, dict[str, str]], Command]]:
    """Start a node by its module with variables in its environment."""
    started: list[Command] = []

    def start(name: str, environment: dict[str, str]) -> Command:
        started.append(Command([sys.executable, "-m", "vessel_hsmc_ros.nodes", name], tmp_path, environment))
        return started[-1]

    yield start
    for command in started:
        command.kill()


@pytest.mark.usefixtures("_unset")
@pytest.mark.parametrize("variable", [(RANGE, "SUBNET"), (RANGE, "off"), (PEERS, "192.0.2.7"), (TRANSPORTS, "UDPv4")])
def test_a_users_word_on_discovery_takes_effect(monkeypatch: pytest.MonkeyPatch, variable: tuple[str, str]) -> None:
    monkeypatch.setenv(*variable)
    assert Path(discovery_profiles()).name == "fastdds_network.xml"


@pytest.mark.usefixtures("_unset")
def test_profiles_of_the_user_come_before_those_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    assert Path(discovery_profiles()).name == "fastdds.xml"
    monkeypatch.setenv(RANGE, "localhost")
    assert Path(discovery_profiles()).name == "fastdds.xml"
    monkeypatch.setenv(PROFILES, "mine.xml")
    assert discovery_profiles() == "mine.xml"


SPACE = "{http://www.eprosima.com}"


def profiles(name: str) -> Any:
    return ElementTree.parse(share_directory() / "config" / name).getroot()  # noqa: S314 - our own files


def contents(root: Any) -> list[Any]:
    return [(each.tag, each.attrib, (each.text or "").strip()) for each in root.iter()]


def remove(root: Any, unwanted: Callable[[Any], bool]) -> int:
    """Remove the elements that match; returns how many did."""
    found = [(parent, child) for parent in root.iter() for child in parent if unwanted(child)]
    for parent, child in found:
        parent.remove(child)
    return len(found)


def test_the_profiles_for_other_machines_differ_in_the_transports_only() -> None:
    local = profiles("fastdds.xml")
    transports = [f"{SPACE}{tag}" for tag in ("transport_descriptors", "useBuiltinTransports", "userTransports")]
    assert remove(local, lambda each: each.tag in transports) == 3
    assert contents(local) == contents(profiles("fastdds_network.xml"))


@pytest.mark.parametrize("name", ["fastdds.xml", "fastdds_network.xml"])
def test_the_profiles_for_kilted_differ_in_the_names_of_two_elements_only(name: str) -> None:
    renamed = {"heartbeatPeriod": "heartbeat_period", "nackSupressionDuration": "nack_supression_duration"}
    expected = profiles(name)
    changed = [each for each in expected.iter() if each.tag.removeprefix(SPACE) in renamed]
    for each in changed:
        each.tag = SPACE + renamed[each.tag.removeprefix(SPACE)]
    assert len(changed) == 2
    assert contents(expected) == contents(profiles(f"kilted/{name}"))


def test_no_profile_of_nodes_on_one_machine_has_shared_memory() -> None:
    kinds = [each.text for each in profiles("fastdds.xml").iter(f"{SPACE}type")]
    assert kinds == ["UDPv4"]
    assert [each.text for each in profiles("fastdds.xml").iter(f"{SPACE}useBuiltinTransports")] == ["false"]


@pytest.mark.usefixtures("_unset")
def test_a_node_of_this_process_leaves_the_environment_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    with discovery():
        assert Path(os.environ[PROFILES]).name == "fastdds.xml"
    assert PROFILES not in os.environ
    monkeypatch.setenv(PROFILES, "mine.xml")
    with discovery():
        assert os.environ[PROFILES] == "mine.xml"
    assert os.environ[PROFILES] == "mine.xml"


def test_a_node_has_no_socket_beyond_the_loopback_interface(node: Callable[[str, dict[str, str]], Command]) -> None:
    command = node("controller", {PROFILES: str(profiles_folder() / "fastdds.xml")})
    command.until(lambda: "waiting for" in command.text or "subscribes to" in command.text, DEADLINE)
    found = command.until(lambda: sockets_of(command.popen.pid), DEADLINE)
    # A socket bound to the group of discovery hears it where it was joined: with the whitelist on the loopback interface.
    assert all(address.startswith("127.") or address == "239.255.0.1" for address in found), found


def test_the_live_view_listens_on_the_local_host_only() -> None:
    from vessel_hsmc_ros.scenario.parameters import LiveParameters

    assert socket.gethostbyname(LiveParameters().host) == "127.0.0.1"

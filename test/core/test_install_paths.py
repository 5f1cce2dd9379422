"""The middleware's profiles of a node, and what an incomplete installation lacks."""

import os
import sys
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import InstallationError
from vessel_hsmc_ros.core.install_paths import (
    OLD_PROFILES,
    PEERS,
    PROFILES,
    RANGE,
    TRANSPORTS,
    discovery,
    discovery_profiles,
    missing_module,
    require,
)


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (PROFILES, OLD_PROFILES, RANGE, PEERS, TRANSPORTS, "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize("own", [None, "/own/profiles.xml", ""])
def test_after_each_node_the_environment_is_what_it_was_also_after_an_error(
    own: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    if own is not None:
        monkeypatch.setenv(PROFILES, own)
    for _ in range(2):
        with discovery():
            assert os.environ[PROFILES] == discovery_profiles()
        assert os.environ.get(PROFILES) == own
        with pytest.raises(KeyError), discovery():
            raise KeyError
        assert os.environ.get(PROFILES) == own


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({}, "fastdds.xml"),
        ({RANGE: "localhost"}, "fastdds.xml"),
        ({RANGE: "SUBNET"}, "fastdds_network.xml"),
        ({RANGE: "OFF"}, "fastdds_network.xml"),
        ({PEERS: "10.0.0.3"}, "fastdds_network.xml"),
        ({TRANSPORTS: "UDPv4"}, "fastdds_network.xml"),
        ({RANGE: "SUBNET", PROFILES: "/own.xml"}, "own.xml"),
        ({OLD_PROFILES: "/own.xml"}, "own.xml"),
    ],
)
def test_each_choice_of_the_user_leads_beyond_the_own_machine(
    given: dict[str, str], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable, value in given.items():
        monkeypatch.setenv(variable, value)
    assert Path(discovery_profiles()).name == name


@pytest.mark.parametrize("sourced", [False, True])
def test_what_is_missing_is_named_with_the_command_that_installs_it(sourced: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "base_prefix", sys.prefix)
    monkeypatch.setattr("vessel_hsmc_ros.core.install_paths.find_spec", lambda _: None)
    if sourced:
        monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    with pytest.raises(InstallationError) as raised:
        require("yaml", "foxglove", "scipy")
    text = str(raised.value)
    assert text.startswith("yaml, foxglove, scipy are not installed: ")
    assert "`pip install pyyaml foxglove-sdk scipy`" in text
    assert ("`rosdep install` in the workspace, or " in text) == sourced
    one = missing_module(ModuleNotFoundError(name="scipy.linalg"))
    assert one.startswith("scipy is not installed: ")
    assert "`pip install scipy`" in one
    assert "colcon build" in missing_module(ModuleNotFoundError(name="px4_msgs"))
    assert ("colcon build" if sourced else "make wheels") in missing_module(ModuleNotFoundError(name="vessel_hsmc_msgs"))
    assert "source a Jazzy workspace" in missing_module(ModuleNotFoundError(name="sensor_msgs.msg"))

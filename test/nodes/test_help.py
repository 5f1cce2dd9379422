"""The help texts of the nodes, and their answer to arguments that they do not know."""

import importlib
import io
import sys
from collections.abc import Iterator
from typing import Any

import definitions
import pytest
import rclpy

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.node_list import PROGRAMS
from vessel_hsmc_ros.nodes.process import run_node
from vessel_hsmc_ros.scenario import parameters


def found(name: str) -> Any:
    """The class of a node; skips the test without the node's library."""
    program = PROGRAMS[name]
    if name == "px4" and definitions.module("px4_msgs.msg") is None:
        pytest.skip("px4_msgs is not installed, and nothing is there to compile it")
    if name in ("live", "mavlink"):
        pytest.importorskip(program.libraries[0], exc_type=ImportError)
    return getattr(importlib.import_module(program.source), program.kind)


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    yield context
    rclpy.shutdown(context=context)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("option", ["-h", "--help"])
def test_help_describes_task_topics_and_parameters_without_starting_the_node(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str, option: str
) -> None:
    node_class = found(name)
    monkeypatch.setattr(rclpy, "init", lambda **_: pytest.fail("ROS was initialised"))
    assert run_node(node_class, [option, "--ros-args", "-p", "lockstep:=true"]) == 0
    shown = capsys.readouterr().out
    assert PROGRAMS[name].executable in shown
    assert (node_class.__doc__ or "").splitlines()[0] in shown
    assert "--ros-args" in shown
    assert "docs/parameters.md" in shown
    assert all(f" {parameter} = " in shown for parameter in schema.entries((parameters.NODES | parameters.WATCHERS)[name]))


@pytest.mark.parametrize("name", ["vessel_sim", "reference_ship", "controller", "watchdog"])
def test_help_names_every_topic_of_the_node(context: Any, name: str) -> None:
    node_class = found(name)
    node: Any = node_class(context=context)
    topics = [topic.removeprefix(f"/{name}").strip("/") for topics in node._topics.values() for topic in topics]
    services = [service for service, _ in node.get_service_names_and_types_by_node(name, "/") if "parameter" not in service]
    node.destroy_node()
    assert topics
    missing = [topic for topic in topics if topic not in node_class.INTERFACE]
    missing += [service for service in services if service.removeprefix(f"/{name}/") not in node_class.INTERFACE]
    assert not [name for name in missing if "type_description" not in name]


@pytest.mark.parametrize("name", ["vessel_sim", "controller"])
def test_help_is_printed_where_the_encoding_lacks_characters(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    node_class = found(name)
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="ascii", write_through=True))
    assert run_node(node_class, ["--help"]) == 0
    assert b"kg?m?" in raw.getvalue()


@pytest.mark.parametrize("name", PROGRAMS)
def test_an_unknown_argument_of_a_node_is_one_line_and_exit_code_2(capfd: pytest.CaptureFixture[str], name: str) -> None:
    node_class = found(name)
    assert run_node(node_class, ["--speed", "3"]) == 2
    captured = capfd.readouterr()
    (line,) = (captured.out + captured.err).splitlines()
    assert "--speed is not an argument of this node" in line
    assert "--ros-args -p NAME:=VALUE" in line

"""Runs with scripted faults, as a user starts them."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness import Command, exit_code
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.bags.reader import Bag, open_bag

RUN = ("run", "figure_eight", "--set", "controller.law=pd", "--set")

LOST = "faults: [{at: 0.3, duration: 1.0, kind: lose_position, topic: odom}]"


@pytest.fixture
def carried_out(start: Callable[..., Command], tmp_path: Path) -> Callable[..., tuple[Bag, dict[str, Any]]]:
    """Run a scenario with a script; returns the bag and the summary."""

    def carry_out(script: str, duration: float, *options: str) -> tuple[Bag, dict[str, Any]]:
        path = tmp_path / "faults.yaml"
        path.write_text(script, encoding="utf-8")
        command = start("vessel-hsmc", *RUN, f"vessel_sim.duration={duration}", "--faults", path, *options)
        assert command.wait() == 0, command.text
        (folder,) = command.output.parent.glob("runs/*")
        return open_bag(folder / "bag"), json.loads((folder / "run.json").read_text(encoding="utf-8"))

    return carry_out


def operations(bag: Bag) -> dict[float, int]:
    """The operation of the controller by the time of its state, s."""
    return {at_of(m): m.operation for _, _, m in bag.messages("/controller/state")}


def at_of(message: Any) -> float:
    """The stamp of a message, s."""
    return float(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)


def contents(bag: Bag, *topics: str) -> list[list[str]]:
    """The messages as text: where a string ends, serialized messages are filled up with bytes of no meaning."""
    return [[str(message) for _, _, message in bag.messages(topic)] for topic in topics]


@pytest.mark.long
def test_two_lockstep_runs_of_a_script_are_alike_and_a_silent_input_leads_to_the_safe_action_and_back(
    carried_out: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = """
seed: 2
faults:
  - {at: 0.1, duration: 0.4, kind: drop, topic: odom, probability: 0.5}
  - {at: 0.25, duration: 0.35, kind: delay, topic: reference, delay: 0.2, jitter: 0.3}
  - {at: 0.6, duration: 0.2, kind: reverse, topic: cmd_wrench}
  - {at: 0.9, duration: 0.7, kind: drop, topic: odom}
"""
    first, summary = carried_out(script, 2.1)
    second, _ = carried_out(script, 2.1, "--no-page")
    topics = ("/odom", "/relayed/odom", "/relayed/reference", "/relayed/cmd_wrench", "/applied_wrench")
    assert contents(first, *topics) == contents(second, *topics)
    assert contents(first, "/odom") != contents(first, "/relayed/odom")
    assert summary["faults"][0] == "drop of odom (probability = 0.5)"
    assert [(event.time, event.kind, event.text) for event in first.events()][:2] == [
        (0.1, "fault", "drop of odom (probability = 0.5) begins"),
        (0.25, "fault", "delay of reference (delay = 0.2, jitter = 0.3) begins"),
    ]
    found = {at: operation for at, operation in operations(first).items() if at > 0.8}
    left = [at for at, operation in found.items() if operation != 1]
    assert 1.4 <= left[0] <= 1.5 + 1e-6
    assert left[-1] < 2.05
    commands = np.array([(m.wrench.force.x, m.wrench.torque.z) for _, _, m in first.messages("/cmd_wrench")])
    assert np.isfinite(commands).all()
    # Page and verification of such a run.
    page = (Path(first.path).parent / "report.html").read_text(encoding="utf-8")
    assert "drop of odom (probability = 0.5) begins" in page
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", "replay", str(first.path), "--verify"])
    assert exit_code() == 1
    assert "run with faults on /odom" in capsys.readouterr().err


@pytest.mark.long
def test_a_lost_position_leads_to_the_safe_action_with_its_reason_and_back(carried_out: Any) -> None:
    bag, _ = carried_out(LOST, 1.9, "--no-page")
    lost = [m for _, _, m in bag.messages("/relayed/odom") if math.isnan(m.pose.pose.position.x)]
    assert lost
    numbers = [(m.pose.pose.orientation.z, m.twist.twist.linear.x, m.twist.twist.angular.z) for m in lost if m.header.frame_id]
    assert np.isfinite(numbers).all()
    assert len(numbers) == len(lost)
    left = [at for at, operation in operations(bag).items() if at > 0.2 and operation != 1]
    assert 0.8 <= left[0] <= 0.9 + 1e-6
    assert left[-1] < 1.8
    states = [m for _, _, m in bag.messages("/controller/state") if 0.9 < at_of(m) < 1.2]
    assert {m.reason for m in states} == {ControlState.NOT_FINITE}


@pytest.mark.long
def test_a_lost_position_is_ridden_through_by_dead_reckoning_where_that_is_declared(carried_out: Any) -> None:
    declared = ("--set", "controller.safety.dead_reckoning=2")
    bag, _ = carried_out(LOST, 1.5, "--no-page", *declared)
    assert any(math.isnan(m.pose.pose.position.x) for _, _, m in bag.messages("/relayed/odom"))
    assert {operation for at, operation in operations(bag).items() if at > 0.2} == {1}


@pytest.mark.long
def test_the_run_goes_on_while_a_node_is_suspended_and_restarted_on_demand(carried_out: Any) -> None:
    bag, summary = carried_out(
        "faults:\n"
        "  - {at: 0.5, duration: 0.8, kind: stop, node: controller}\n"
        "  - {at: 1.8, duration: 0.5, kind: restart, node: controller}\n",
        4.0,
        "--real-time",
        "--no-page",
    )
    assert summary["failure"] == ""
    assert [event.text for event in bag.events()] == [
        "stop of controller begins",
        "stop of controller ends",
        "restart of controller begins",
        "restart of controller ends",
    ]
    log = (Path(bag.path).parent / "logs" / "controller.log").read_text(encoding="utf-8")
    started = float(re.findall(r"\[(\S+)\] \[controller\]: law pd at", log)[0])
    at = np.array([*operations(bag)])
    assert started < at[0], "the log of the node that was killed is kept; the new one's may be busy with its start until the end"
    at -= next(m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for _, _, m in bag.messages("/odom"))
    assert not ((at > 0.7) & (at < 1.25)).any()
    assert not ((at > 2.0) & (at < 2.3)).any()


def test_a_script_that_cannot_be_carried_out_ends_the_command_before_it_starts(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "faults.yaml"
    path.write_text("faults: [{at: 1.0, kind: kill, node: controller}]", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["vessel-hsmc", *RUN, "vessel_sim.duration=4", "--faults", str(path)])
    assert exit_code() == 2
    assert "faults[0].kind = kill is not possible in lockstep" in capsys.readouterr().err
    assert not [*tmp_path.glob("runs/*")]

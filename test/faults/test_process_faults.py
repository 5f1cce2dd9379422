"""Faults of processes: a node is absent for as long as its fault demands it, and counts as any other before and after."""

import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from vessel_hsmc_ros.faults import Fault, FaultScript
from vessel_hsmc_ros.messages.topics import RELAYED
from vessel_hsmc_ros.nodes.runs.processes import NodeGroup
from vessel_hsmc_ros.scenario.scenario import dump_scenario, for_nodes, load_scenario, relayed_topics

supervisor = pytest.importorskip("vessel_hsmc_ros.nodes.runs.supervisor", reason="ROS is not installed")

LIMIT = 20.0


@pytest.fixture
def nodes(tmp_path: Path) -> Iterator[Any]:
    """A group of which the controller is a process that does nothing."""
    with NodeGroup(tmp_path / "none.yaml", tmp_path, "", {}) as group:
        group._start("controller", ["sleep", "60"], tmp_path / "controller.log", ["controller"])
        yield group


def monitored(nodes: Any, faults: Any, steps: list[Callable[[], object]]) -> Any:
    """How a run ends in which the steps happen one after the other; interrupted if it goes on after the last."""
    left = iter(steps)
    done: list[bool] = []

    def listen(_: float) -> None:
        step = next(left, None)
        if step is None:
            done.append(True)
        else:
            step()

    listener = SimpleNamespace(listen=listen, status={}, heard_at={})
    interrupts = SimpleNamespace(status=lambda: supervisor.ExitStatus(130) if done else None)
    watched = supervisor.Watched(supervisor.spread((), False, True), nodes, SimpleNamespace(processes=[]), listener, faults)
    return supervisor._monitor(watched, interrupts, lambda _: None)


@pytest.mark.parametrize("kind", ["stop", "restart"])
def test_a_node_that_fails_after_its_fault_has_ended_ends_the_run(nodes: Any, kind: str) -> None:
    fault = Fault(at=1.0, duration=2.0, kind=kind, node="controller")
    faults = supervisor.ProcessFaults(FaultScript((fault,)), nodes)

    def fail() -> None:
        nodes.processes[0].popen.kill()
        nodes.processes[0].popen.wait(LIMIT)

    def absent() -> None:
        if kind == "restart":
            nodes.processes[0].popen.wait(LIMIT)

    begin, end = (lambda: faults.on_event(f"{fault.describe()} begins")), (lambda: faults.on_event(f"{fault.describe()} ends"))
    assert monitored(nodes, faults, [begin, absent, end, begin, absent, end]).code == 130, "as the script demands"
    status = monitored(nodes, faults, [fail])
    assert (status.code, status.failure) == (1, "controller was killed by SIGKILL")


@pytest.mark.parametrize("duration", [0.0, 2.0])
def test_a_node_that_a_fault_kills_for_good_does_not_end_the_run_and_is_not_started_again(nodes: Any, duration: float) -> None:
    fault = Fault(at=1.0, kind="kill", node="controller", duration=duration)
    faults = supervisor.ProcessFaults(FaultScript((fault,)), nodes)
    killed = nodes.processes[0].popen
    steps = [lambda: faults.on_event(f"{fault.describe()} begins"), lambda: killed.wait(LIMIT)]
    assert monitored(nodes, faults, [*steps, lambda: faults.on_event(f"{fault.describe()} ends")]).code == 130
    assert [process.popen for process in nodes.processes] == [killed]
    assert killed.poll() == -signal.SIGKILL
    assert (faults.affected, faults.restarted) == ({"controller"}, set())


@pytest.mark.parametrize("real_time", [False, True])
@pytest.mark.parametrize("topics", [["odom"], ["cmd_wrench", "mine", "odom"]])
def test_a_run_with_faults_records_what_it_would_without_them_and_what_is_relayed(real_time: bool, topics: list[str]) -> None:
    scenario = load_scenario("case2_tracking", {**for_nodes(True, real_time, ""), "recorder.topics": topics})
    made = supervisor.Injection(FaultScript((), 1), scenario).relayed(scenario)
    assert list(made.recorder.topics) == [*topics, *(f"{RELAYED}{topic}" for topic in relayed_topics(scenario))]
    # In lockstep each step is answered, whatever becomes of the messages; nothing else is changed.
    changed = {*dump_scenario(made).splitlines()} - {*dump_scenario(scenario).splitlines()}
    names = {line.strip(" -").partition(":")[0] for line in changed if RELAYED not in line and "topics" not in line}
    assert names == (set() if real_time else {"ride_through"})

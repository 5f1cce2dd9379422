"""Several vessels in one process: when they end, and which of them a failure names."""

import re
from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.nodes import node_group
from vessel_hsmc_ros.nodes.process import CANNOT_START, FAILED


class Node:
    """Stands for a node: knows whether it has finished, and notes its failure and its end."""

    def __init__(self, vessel: str, name: str) -> None:
        self.vessel, self.name = vessel, name
        self.finished = self.closed = False
        self.failure = ""
        self.POLL_PERIOD = 0.0

    def spin(self, running: Callable[[], bool]) -> None:
        assert not running(), "at its end a node has no time but for what it must"

    def get_name(self) -> str:
        return self.name

    def get_fully_qualified_name(self) -> str:
        return f"/{self.vessel}/{self.name}"

    def announce(self) -> None:
        """Nothing is logged."""

    def fail(self, reason: str) -> None:
        self.failure = reason

    def callback(self) -> None:
        raise SimulationError("no command came")

    def close(self) -> None:
        self.closed = True


class Group:
    """Two vessels, and the order of what happens in their executor."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.nodes = {(v, n): Node(v, n) for v in ("alpha", "beta") for n in ("vessel_sim", "controller")}
        self.turns: list[Callable[[], None]] = []
        self.served = 0
        executor = SimpleNamespace(spin_while=self._spin)
        monkeypatch.setattr(node_group, "executor_of", lambda _: nullcontext(executor))
        monkeypatch.setattr(node_group, "spare_collections", lambda: None)

    def _spin(self, running: Callable[[], bool]) -> None:
        while running():
            assert self.served < len(self.turns), "it does not end"
            self.turns[self.served]()
            self.served += 1

    def run(self, running: Callable[[], bool] = lambda: True) -> int:
        nodes: Any = list(self.nodes.values())
        return node_group._run(nodes, running)

    def finish(self, vessel: str) -> Callable[[], None]:
        return lambda: setattr(self.nodes[vessel, "vessel_sim"], "finished", True)


@pytest.fixture
def group(monkeypatch: pytest.MonkeyPatch) -> Group:
    return Group(monkeypatch)


@pytest.mark.parametrize("order", [("alpha", "beta"), ("beta", "alpha")])
def test_a_group_ends_with_its_last_plant_and_closes_all_nodes(group: Group, order: tuple[str, str]) -> None:
    group.turns = [group.finish(order[0]), lambda: None, lambda: None, group.finish(order[1])]
    assert group.run() == 0
    assert group.served == 4
    assert all(node.closed and not node.failure for node in group.nodes.values())


def test_a_signal_ends_a_group_before_its_plants(group: Group) -> None:
    group.turns = [lambda: None] * 2
    assert group.run(lambda: group.served < 2) == 0
    assert all(node.closed for node in group.nodes.values())


@pytest.mark.parametrize("failing", [("alpha", "vessel_sim"), ("beta", "controller")])
def test_a_failure_is_that_of_the_node_in_whose_callback_it_occurred_and_closes_all(group: Group, failing: Any) -> None:
    group.turns = [lambda: group.nodes[failing].callback()]
    assert group.run() == FAILED
    failures = {key: node.failure for key, node in group.nodes.items() if node.failure}
    assert failures == {failing: "no command came"}
    assert all(node.closed for node in group.nodes.values())


def test_a_node_that_fails_at_its_end_keeps_no_other_from_ending(group: Group) -> None:
    failing = group.nodes["alpha", "controller"]
    setattr(failing, "close", failing.callback)  # noqa: B010 - of another type
    group.turns = [group.finish("alpha"), group.finish("beta")]
    assert group.run() == FAILED
    assert failing.failure == "no command came"
    assert [node.closed for node in group.nodes.values()] == [True, False, True, True]


def test_a_middleware_or_a_module_that_is_missing_is_one_line_and_no_start(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail(error: Exception) -> Callable[..., Any]:
        def call(*_: Any, **_options: Any) -> Any:
            raise error

        return call

    with monkeypatch.context() as patched:
        patched.setattr(node_group, "_class_of", fail(ModuleNotFoundError("No module named 'mcap'", name="mcap")))
        assert node_group.main(["alpha/recorder"]) == CANNOT_START
    assert re.search(r"\[alpha.recorder\]: .*mcap", capfd.readouterr().err)
    monkeypatch.setattr("rclpy.init", fail(RuntimeError("no such middleware")))
    assert node_group.main(["alpha/vessel_sim"]) == CANNOT_START
    error = capfd.readouterr().err
    assert "cannot start: no such middleware" in error
    assert "Traceback" not in error


def test_a_file_that_cannot_be_read_is_one_line_and_no_start(capfd: pytest.CaptureFixture[str]) -> None:
    assert node_group.main(["alpha/vessel_sim", "--law-file", "/no/such/law.py"]) == CANNOT_START
    error = capfd.readouterr().err
    assert "/no/such/law.py" in error
    assert "Traceback" not in error

"""The process of a node: how it is scheduled, and what signals find while it ends."""

import gc
import subprocess
import sys
from functools import partial
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.executors import ExternalShutdownException
from rclpy.parameter import Parameter

from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.node_list import PROGRAMS, NodeProgram
from vessel_hsmc_ros.nodes import process
from vessel_hsmc_ros.nodes.base import WATCHER_NICENESS
from vessel_hsmc_ros.nodes.markers import MarkerNode
from vessel_hsmc_ros.nodes.process import run_node

PROGRAM = """
import gc, os, threading
from vessel_hsmc_ros.nodes.process import spare_collections
from vessel_hsmc_ros.nodes.scheduling import run_in_batches
threading.Thread(target=threading.Event().wait, daemon=True).start()
run_in_batches()
print(*{os.sched_getscheduler(int(thread)) == os.SCHED_BATCH for thread in os.listdir("/proc/self/task")})
spare_collections()
print(gc.get_freeze_count() > 1000)
"""


def test_all_threads_run_in_batches_and_what_the_start_created_is_not_collected() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "True"]


class Finished(MarkerNode):
    def on_own_process(self) -> None:
        self.finished = True


@pytest.mark.parametrize(("arguments", "code"), [([], 0), (["--ros-args", "-p", "rate_hz:=-1.0"], 2)])
def test_rclpy_restores_no_default_handler_while_a_node_ends(
    monkeypatch: pytest.MonkeyPatch, arguments: list[str], code: int
) -> None:
    lowered: list[int] = []  # of this process it would last
    monkeypatch.setattr("os.nice", lowered.append)
    restored: list[bool] = []  # for an instant, in which a second Ctrl-C would kill the process
    monkeypatch.setattr("rclpy.uninstall_signal_handlers", lambda: restored.append(True))
    try:
        assert run_node(Finished, arguments) == code
    finally:
        gc.unfreeze()
    assert not restored
    assert lowered == [WATCHER_NICENESS]


@pytest.mark.parametrize("failing", ["spin", "close"])
@pytest.mark.parametrize("error", [SimulationError, RuntimeError, SystemExit, ExternalShutdownException])
def test_a_node_whose_work_fails_is_closed_once_unless_its_context_has_ended(failing: str, error: type[BaseException]) -> None:
    done: list[str] = []

    def work(name: str, *_: object) -> None:
        done.append(name)
        if name == failing:
            raise error("as planned")

    node: Any = SimpleNamespace(spin=partial(work, "spin"), close=partial(work, "close"), fail=lambda text: done.append(text))
    caught: type[BaseException] | None = None
    code = 0
    try:
        code = process.do_all((partial(node.spin, lambda: True), node.close), [node])
    except (Exception, SystemExit) as raised:
        caught = type(raised)
    unexpected = error in (RuntimeError, SystemExit)
    text = f"unexpected {error.__name__}: as planned" if unexpected else "as planned"
    logged = [] if error is ExternalShutdownException else [text]
    closed = [] if error is ExternalShutdownException else ["close"]
    assert done == (["spin", *logged, *closed] if failing == "spin" else ["spin", "close", *logged])
    assert caught is (error if unexpected else None)
    assert code == (process.FAILED if error is SimulationError else 0)


class Part:
    """A part of a node, which does its work for it."""

    def __init__(self, node: Any) -> None:
        self._node = node

    def work(self) -> None:
        raise SimulationError("as planned")


def test_an_error_in_a_part_of_a_node_is_reported_by_this_node() -> None:
    reported: list[str] = []
    nodes: list[Any] = [SimpleNamespace(fail=lambda text, name=name: reported.append(f"{name}: {text}")) for name in "abc"]
    assert process.do_all([Part(nodes[1]).work], nodes) == process.FAILED
    assert reported == ["b: as planned"]


@pytest.mark.parametrize("program", PROGRAMS.values(), ids=lambda node: node.executable)
def test_a_node_that_cannot_start_leaves_the_graph_although_its_error_is_kept(bench: Any, program: NodeProgram) -> None:
    for library in program.libraries:
        pytest.importorskip(library)
    kind = getattr(import_module(program.source), program.kind)
    # A node of another test that was killed stays in the graph until its lease ends.
    bench.until(lambda: kind.NAME not in bench.probe.get_node_names())
    with pytest.raises(ParameterError) as kept:
        kind(context=bench.context, parameter_overrides=[Parameter("no_such_parameter", value=1.0)])
    bench.until(lambda: kind.NAME not in bench.probe.get_node_names(), deadline=5.0)
    assert kept.tb is not None

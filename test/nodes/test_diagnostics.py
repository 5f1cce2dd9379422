"""Diagnostics: one status for the node as a whole, one for each of its tasks, at once where a level changes."""

from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.nodes.reporting import ERROR, OK, STALE, WARN, DiagnosticTask, Reporter, summarised
from vessel_hsmc_ros.scenario.parameters import RecorderParameters

OWN = DiagnosticTask("", OK, "running", {"steps": 3})


@pytest.mark.parametrize(
    ("levels", "overall", "message"),
    [
        ((OK, OK), OK, "running"),
        ((OK, WARN), WARN, "input age: text 1"),
        ((WARN, ERROR), ERROR, "period: text 0; input age: text 1"),
        ((STALE, OK), WARN, "period: text 0"),
    ],
)
def test_a_node_is_as_bad_as_its_worst_concern_and_names_it(levels: tuple[bytes, bytes], overall: bytes, message: str) -> None:
    names = ("period", "input age")
    others = [DiagnosticTask(name, level, f"text {i}", {}) for i, (name, level) in enumerate(zip(names, levels, strict=True))]
    assert summarised(OWN, others) == DiagnosticTask("", overall, message, {"steps": 3})


def test_a_problem_of_the_nodes_own_work_is_not_hidden_by_a_concern() -> None:
    own = DiagnosticTask("", WARN, "waiting", {})
    assert summarised(own, [DiagnosticTask("period", ERROR, "late", {})]) == own


class TwoConcerns(ReferenceShipNode):
    """A node with a task whose level a test sets."""

    level = OK

    def diagnostic_tasks(self) -> list[DiagnosticTask]:
        return [super().diagnostic_tasks()[0], DiagnosticTask("pace", self.level, "as set", {"late": 2})]


def test_a_change_of_level_is_published_at_once_and_named_after_node_and_concern(bench: Any) -> None:
    arrays = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    node = bench.start(TwoConcerns, lockstep=False)
    bench.until(lambda: node.connected and arrays and len(arrays[-1].status) > 1)
    node.level = WARN
    node.publish_diagnostics(only_changes=True)
    count = len(arrays)
    node.publish_diagnostics(only_changes=True)  # nothing has changed since
    whole, task = bench.until(lambda: arrays[-1].status[0].level == WARN and arrays[-1].status)
    assert len(arrays) <= count + 1
    assert (whole.name, whole.message) == ("reference_ship", "pace: as set")
    assert (task.name, task.level, task.message) == ("reference_ship: pace", WARN, "as set")
    assert [(pair.key, pair.value) for pair in task.values] == [("late", "2")]


def test_each_change_of_a_level_is_published_at_once_and_nothing_else_is(bench: Any) -> None:
    reporter, published = Reporter(bench.probe, lambda: 7, RecorderParameters), []
    reporter.keep = lambda _, array: published.append([status.level for status in array.status])
    for first, second in (b"\0\0", b"\0\0", b"\0\2", b"\0\2", b"\0\0", b"\0\0", b"\1\0", b"\0\2", b"\0\2", b"\0\0"):
        reporter.diagnose(
            [DiagnosticTask("", bytes([first]), "", {}), DiagnosticTask("a", bytes([second]), "", {})], only_changes=True
        )
    assert [(a[0], b[0]) for a, b in published] == [(0, 0), (0, 2), (0, 0), (1, 0), (0, 2), (0, 0)]
    reporter.diagnose([DiagnosticTask("", b"\0", "", {})])
    reporter.diagnose([DiagnosticTask("", b"\0", "", {})])
    assert len(published) == 8, "the periodic ones always"


@pytest.mark.parametrize(("own", "overall"), [(OK, WARN), (WARN, WARN), (ERROR, ERROR)])
def test_an_endpoint_that_cannot_be_connected_makes_no_problem_of_the_node_smaller(
    bench: Any, monkeypatch: pytest.MonkeyPatch, own: bytes, overall: bytes
) -> None:
    node = bench.start(ReferenceShipNode, lockstep=False)
    node.connected = True
    for incompatible in ("/odom: nothing passes", ""):
        monkeypatch.setattr(node.compatibility, "problem", lambda incompatible=incompatible: incompatible)
        found = node._overall(DiagnosticTask("", own, "as it is", {"steps": 3}))
        assert found.level == (overall if incompatible else own)
        assert ("as it is" in found.message) == (own != OK or not incompatible)
        assert incompatible in found.message
        assert found.values == {"steps": 3}

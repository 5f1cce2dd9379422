"""Nodes are stopped in an order in which the recorder still receives the final messages of all others."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from vessel_hsmc_ros.nodes.runs.processes import NodeGroup, NodeProcess


@pytest.mark.parametrize("names", [("recorder", "controller", "vessel_sim"), ("vessel_1/controller", "recorder", "vessel_1/sim")])
def test_the_recorder_is_interrupted_after_all_other_nodes_have_ended(tmp_path: Path, names: tuple[str, ...]) -> None:
    events: list[tuple[str, str]] = []

    def process(name: str) -> Any:
        return SimpleNamespace(
            send_signal=lambda number: events.append((number.name, name)), wait=lambda _: events.append(("ended", name))
        )

    group = NodeGroup(tmp_path / "params.yaml", tmp_path, "", {})
    group.processes += [NodeProcess(name, cast("Any", process(name)), tmp_path / "log") for name in names]
    group.stop()
    others = [name for name in names if name != "recorder"]
    assert {name for what, name in events if what == "SIGINT"} == {*names}
    interrupted = events.index(("SIGINT", "recorder"))
    assert all(events.index(("ended", name)) < interrupted for name in others)
    assert events.index(("SIGINT", others[1])) < events.index(("ended", others[0])), "the others end at the same time"
    assert events[-1] == ("ended", "recorder")

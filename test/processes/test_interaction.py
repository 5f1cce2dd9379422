"""A running real-time simulation that is controlled by the command alone; each action is an event in its bag."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from harness import run_folder

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.cli.command import execute
from vessel_hsmc_ros.report.from_bag import of_bag

LIMIT, NAMESPACE = 60.0, "moving"


def test_every_action_on_a_running_vessel_is_an_event_in_its_bag(
    start: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "route.csv").write_text("40,10\n60,-20\n", encoding="utf-8")
    settings = ("--set", "vessel_sim.duration=0")
    run = start("vessel-hsmc", "run", "waypoints", "--real-time", "--namespace", NAMESPACE, *settings)
    actions = (
        ("set", "controller.guided.position_gain=0.5"),
        ("call", "pause"),
        ("call", "resume"),
        ("path", tmp_path / "route.csv", "--detach"),
        ("call", "reset"),
    )
    runs = run.output.parent / "runs"
    run.until(lambda: (found := run_folder(runs)) and (found / "bag" / "bag_0.mcap").exists(), LIMIT)

    def carried_out(action: Sequence[object]) -> str:  # in this process, whose imports they share
        monkeypatch.setattr("sys.argv", ["vessel-hsmc", *map(str, action), "--namespace", NAMESPACE])
        assert execute() == 0, (action, capsys.readouterr(), run.text)
        return capsys.readouterr().out

    for action in actions:
        carried_out(action)
    shown = (
        "time",
        "ship",
        "reference",
        "error",
        "surge force",
        "yaw moment",
        "vessel_sim",
        "reference_ship",
        "controller",
        "event",
    )

    def all_are_shown() -> bool:
        watched = carried_out(("watch", "--once"))
        return all(f"{name} " in watched for name in shown)

    # A node states how it is once a second, or later on a busy machine: a single look may come before.
    run.until(all_are_shown, LIMIT)

    def ship_in_json() -> Any:
        return json.loads(carried_out(("watch", "--once", "--json")))["ship"]

    run.until(lambda: set(ship_in_json() or ()) == {"x", "y", "psi", "u", "v", "r"}, LIMIT)
    run.popen.send_signal(2)
    assert run.wait(LIMIT) == 130, run.text
    folder = run_folder(runs)
    assert folder is not None
    bag = open_bag(folder / "bag")
    assert [(event.node, event.kind) for event in bag.events()] == [
        ("controller", "parameter"),
        ("vessel_sim", "pause"),
        ("reference_ship", "pause"),
        ("vessel_sim", "resume"),
        ("reference_ship", "resume"),
        ("reference_ship", "path"),
        ("vessel_sim", "reset"),
        ("reference_ship", "reset"),
        ("controller", "reset"),
    ]
    end = float(bag.run().time[-1])
    assert all(event.time <= end for event in bag.events())
    assert {mark.kind for mark in of_bag(folder / "bag").marks} == {"parameter", "pause", "resume", "path", "reset"}
    assert bag.scenario(at=end).controller.guided.position_gain == 0.5

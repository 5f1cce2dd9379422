"""Goals by the command and by the example, over the executables: sailed to the end, refused, and cancelled by Ctrl-C."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from harness import Command, run_folder

from vessel_hsmc_ros.bags.reader import open_bag

pytestmark = pytest.mark.alone  # a run as fast as the machine allows takes both cores from other tests
LIMIT, EXAMPLE = 240.0, Path(__file__).resolve().parents[2] / "examples" / "survey_by_position.py"
SETTINGS = {
    "vessel_sim.duration": "0",
    "vessel_sim.command_timeout": "60",  # on a busy machine the reference takes its time to plan
    "reference_ship.path.time": "-1",
    "reference_ship.actions.datum": "[63.44,10.39]",
    "reference_ship.actions.reach": "5",
}


@pytest.fixture
def run(start: Callable[..., Command]) -> Command:
    """A run of the nodes that waits for goals, as fast as the machine allows."""
    running = start("vessel-hsmc", "run", "waypoints", *(part for pair in SETTINGS.items() for part in ("--set", "=".join(pair))))

    runs = running.output.parent / "runs"
    running.until(lambda: (found := run_folder(runs)) and (found / "bag" / "bag_0.mcap").exists(), LIMIT)
    return running


def until_accepted(start: Callable[..., Command], *arguments: Any) -> Command:
    """Send a goal once the nodes have begun: before that it is refused."""
    for _ in range(20):
        sent = start(*arguments)
        if sent.wait(LIMIT) == 0 or not any(part in sent.text for part in ("it waits for other nodes", "no node")):
            break
    return sent


def test_the_command_waits_until_the_vessel_is_there_and_cancels_at_ctrl_c(
    start: Callable[..., Command], run: Command, tmp_path: Path
) -> None:
    (tmp_path / "route.csv").write_text("x,y\n30,0\n60,10\n")
    sailed = until_accepted(start, "vessel-hsmc", "path", tmp_path / "route.csv")
    assert sailed.popen.returncode == 0, (sailed.text, run.text)
    assert "reached: the vessel is " in sailed.text
    refused = start("vessel-hsmc", "goto", "1e7", "0", "0")
    assert refused.wait(LIMIT) == 1
    assert "goal must be within 100 km of the reference" in refused.text
    far = start("vessel-hsmc", "goto", "5000", "0", "0")
    far.until(lambda: "m/s" in far.text, LIMIT)
    far.popen.send_signal(signal.SIGINT)
    assert far.wait(LIMIT) == 130
    assert far.text.endswith("interrupted\n")
    log = run_folder(run.output.parent / "runs") / "logs" / "node_group.log"  # type: ignore[operator]
    run.until(lambda: "NavigateToPose: cancelled: the vessel comes to rest and keeps station" in log.read_text(), LIMIT)


def test_the_example_surveys_a_rectangle_by_latitude_and_longitude_and_its_bag_has_a_page(
    start: Callable[..., Command], run: Command
) -> None:
    surveyed = until_accepted(start, "python", EXAMPLE, 63.4401, 10.3902, 50, 40, 40)
    assert surveyed.popen.returncode == 0, (surveyed.text, run.text)
    assert "waypoint 1, " in surveyed.text
    assert "reached: the vessel is " in surveyed.text
    os.kill(run.popen.pid, signal.SIGINT)
    assert run.wait(LIMIT) == 130, run.text
    folder = run_folder(run.output.parent / "runs")
    assert folder is not None
    events = [event.text for event in open_bag(folder / "bag").events() if event.kind == "path"]
    assert len(events) == 1
    assert events[0].startswith("FollowGPSWaypoints: 4 waypoints, the last at x = ")
    report = start("vessel-hsmc", "report", folder / "bag")
    assert report.wait(LIMIT) == 0, report.text
    assert list(folder.rglob("*.html")) or list(report.output.parent.rglob("*.html"))

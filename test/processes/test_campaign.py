"""Campaigns as processes: killed and started again, on a Dask cluster, and a row repeated by the ROS nodes."""

import json
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_comparison import assert_equal_to_the_offline_bag
from campaigns import INERTIA, X, campaign_file
from durations import rest_long
from harness import Command, run_folder

from vessel_hsmc_ros import load_law_file, open_bag, simulate
from vessel_hsmc_ros.control.laws import Registry
from vessel_hsmc_ros.studies.campaign.dataset import Dataset, read_rows
from vessel_hsmc_ros.studies.campaign.execute import run_campaign

pytest.importorskip("pyarrow")

Start = Callable[..., Command]

LAW_FILE = Path(__file__).parents[2] / "docs" / "examples" / "my_law.py"
RUNS = 12
LONG: dict[str, Any] = {
    # A law of one's own is not compiled, so that the campaign takes some seconds on every machine.
    **{"laws": ["my_law"], "runs": RUNS, "chunk": 2, "limits": {"position_error_rms": 1.0}},
    **{"set": {"vessel_sim.duration": 1.0}, "draw": {INERTIA: {"uniform": [0.8, 1.2], "relative": True}, X: {"normal": [5, 1]}}},
}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Dataset(folder).files()}


def registered(worker: Command) -> bool:
    """Whether a Dask worker is part of its cluster."""
    return "Registered to" in worker.text


def at_least(folder: Path, number: int) -> Callable[[], bool]:
    """Whether a folder has a number of chunks."""
    return lambda: len(Dataset(folder).files()) >= number


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, bytes]]:
    """The files of the long campaign as this process computes them."""
    from vessel_hsmc_ros.control.laws import LAWS

    before = LAWS.others
    load_law_file(LAW_FILE)
    path = tmp_path_factory.mktemp("expected")
    yield contents(run_campaign(campaign_file(path, **LONG), path / "out", workers=1))
    LAWS._others = dict(before)


@pytest.mark.parametrize("workers", rest_long([1, 2]))
def test_a_campaign_that_was_killed_goes_on_without_losing_or_repeating_a_row(
    start: Start, tmp_path: Path, expected: dict[str, bytes], laws: Registry, workers: int
) -> None:
    arguments = [
        "campaign",
        campaign_file(tmp_path, **LONG),
        "--output",
        tmp_path / "out",
        "--law-file",
        LAW_FILE,
        "--workers",
        workers,
    ]
    first = start("vessel-hsmc", *arguments)
    first.until(at_least(tmp_path / "out", 3), 240.0)  # where a kernel has to be compiled first
    first.popen.send_signal(signal.SIGKILL)
    first.popen.wait(60.0)
    before = {path.name: path.stat().st_mtime_ns for path in Dataset(tmp_path / "out").files()}
    second = start("vessel-hsmc", *arguments)
    assert second.wait(240.0) == 0, second.text
    assert contents(tmp_path / "out") == expected
    after = {path.name: path.stat().st_mtime_ns for path in Dataset(tmp_path / "out").files()}
    # A worker may complete the file that it is writing after its parent has been killed.
    assert sum(after[name] == time for name, time in before.items()) >= len(before) - 2
    load_law_file(LAW_FILE)
    assert read_rows(tmp_path / "out").column("run").to_pylist() == list(range(RUNS))


@pytest.fixture
def cluster(start: Start, tmp_path: Path) -> tuple[str, list[Command]]:
    """The address of a Dask scheduler, and its two workers."""
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    scheduler = start(
        *("python", "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"),
        *("--no-dashboard", "--scheduler-file", file),
    )
    scheduler.until(lambda: file.exists() and file.stat().st_size)
    options = ["--nworkers", "1", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", tmp_path]
    worker = ["python", "-m", "distributed.cli.dask_worker", "--scheduler-file", file, *options]
    return json.loads(file.read_text())["address"], [start(*worker) for _ in range(2)]


@pytest.mark.long
def test_a_cluster_writes_the_same_bytes_also_when_a_worker_is_killed(
    start: Start, tmp_path: Path, expected: dict[str, bytes], cluster: tuple[str, list[Command]]
) -> None:
    address, workers = cluster
    file = campaign_file(tmp_path, **LONG)
    command = start("vessel-hsmc", "campaign", file, "--output", tmp_path / "out", "--law-file", LAW_FILE, "--scheduler", address)
    for worker in workers:
        worker.until(partial(registered, worker))
    command.until(at_least(tmp_path / "out", 3))
    workers[0].kill()
    assert command.wait(240.0) == 0, command.text
    assert contents(tmp_path / "out") == expected


def test_a_row_is_repeated_by_the_nodes_bit_identically(start: Start, tmp_path: Path) -> None:
    pytest.importorskip("rclpy")
    draw = {
        "vessel_sim.actuators.yaw_lag": {"uniform": [0.1, 1.0]},
        "vessel_sim.disturbance.earth_fixed.east_force": {"normal": [0.0, 2000.0]},
        "controller.guided.position_gain": {"uniform": [0.8, 1.2], "relative": True},
    }
    changes: dict[str, Any] = {
        "set": {"vessel_sim.duration": 1.0, "controller.observer.enabled": True},
        **{"laws": ["guided"], "runs": 3},
    }
    folder = run_campaign(campaign_file(tmp_path, scenario="realistic", draw=draw, **changes), tmp_path / "out", workers=1)
    command = start("vessel-hsmc", "run", "--campaign", folder, "--run", "2", "--no-page")
    assert command.wait() == 0, command.text
    assert "all metrics are bit-identical to those of row 2 of the campaign" in command.text
    found = run_folder(command.output.parent / "runs")
    assert found
    bag = open_bag(found / "bag")
    counts = {name: series.count for name, series in bag.topics.items()}
    assert counts["/odom"] == counts["/odom/truth"] == counts["/dynamics/truth"] == counts["/disturbance"] == 101
    assert counts["/controller/estimate"] == 51
    run, offline = bag.run(), simulate(bag.scenario())
    for name in ("time", "state", "measured", "reference", "wrench", "disturbance"):
        np.testing.assert_array_equal(getattr(run, name), getattr(offline, name), err_msg=name)
    for name, values in offline.control.items():
        np.testing.assert_array_equal(run.control[name], values, err_msg=name)
    assert not np.array_equal(offline.measured, offline.state)
    assert_equal_to_the_offline_bag(bag, tmp_path / "bag")

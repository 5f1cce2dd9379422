"""The realistic ship over the nodes: noise and waves are bit-identical to those of the offline loop."""

import dataclasses
import subprocess
from pathlib import Path

import numpy as np
import pytest
from bag_comparison import assert_equal_to_the_offline_bag
from harness import BIN

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

DURATION = 3.0


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    folder = tmp_path_factory.mktemp("realistic")
    command = [str(BIN / "vessel-hsmc"), "run", "realistic", "--set", f"vessel_sim.duration={DURATION}", "--no-page"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120.0)
    assert done.returncode == 0, done.stderr
    return open_bag(next((folder / "runs").iterdir()) / "bag")


def test_nodes_and_offline_loop_are_bit_identical(bag: Bag) -> None:
    offline = simulate(load_scenario("realistic", {"vessel_sim.duration": DURATION}))
    recorded = bag.run()
    for field in dataclasses.fields(Run):
        if field.name != "control":
            np.testing.assert_array_equal(getattr(recorded, field.name), getattr(offline, field.name), err_msg=field.name)
    for name, values in offline.control.items():
        np.testing.assert_array_equal(recorded.control[name], values, err_msg=name)
    assert not np.array_equal(offline.measured, offline.state)
    assert offline.control["estimate"].shape == (151, 6)


def test_the_true_state_and_dynamics_are_recorded_at_every_step(bag: Bag) -> None:
    counts = {name: series.count for name, series in bag.topics.items()}
    assert counts["/odom"] == counts["/odom/truth"] == counts["/dynamics/truth"] == counts["/disturbance"] == 301
    assert counts["/controller/estimate"] == 151


def test_the_messages_are_bit_identical_to_those_of_the_offline_bag(bag: Bag, tmp_path: Path) -> None:
    assert_equal_to_the_offline_bag(bag, tmp_path / "bag")

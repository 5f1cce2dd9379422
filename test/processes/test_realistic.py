"""The realistic ship over the nodes: all that is random has the bits of the offline loop."""

import dataclasses
import subprocess

import numpy as np
import pytest
from harness import BIN

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.runs.offline import load_scenario, simulate

DURATION = 8.0


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("realistic")
    command = [BIN / "vessel-hsmc", "run", "realistic", "--set", f"vessel_sim.duration={DURATION}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60.0)
    assert done.returncode == 0, done.stderr
    return open_bag(next((folder / "runs").iterdir()) / "bag")


def test_the_nodes_and_the_offline_loop_agree_to_the_last_bit(bag):
    offline = simulate(load_scenario("realistic", {"vessel_sim.duration": DURATION}))
    recorded = bag.run()
    for field in dataclasses.fields(Run):
        if field.name != "control":
            np.testing.assert_array_equal(getattr(recorded, field.name), getattr(offline, field.name), err_msg=field.name)
    for name, values in offline.control.items():
        np.testing.assert_array_equal(recorded.control[name], values, err_msg=name)
    assert not np.array_equal(offline.measured, offline.state)
    assert offline.control["estimate"].shape == (401, 6)


def test_what_only_a_simulator_knows_is_recorded_every_step(bag):
    counts = {name: series.count for name, series in bag.topics.items()}
    assert counts["/odom"] == counts["/odom/truth"] == counts["/dynamics/truth"] == counts["/disturbance"] == 801
    assert counts["/controller/estimate"] == 401

"""`vessel-hsmc run` with a fence: the vessel sails at it, is stopped and held inside, as offline."""

import subprocess
from pathlib import Path

import numpy as np
from harness import BIN
from mcap_ros2.reader import read_ros2_messages

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.control.safety.parameters import Operation, Reason
from vessel_hsmc_ros.simulation.offline import simulate

FENCE = [-20.0, -20.0, 20.0, -20.0, 20.0, 20.0, -20.0, 20.0, -20.0, -20.0]
CHANGES = {
    "vessel": "otter",
    "controller.law": "guided",
    "reference_ship.mode": "straight",
    "reference_ship.straight.speed": 1.2,
    "reference_ship.initial_pose": [0.0, 0.0, 0.0],
    "vessel_sim.initial_pose": [0.0, 0.0, 0.0],
    "vessel_sim.duration": 40.0,
    "vessel_sim.disturbance.current.north": 0.4,
    **{f"{node}.rate_hz": 10.0 for node in ("controller", "reference_ship", "vessel_sim")},
    "controller.safety.fence.inside": FENCE,
}


def test_a_run_at_a_fence_is_stopped_and_held_inside_as_offline(tmp_path: Path) -> None:
    changes = [f"--set={name}={value}" for name, value in CHANGES.items()]
    done = subprocess.run(
        [BIN / "vessel-hsmc", "run", "case2_straight", "--no-page", *changes],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=240.0,
    )
    assert done.returncode == 0, done.stderr
    (folder,) = (tmp_path / "runs").iterdir()
    logs = "".join(path.read_text() for path in (folder / "logs").iterdir())
    assert "the vessel could not stop inside of the fence: the vessel stops in" in logs
    messages = list(read_ros2_messages(folder / "bag" / "bag_0.mcap", topics=["/odom", "/controller/state"]))
    farthest = max(each.ros_msg.pose.pose.position.x for each in messages if each.channel.topic == "/odom")
    assert 12.0 < farthest < 20.0
    last = [each.ros_msg for each in messages if each.channel.topic == "/controller/state"][-1]
    assert (last.operation, last.reason) == (Operation.SAFE, Reason.FENCE)
    places = [(p.x, p.y) for p in (each.ros_msg.pose.pose.position for each in messages if each.channel.topic == "/odom")]
    offline = simulate(open_bag(folder / "bag").scenario())
    assert np.array_equal(places, offline.state[:, :2]), "bit-identical"
    stated = [(m.operation, m.reason) for m in (each.ros_msg for each in messages if each.channel.topic == "/controller/state")]
    assert stated == list(zip(offline.control["operation"], offline.control["reason"], strict=True))

"""A plant that leaves the speeds for which its hull data hold."""

from typing import Any

from driving import STEP, Helm
from rcl_interfaces.msg import Log

from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK, WARN
from vessel_sim_node.node import VesselSimNode


def test_a_ship_that_leaves_its_declared_speeds_warns_once_and_in_its_diagnostics(bench: Any) -> None:
    helm, logs = Helm(bench), bench.collect(Log, "/rosout", qos.CLOCK)
    node = bench.start(VesselSimNode, initial_velocity=[0.95, 0.0, 0.0], vessel__surge_speed_range=[-1.0, 1.0])
    bench.until(lambda: helm.odometry)
    assert node.status()[0] == OK
    for step in range(6):
        helm.command(step * STEP, force=3e5)
        bench.until(lambda count=step + 2: len(helm.odometry) == count)
    level, _, values = node.status()
    assert level == WARN
    # Gains 0.02 m/s in each step of 0.01 s.
    assert values["outside_hull_data"] == "a surge velocity of 1.02 m/s, where the hull data hold from -1 to 1 m/s, at t = 0.03 s"
    bench.until(lambda: [log for log in logs if "extrapolated" in log.msg])
    assert len([log for log in logs if "extrapolated" in log.msg]) == 1

"""The plant in real time, on a clock that the tests control."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from driving import STEP, Helm
from std_srvs.srv import SetBool

from vessel_hsmc_ros.messages import conversions as conv
from vessel_sim_node.node import VesselSimNode


@pytest.fixture
def real_time(bench: Any, simulated_time: Any) -> Any:
    """A plant in real-time mode on simulated time, and the publisher of its commands."""
    helm = Helm(bench, lockstep=False)

    def start(**parameters: Any) -> Any:
        node = bench.start(VesselSimNode, lockstep=False, use_sim_time=True, **parameters)
        bench.until(lambda: node.connected and helm.commands.get_subscription_count())
        outputs = [p for p in node.publishers if p.topic_name in ("/odom", "/applied_wrench")]
        bench.until(lambda: all(output.get_subscription_count() for output in outputs))
        simulated_time.run(0.05)  # the node's timer counts from the first time it has seen
        helm.odometry.clear()
        helm.applied.clear()
        return helm

    return start


def test_in_real_time_steps_come_at_their_rate_without_a_controller(real_time: Any, simulated_time: Any) -> None:
    helm = real_time(rate_hz=50.0)
    began = simulated_time.now
    simulated_time.run(0.5)
    assert set(np.diff(helm.stamps())) == {20_000_000}
    assert len(helm.stamps()) in (24, 25, 26)
    assert began - 20_000_000 <= helm.stamps()[0]
    assert helm.stamps()[-1] <= simulated_time.now


def test_in_real_time_steps_that_are_late_are_caught_up_with(bench: Any, real_time: Any, simulated_time: Any) -> None:
    helm = real_time()
    simulated_time.jump(200_000_000)
    bench.until(lambda: len(helm.stamps()) >= 20)
    simulated_time.run(0.01)
    assert set(np.diff(helm.stamps())) == {STEP}
    assert helm.stamps()[-1] <= simulated_time.now


def test_in_real_time_a_pause_stops_the_steps_and_they_go_on_without_catching_up(
    bench: Any, real_time: Any, simulated_time: Any
) -> None:
    helm = real_time()
    simulated_time.run(0.1)
    bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=True))
    count = len(helm.stamps())
    simulated_time.run(0.2)
    assert len(helm.stamps()) == count
    bench.call(SetBool, "/vessel_sim/pause", SetBool.Request(data=False))
    simulated_time.run(0.1)
    assert 8 <= len(helm.stamps()) - count <= 11
    assert simulated_time.now - 2 * STEP <= helm.stamps()[-1] <= simulated_time.now


def test_in_real_time_a_command_holds_for_the_timeout_and_no_longer(real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.2)
    helm.command(0, force=1e5)
    simulated_time.run(0.5)
    held = [conv.nanoseconds(m.header.stamp) for m in helm.applied if any(conv.read_wrench(m))]
    assert 180_000_000 <= held[-1] - held[0] <= 200_000_000
    assert conv.read_wrench(helm.applied[-1]) == (0.0, 0.0)


def test_in_real_time_a_plant_without_recent_commands_warns(bench: Any, real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.2)
    (node,) = bench.nodes
    assert node.status()[:2] == (DiagnosticStatus.WARN, "no recent command on /cmd_wrench: the wrench is zero")
    helm.command(0, force=1e5)
    simulated_time.run(0.05)
    assert node.status()[:2] == (DiagnosticStatus.OK, "running")


def test_in_real_time_a_command_that_is_not_finite_is_ignored(real_time: Any, simulated_time: Any) -> None:
    helm = real_time()
    helm.command(0, force=1e5)
    simulated_time.run(0.05)
    helm.command(0, force=math.nan)
    helm.command(0, moment=math.inf)
    simulated_time.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (1e5, 0.0)
    assert all(np.isfinite(conv.read_odometry(m)).all() for m in helm.odometry)

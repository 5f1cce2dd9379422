"""The plant in real time, on a clock that the tests control."""

import math
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from driving import STEP, Helm, command
from durations import rest_long
from geometry_msgs.msg import WrenchStamped
from std_srvs.srv import SetBool

from vessel_hsmc_ros.messages import conversions as conv
from vessel_sim_node.node import VesselSimNode

S = 10**9
"""A second, ns."""


class TimedHelm(Helm):
    """A helm in real time that runs the clock."""

    def __init__(self, bench: Any, time: Any) -> None:
        super().__init__(bench, lockstep=False)
        self.time = time

    def run(self, seconds: float) -> None:
        """Let simulated time pass, s, until wrench and odometry of its end have been received."""
        self.time.run(seconds)
        self.bench.until(lambda: conv.nanoseconds(self.applied[-1].header.stamp) >= self.time.now - 3 * STEP)
        self.bench.until(lambda: self.stamps()[-1] >= self.time.now - 2 * STEP)


@pytest.fixture
def real_time(bench: Any, simulated_time: Any) -> Any:
    """A plant in real-time mode on simulated time, and the publisher of its commands."""
    helm = TimedHelm(bench, simulated_time)

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
    bench: Any, real_time: Any, simulated_time: Any, capfd: pytest.CaptureFixture[str]
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
    sent = simulated_time.now
    helm.command(sent, force=1e5)
    helm.run(0.5)
    held = [conv.nanoseconds(m.header.stamp) for m in helm.applied if any(conv.read_wrench(m))]
    assert held[0] <= sent + 2 * STEP
    assert sent + 180_000_000 <= held[-1] <= sent + 200_000_000
    assert conv.read_wrench(helm.applied[-1]) == (0.0, 0.0)


def test_in_real_time_the_age_of_a_command_counts_from_its_stamp(real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.2)
    helm.run(0.2)
    sent = simulated_time.now - 150_000_000
    helm.command(sent, force=1e5)
    helm.run(0.3)
    held = [conv.nanoseconds(m.header.stamp) for m in helm.applied if any(conv.read_wrench(m))]
    assert held
    assert held[-1] <= sent + 200_000_000


def test_in_real_time_a_plant_without_recent_commands_warns(bench: Any, real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.2)
    (node,) = bench.nodes
    assert node.status()[:2] == (DiagnosticStatus.WARN, "no recent command on /cmd_wrench: the wrench is zero")
    helm.command(simulated_time.now, force=1e5)
    helm.run(0.05)
    assert node.status()[:2] == (DiagnosticStatus.OK, "running")


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "stamp_future": ({"stamp": S}, "must be stamped at most 0.1 s ahead (got"),
    "duplicate": ({"stamp": 0}, "must be stamped after the last one"),
    "out_of_order": ({"stamp": -STEP}, "must be stamped after the last one"),
    "wrong_frame": ({"stamp": STEP, "frame": "map"}, "must be in frame base_link (got 'map')"),
    "not_finite": ({"stamp": STEP, "force": math.nan}, "must be finite numbers (got nan N, 0.0 N·m)"),
}


@pytest.mark.parametrize("name", rest_long(REFUSED, 3))
def test_in_real_time_a_command_that_is_not_fresh_is_refused_named_and_counted(
    bench: Any, real_time: Any, simulated_time: Any, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    change, reason = REFUSED[name]
    helm = real_time(command_timeout=0.5)
    taken = simulated_time.now
    helm.command(taken, force=1e5)
    helm.run(0.05)
    helm.command(**{"force": -3e5, **change, "stamp": taken + change["stamp"]})
    helm.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (1e5, 0.0)
    assert all(np.isfinite(conv.read_odometry(m)).all() for m in helm.odometry)
    (node,) = bench.nodes
    task = command(node)
    assert reason in capfd.readouterr().err
    assert task.values[f"refused_{name}"] == 1
    helm.command(simulated_time.now, force=2e5)
    helm.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (2e5, 0.0)


def test_commands_of_a_controller_that_was_stopped_and_continues_are_refused(
    bench: Any, real_time: Any, simulated_time: Any, capfd: pytest.CaptureFixture[str]
) -> None:
    helm = real_time(command_timeout=0.2)
    helm.command(simulated_time.now, force=1e5)
    helm.run(0.1)
    stopped = simulated_time.now
    simulated_time.jump(2 * S)
    for k in range(10):  # what waited in its queue
        helm.command(stopped + k * STEP, force=7e5)
    (node,) = bench.nodes
    bench.until(lambda: command(node).values.get("refused_stamp_old") == 10)
    helm.run(0.1)
    assert 7e5 not in {conv.read_wrench(m)[0] for m in helm.applied}
    assert "must be stamped at most 0.2 s ago (got" in capfd.readouterr().err
    helm.command(simulated_time.now, force=2e5)
    helm.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (2e5, 0.0)


def test_a_plant_that_was_stopped_applies_nothing_that_waited_and_does_not_catch_up(real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.2)
    helm.command(simulated_time.now, force=1e5)
    helm.run(0.1)
    stopped = simulated_time.now
    for k in range(100):
        helm.command(stopped + k * STEP, force=7e5)
    simulated_time.jump(10 * S)  # the node is served only now
    helm.run(0.2)
    # By their stamps: some of before may still have been on their way.
    later = [m for m in helm.applied if conv.nanoseconds(m.header.stamp) > stopped]
    assert {conv.read_wrench(m)[0] for m in later} <= {0.0}
    assert len(later) <= 22
    assert helm.stamps()[-1] == pytest.approx(simulated_time.now, abs=2 * STEP)


@pytest.mark.parametrize("leap", rest_long([-3600 * S, -S, 3600 * S], 2))
def test_after_a_step_of_the_clock_the_plant_goes_on_and_takes_new_commands_only(
    real_time: Any, simulated_time: Any, leap: int
) -> None:
    simulated_time.now = 7200 * S
    helm = real_time(command_timeout=0.2)
    helm.command(simulated_time.now, force=1e5)
    helm.run(0.1)
    count, position = len(helm.odometry), conv.read_odometry(helm.odometry[-1])[:2]
    simulated_time.jump(leap)
    helm.run(0.1)
    later = helm.odometry[count:]
    assert 8 <= len(later) <= 12
    assert conv.nanoseconds(later[-1].header.stamp) == pytest.approx(simulated_time.now, abs=2 * STEP)
    assert np.abs(np.subtract(conv.read_odometry(later[0])[:2], position)).max() < 0.1
    assert conv.read_wrench(helm.applied[-1]) == (0.0, 0.0)
    helm.command(simulated_time.now, force=2e5)
    helm.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (2e5, 0.0)


def test_in_real_time_commands_of_two_publishers_are_not_mixed(bench: Any, real_time: Any, simulated_time: Any) -> None:
    helm = real_time(command_timeout=0.5)
    (node,) = bench.nodes
    helm.command(simulated_time.now, force=1e5)
    helm.run(0.05)
    other = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    bench.until(lambda: node.count_publishers("cmd_wrench") == 2 and other.get_subscription_count())
    helm.run(0.02)
    count = len(helm.applied)
    for _ in range(5):
        helm.command(simulated_time.now, force=1e5)
        helm.run(0.02)
    assert {conv.read_wrench(m) for m in helm.applied[count:]} == {(0.0, 0.0)}
    level, message, _ = node.status()
    assert level == DiagnosticStatus.ERROR
    assert "/cmd_wrench has 2 publishers and may have one" in message
    assert command(node).values["refused_second_publisher"] == 5
    bench.probe.destroy_publisher(other)
    bench.until(lambda: node.count_publishers("cmd_wrench") == 1)
    helm.command(simulated_time.now, force=2e5)
    helm.run(0.05)
    assert conv.read_wrench(helm.applied[-1]) == (2e5, 0.0)

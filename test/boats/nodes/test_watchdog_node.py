"""The watchdog in real time: on simulated time where its time-out is exact, since the ramp is by the steady clock."""

import math
import time
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from std_srvs.srv import Trigger

from vessel_hsmc_ros.boats import takeover
from vessel_hsmc_ros.boats.drive import WatchdogNode
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos

WARN, ERROR, OK = DiagnosticStatus.WARN, DiagnosticStatus.ERROR, DiagnosticStatus.OK


class Watched:
    """A watchdog, a publisher of commands, and what the watchdog passes on."""

    def __init__(self, bench: Any, namespace: str = "", **parameters: Any) -> None:
        self.bench = bench
        self.commands = bench.publisher(WrenchStamped, f"{namespace}/cmd_wrench", lockstep=False)
        self.output = bench.collect(WrenchStamped, f"{namespace}/watched_wrench", qos.STREAM)
        values = {"watched_nodes": [""], "ramp_time": 0.0, **parameters}
        self.node = bench.start(WatchdogNode, lockstep=False, namespace=namespace, **values)
        bench.until(lambda: self.node.connected and self.commands.get_subscription_count() and self.output)

    def command(self, force: float, moment: float = 0.0, late: float = 0.0) -> Any:
        message = conv.new_wrench()
        conv.write_wrench(message, conv.time_message(self.node.now() - round(late * 1e9)), (force, moment))
        self.commands.publish(message)

    @property
    def latest(self) -> tuple[float, float]:
        return conv.read_wrench(self.output[-1])

    def diagnostic_task(self, name: str) -> Any:
        return next(each for each in self.node.diagnostic_tasks() if each.name == name)


def test_a_fresh_command_is_passed_on_within_the_limits(bench: Any) -> None:
    watched = Watched(bench, surge_force_limit=100.0, command_timeout=60.0)
    watched.command(1e5, -7.0)
    bench.until(lambda: watched.latest == (100.0, -7.0))
    assert watched.diagnostic_task("command").level == OK


def test_without_a_command_the_output_is_zero_and_goes_on(bench: Any) -> None:
    watched = Watched(bench)
    bench.until(lambda: len(watched.output) > 5)
    assert {conv.read_wrench(message) for message in watched.output} == {(0.0, 0.0)}
    assert watched.diagnostic_task("command").level == WARN


@pytest.mark.parametrize(("force", "late"), [(math.nan, 0.0), (5e4, 120.0), (5e4, -1.0)])
def test_a_command_that_is_not_fresh_is_not_passed_on(bench: Any, force: float, late: float) -> None:
    watched = Watched(bench, command_timeout=60.0)
    watched.command(force, late=late)
    bench.until(lambda: watched.diagnostic_task("command").values["refused"] == 1)
    watched.command(1e3)
    bench.until(lambda: watched.latest == (1e3, 0.0))
    assert {conv.read_wrench(message)[0] for message in watched.output} == {0.0, 1e3}


class SteadyClock:
    """Stands for the module `time` in the ramp, so that its ramp does not depend on the load of the machine."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


def test_the_output_ramps_to_zero_when_commands_cease_and_back_when_they_return(
    bench: Any, simulated_time: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    steady = SteadyClock()
    monkeypatch.setattr(takeover, "time", steady)
    simulated_time.now = 10**9
    watched = Watched(bench, command_timeout=0.5, ramp_time=0.5, use_sim_time=True)
    simulated_time.run(0.01)
    watched.command(0.0)
    bench.until(lambda: watched.diagnostic_task("command").values["taken"] == 1)
    steady.now += 10.0  # all the way to what is commanded
    watched.command(1e3, late=-0.001)
    bench.until(lambda: watched.latest[0] == 1e3)

    def at(force: float) -> Any:
        return bench.until(lambda: watched.latest[0] == pytest.approx(force))

    steady.now += 10.0  # what passes before the time-out is no part of the ramp
    watched.command(1e3, late=-0.002)
    bench.until(lambda: watched.diagnostic_task("command").values["taken"] == 3)
    simulated_time.jump(6 * 10**8)
    for share in (0.75, 0.25, 0.0):
        steady.now += 0.125 if share == 0.75 else 0.25
        at(share * 1e3)
    for taken, share in ((4, 0.25), (5, 1.0)):
        steady.now += 0.125 if taken == 4 else 0.5
        watched.command(1e3, late=-0.001 * taken)
        at(share * 1e3)


def test_a_stop_holds_until_it_is_rearmed(bench: Any) -> None:
    watched = Watched(bench, command_timeout=60.0)
    watched.command(1e3)
    bench.until(lambda: watched.latest[0] == 1e3)
    assert bench.call(Trigger, "/watchdog/stop", Trigger.Request()).success
    bench.until(lambda: watched.latest[0] == 0.0)
    count = len(watched.output)
    watched.command(1e3)
    bench.until(lambda: watched.diagnostic_task("command").values["taken"] == 2 and len(watched.output) > count + 3)
    assert {conv.read_wrench(message) for message in watched.output[count:]} == {(0.0, 0.0)}
    assert watched.node.status()[:2] == (WARN, "stopped: the wrench is zero until ~/rearm")
    assert bench.call(Trigger, "/watchdog/rearm", Trigger.Request()).success
    watched.command(2e3)
    bench.until(lambda: watched.latest[0] == 2e3)


def test_a_stop_is_at_once_whatever_the_ramp_is(bench: Any) -> None:
    watched = Watched(bench, command_timeout=60.0, ramp_time=5.0)
    bench.until(lambda: watched.command(1e3) or watched.latest[0] > 500.0)
    count = len(watched.output)
    assert bench.call(Trigger, "/watchdog/stop", Trigger.Request()).success
    bench.until(lambda: any(not any(conv.read_wrench(each)) for each in watched.output[count:]))
    passed = [conv.read_wrench(each)[0] for each in watched.output[count:]]
    assert all(force == 0.0 or force > 500.0 for force in passed), "no way down between command and zero"


def test_a_stop_does_not_wait_for_the_next_period(bench: Any) -> None:
    watched = Watched(bench, command_timeout=60.0, rate_hz=1.0)
    watched.command(1e3)
    bench.until(lambda: watched.latest[0] == 1e3)
    for timer in watched.node.timers:
        if timer.callback == watched.node._on_timer:
            timer.cancel()
    assert bench.call(Trigger, "/watchdog/stop", Trigger.Request()).success
    bench.until(lambda: watched.latest[0] == 0.0, deadline=10.0)


def test_a_changed_time_out_holds_for_the_commands_that_follow(bench: Any, simulated_time: Any) -> None:
    simulated_time.now = 10**9
    watched = Watched(bench, command_timeout=60.0, use_sim_time=True)
    simulated_time.run(0.01)
    watched.command(1e3)
    bench.until(lambda: watched.latest[0] == 1e3)
    assert bench.set_parameters("watchdog", command_timeout=0.2).successful
    simulated_time.jump(300_000_000)
    bench.until(lambda: watched.latest[0] == 0.0, deadline=10.0)


def test_commands_of_two_publishers_are_not_passed_on(bench: Any) -> None:
    watched = Watched(bench, command_timeout=60.0)
    watched.command(1e3)
    bench.until(lambda: watched.latest[0] == 1e3)
    bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    bench.until(lambda: watched.latest[0] == 0.0)
    assert watched.diagnostic_task("command").level == ERROR


def test_a_node_that_falls_silent_is_named(bench: Any) -> None:
    diagnostics = bench.probe.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    watched = Watched(bench, watched_nodes=["controller"], heartbeat_timeout=0.5)
    alive = DiagnosticArray(status=[DiagnosticStatus(name="controller"), DiagnosticStatus(name="other")])
    bench.until(lambda: watched.diagnostic_task("heartbeat").level == ERROR)
    assert "no diagnostics of controller for " in watched.diagnostic_task("heartbeat").message
    bench.until(lambda: diagnostics.publish(alive) or watched.diagnostic_task("heartbeat").level == OK)
    bench.until(lambda: watched.diagnostic_task("heartbeat").level == ERROR)


def test_the_time_out_counts_from_the_stamp(bench: Any, simulated_time: Any) -> None:
    simulated_time.now = 10**9
    watched = Watched(bench, command_timeout=0.2, use_sim_time=True)
    simulated_time.run(0.01)
    watched.command(1e3, late=0.1)
    bench.until(lambda: watched.latest[0] == 1e3)
    simulated_time.jump(100_000_000)
    bench.spin(0.1)
    assert watched.latest[0] == 1e3
    simulated_time.jump(2_500_000)
    bench.until(lambda: watched.latest[0] == 0.0)


def test_a_watchdog_does_not_work_in_lockstep(bench: Any) -> None:
    with pytest.raises(ParameterError, match="a watchdog works in real time"):
        bench.start(WatchdogNode, lockstep=True)


def test_commands_of_a_clock_that_was_set_back_are_passed_on(bench: Any, simulated_time: Any) -> None:
    simulated_time.now = 10**10
    watched = Watched(bench, command_timeout=0.2, use_sim_time=True)
    simulated_time.run(0.01)
    watched.command(1e3)
    bench.until(lambda: watched.latest[0] == 1e3)
    simulated_time.jump(-5 * 10**9)
    watched.command(2e3)
    bench.until(lambda: watched.latest[0] == 2e3, deadline=10.0)


def test_a_watchdog_hears_the_nodes_of_its_own_vessel_and_no_others(bench: Any) -> None:
    diagnostics = bench.probe.create_publisher(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
    watched = Watched(bench, "/alpha", watched_nodes=["controller"], heartbeat_timeout=0.5)

    def heard_after(*names: str) -> float:
        """The age of the controller's heartbeat after a second of diagnostics of other names."""
        array = DiagnosticArray(status=[DiagnosticStatus(name=name) for name in names])
        end = time.monotonic() + 1.0
        bench.until(lambda: diagnostics.publish(array) or time.monotonic() > end)
        return float(watched.diagnostic_task("heartbeat").values["controller_age"])

    bench.until(diagnostics.get_subscription_count)
    assert heard_after("controller", "bravo/controller", "alpha/controller: timing") > 0.5
    assert watched.diagnostic_task("heartbeat").level == ERROR
    bench.until(lambda: heard_after("alpha/controller") < 0.5)
    bench.until(lambda: watched.diagnostic_task("heartbeat").level == OK)

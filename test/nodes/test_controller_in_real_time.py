import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from driving import STATE, STEP, Plant
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ReferenceState

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode


class Sea(Plant):
    """A plant in real time."""

    def __init__(self, bench):
        super().__init__(bench, lockstep=False)
        self.diagnostics = bench.collect(DiagnosticArray, "/diagnostics", qos.DIAGNOSTICS)
        self.silent = False
        self.state = STATE
        bench.probe.create_timer(0.01, self.tick)

    def tick(self):
        if not self.silent:
            self.send_reference(self.now())
            self.send_odometry(self.now(), self.state)

    def wrench(self):
        return conv.read_wrench(self.commands[-1]) if self.commands else None

    def status(self):
        return self.diagnostics[-1].status[0] if self.diagnostics else None


@pytest.fixture
def sea(bench):
    return Sea(bench)


def test_in_real_time_the_law_runs_at_its_own_rate(bench, sea):
    bench.start(ControllerNode, lockstep=False)
    bench.until(lambda: len(sea.states) > 100)
    stamps = np.array([conv.nanoseconds(m.header.stamp) for m in sea.states])
    periods = len(stamps) - 1 + sea.states[-1].missed_periods - sea.states[0].missed_periods  # on a busy machine some are missed
    assert (stamps[-1] - stamps[0]) / 1e7 == pytest.approx(periods, abs=1.5)
    assert abs(stamps[-1] - sea.now()) < 1e9


def test_in_real_time_the_laws_clock_is_simulated_time_where_there_is_one(bench, plant):
    """Somebody else's simulator, ten times slower than the wall clock."""
    ticks = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK)
    odometry, reference = (
        bench.publisher(kind, topic, lockstep=False) for kind, topic in ((Odometry, "odom"), (ReferenceState, "reference"))
    )
    plant.odometry, plant.reference = odometry, reference
    bench.start(ControllerNode, lockstep=False, use_sim_time=True, input_timeout=0.1)
    bench.until(lambda: odometry.get_subscription_count() and reference.get_subscription_count())
    clock = 0

    def tick():
        nonlocal clock
        clock += STEP // 10
        ticks.publish(Clock(clock=conv.time_message(clock)))
        if clock % STEP == 0:
            plant.send_reference(clock)
            plant.send_odometry(clock)

    bench.probe.create_timer(0.01, tick)
    bench.until(lambda: len(plant.states) >= 12)
    stamps = [conv.nanoseconds(m.header.stamp) for m in plant.states]
    assert np.median(np.diff(stamps)) == pytest.approx(STEP, rel=0.2)
    assert stamps[-1] <= clock < 10**9
    assert all(any(conv.read_wrench(m)) for m in plant.commands)


def test_in_real_time_silence_makes_the_wrench_zero_after_a_fraction_of_a_second(bench, sea):
    bench.start(ControllerNode, lockstep=False, input_timeout=0.5)
    bench.until(lambda: sea.wrench() and any(sea.wrench()))
    sea.silent, began = True, sea.now()
    bench.until(lambda: not any(sea.wrench()), deadline=5.0)
    zero_at = next(m.header.stamp for m in reversed(sea.commands) if any(conv.read_wrench(m)))
    assert 0.3 < 1e-9 * (conv.nanoseconds(zero_at) - began) < 1.0
    bench.until(lambda: sea.status() and sea.status().level == DiagnosticStatus.ERROR)
    assert sea.status().message == "no odometry for 0.5 s: the wrench is zero"
    sea.silent = False
    bench.until(lambda: any(sea.wrench()))


def test_in_real_time_a_bad_odometry_is_ignored_and_reported(bench, sea):
    bench.start(ControllerNode, lockstep=False)
    bench.until(lambda: sea.wrench() and any(sea.wrench()))
    sea.state = np.array([math.nan, *STATE[1:]])
    bench.until(lambda: sea.status() and "odometry with x = nan is not allowed" in sea.status().message)
    bench.until(lambda: not any(sea.wrench()))
    assert all(np.isfinite(conv.read_wrench(m)).all() for m in sea.commands)
    sea.state = STATE
    bench.until(lambda: any(sea.wrench()))


def test_disabled_the_wrench_is_zero_and_enabled_it_is_back(bench, sea):
    bench.start(ControllerNode, lockstep=False)
    bench.until(lambda: sea.wrench() and any(sea.wrench()))
    bench.call(SetBool, "/controller/enable", SetBool.Request(data=False))
    bench.until(lambda: not any(sea.wrench()))
    bench.call(SetBool, "/controller/enable", SetBool.Request(data=True))
    bench.until(lambda: any(sea.wrench()))

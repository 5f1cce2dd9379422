"""The supervision of inputs, on simulated times."""

from typing import Any

import pytest
from nav_msgs.msg import Odometry

from vessel_hsmc_ros.nodes.base import ERROR, WARN
from vessel_hsmc_ros.nodes.input_monitor import InputMonitor

TIMEOUT = 500_000_000
INPUTS = ("odometry", "reference")


@pytest.fixture
def monitor(bench: Any) -> InputMonitor:
    return InputMonitor(bench.probe, {"odom": "odometry", "reference": "reference"}, 0.5)


@pytest.mark.parametrize("name", INPUTS)
def test_an_input_is_overdue_once_it_is_older_than_the_timeout(monitor: InputMonitor, name: str) -> None:
    for each in INPUTS:
        monitor.receive(each, 0, 1_000 if each == name else TIMEOUT)
    assert monitor.overdue(1_000 + TIMEOUT) is None
    assert monitor.overdue(1_000 + TIMEOUT + 1) == name


def test_an_input_that_never_came_is_named_at_the_second_check(monitor: InputMonitor) -> None:
    monitor.receive("odometry", 0, 0)
    monitor.check()
    assert monitor.status() is None
    monitor.check()
    assert monitor.status() == (WARN, "waiting for reference on /reference")
    monitor.receive("reference", 0, 0)
    monitor.check()
    assert monitor.status() is None


def test_odometry_that_waits_for_a_reference_of_its_stamp_is_reported_with_both_stamps(monitor: InputMonitor) -> None:
    monitor.receive("odometry", 7_000_000_000, 0)
    monitor.receive("reference", 6_990_000_001, 0)
    monitor.check(pending=7_000_000_000)
    monitor.check(pending=7_000_000_000)
    latest = "odometry of 7.000000000 s and reference of 6.990000001 s"
    assert monitor.status() == (WARN, f"no command: in lockstep it takes inputs of one stamp, the latest are {latest}")


def test_odometry_that_waits_no_longer_than_a_check_is_not_reported(monitor: InputMonitor) -> None:
    for stamp in (0, 10, 20):
        for name in INPUTS:
            monitor.receive(name, stamp, 0)
        monitor.check(pending=stamp)
        assert monitor.status() is None


def test_an_input_that_is_overdue_because_it_was_refused_is_reported_with_the_reason(bench: Any, monitor: InputMonitor) -> None:
    bench.publisher(Odometry, "odom")
    bench.until(lambda: bench.probe.count_publishers("/odom"))
    monitor.refuse("odometry with x = nan is not allowed")
    monitor.report_overdue("odometry")
    assert monitor.status() == (ERROR, "odometry with x = nan is not allowed; ignored")

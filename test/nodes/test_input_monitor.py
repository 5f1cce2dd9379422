"""The supervision of inputs, on simulated times."""

import math
from types import SimpleNamespace
from typing import Any

import pytest
from nav_msgs.msg import Odometry

from vessel_hsmc_ros.control.safety.parameters import Reason
from vessel_hsmc_ros.control.safety.samples import Sample
from vessel_hsmc_ros.nodes import reporting
from vessel_hsmc_ros.nodes.base import ERROR, WARN
from vessel_hsmc_ros.nodes.input_monitor import Expected, InputMonitor

TIMEOUT = 500_000_000
INPUTS = ("odometry", "reference")


@pytest.fixture
def monitor(bench: Any) -> InputMonitor:
    return InputMonitor(bench.probe, {"odometry": Expected("odom", "odom"), "reference": Expected("reference")}, 0.5)


def sample(stamp: int, frame: str = "odom", number: float = 0.0) -> Sample:
    return Sample(stamp, frame, "", (number,))


@pytest.mark.parametrize("name", INPUTS)
def test_an_input_is_overdue_once_it_is_older_than_the_timeout(monitor: InputMonitor, name: str) -> None:
    for each in INPUTS:
        received = 1_000 if each == name else TIMEOUT
        assert not monitor.take(each, sample(TIMEOUT), TIMEOUT, received)
    assert monitor.overdue(TIMEOUT, 1_000 + TIMEOUT) is None
    assert monitor.overdue(TIMEOUT, 1_000 + TIMEOUT + 1) == (name, Reason.OVERDUE)


@pytest.mark.parametrize(
    ("bad", "expected"),
    [
        (
            sample(0, "map"),
            "odometry must be in frame 'odom' (got 'map'); safety.freshness.frames_checked: false accepts any",
        ),
        (sample(-10 * TIMEOUT), "odometry must be stamped at most 0.5 s ago (got 5 s)"),
        (sample(60 * TIMEOUT), "odometry must be stamped at most 0.1 s ahead (got 30 s)"),
    ],
)
def test_a_refused_sample_is_reported_with_its_value_and_what_is_allowed(
    monitor: InputMonitor, bad: Sample, expected: str
) -> None:
    assert monitor.take("odometry", bad, 0, 0) == expected
    assert monitor.status() == (ERROR, f"{expected}; ignored")
    assert monitor.fresh["odometry"] == 0


def test_repeated_and_reordered_samples_are_counted_and_are_no_error(monitor: InputMonitor) -> None:
    for stamp in (1, 3, 2, 3):
        monitor.take("odometry", sample(stamp), 0, 0)
    task = monitor.diagnostic_task()
    assert task.values == {"refused": 2, "odometry: out_of_order": 1, "odometry: duplicate": 1}
    assert monitor.status() is None
    assert monitor.fresh["odometry"] == 2


def test_an_input_that_never_came_is_named_at_the_second_check(monitor: InputMonitor) -> None:
    monitor.receive("odometry", 0)
    monitor.check()
    assert monitor.status() is None
    monitor.check()
    assert monitor.status() == (WARN, "waiting for reference on /reference")
    monitor.receive("reference", 0)
    monitor.check()
    assert monitor.status() is None


def test_odometry_that_waits_for_a_reference_of_its_stamp_is_reported_with_both_stamps(monitor: InputMonitor) -> None:
    monitor.receive("odometry", 7_000_000_000)
    monitor.receive("reference", 6_990_000_001)
    monitor.check(pending=7_000_000_000)
    monitor.check(pending=7_000_000_000)
    latest = "odometry of 7.000000000 s and reference of 6.990000001 s"
    assert monitor.status() == (WARN, f"no command: in lockstep it needs inputs of one stamp, the latest are {latest}")


def test_odometry_that_waits_no_longer_than_a_check_is_not_reported(monitor: InputMonitor) -> None:
    for stamp in (0, 10, 20):
        for name in INPUTS:
            monitor.receive(name, stamp)
        monitor.check(pending=stamp)
        assert monitor.status() is None


def test_an_input_that_is_overdue_because_it_was_refused_is_reported_with_the_reason(bench: Any, monitor: InputMonitor) -> None:
    bench.publisher(Odometry, "odom")
    bench.until(lambda: bench.probe.count_publishers("/odom"))
    monitor.take("odometry", sample(0, number=math.nan), 0, 0, "odometry must be finite numbers (got x = nan)")
    monitor.report_overdue("odometry", Reason.OVERDUE, 0, "nothing is commanded")
    assert monitor.status() == (ERROR, "odometry must be finite numbers (got x = nan); ignored")


def test_after_a_reset_samples_are_counted_anew(monitor: InputMonitor) -> None:
    for name in INPUTS:
        for stamp in range(3):
            assert not monitor.take(name, sample(stamp), 0, 0)
    assert monitor.fresh == dict.fromkeys(INPUTS, 3)
    monitor.reset()
    assert monitor.fresh == dict.fromkeys(INPUTS, 0)
    assert monitor.overdue(0, 0) == ("odometry", Reason.NOT_RECEIVED)


@pytest.mark.parametrize("reason", [Reason.OVERDUE, Reason.NOT_RECEIVED, Reason.JUMP])
def test_after_an_interruption_samples_are_counted_anew_for_the_input_that_was_late(
    monitor: InputMonitor, reason: Reason
) -> None:
    for name in INPUTS:
        assert not monitor.take(name, sample(0), 0, 0)
    late = 3 * TIMEOUT
    assert not monitor.take("reference", sample(late), late, late)
    assert monitor.overdue(late, late) == ("odometry", Reason.OVERDUE)
    monitor.report_overdue("odometry", reason, late, "nothing is commanded")
    assert not monitor.take("odometry", sample(late), late, late)
    assert monitor.fresh == {"odometry": 1, "reference": 2}


BAD = {
    Reason.WRONG_FRAME: sample(0, "map"),
    Reason.NOT_FINITE: sample(0, number=math.nan),
    Reason.UNCERTAIN: sample(0)._replace(covariance=math.nan),
    Reason.STAMP_OLD: sample(-60 * TIMEOUT),
    Reason.STAMP_FUTURE: sample(60 * TIMEOUT),
}


class Ros:
    """Stands for a node whose inputs have a publisher; `lines` has its errors."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def get_logger(self) -> Any:
        return SimpleNamespace(error=lambda text, **_: self.lines.append(text), warning=lambda *_, **__: None)

    def resolve_topic_name(self, topic: str) -> str:
        return f"/{topic}"

    def count_publishers(self, _topic: str) -> int:
        return 1


@pytest.mark.parametrize("good_before", [False, True])
@pytest.mark.parametrize(
    ("reason", "frames"), [*((reason, ("odom",)) for reason in BAD), *((r, ()) for r in BAD if r is not Reason.WRONG_FRAME)]
)
def test_each_reason_of_a_refusal_is_still_named_when_the_refusal_itself_is_long_ago(
    monkeypatch: pytest.MonkeyPatch, reason: Reason, good_before: bool, frames: tuple[str, ...]
) -> None:
    """With a time-out above the time for which a problem is current."""
    now = [1000.0]
    monkeypatch.setattr(reporting, "time", SimpleNamespace(monotonic=lambda: now[0]))
    ros: Any = Ros()
    monitor = InputMonitor(ros, {"odometry": Expected("odom", frames)}, 5.0)
    if good_before:
        assert not monitor.take("odometry", sample(-20), -20, -(10**9))
    assert monitor.take("odometry", BAD[reason], 0, 0)
    for seconds in (1.0, 4.9):
        now[0] = 1000.0 + seconds
        later = round(seconds * 1e9)
        if found := monitor.overdue(later, later):
            monitor.report_overdue(*found, later, "nothing is commanded")
            if seconds > 2.0:
                assert "no odometry for 5 s" in ros.lines[-1]
                assert found[1].text in ros.lines[-1] or "by its stamp" in ros.lines[-1] or found[1] is Reason.OVERDUE
        assert good_before or found == ("odometry", reason)

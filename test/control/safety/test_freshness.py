"""Which samples of an input count."""

import math

import pytest

from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, Reason
from vessel_hsmc_ros.control.safety.samples import LARGEST, Freshness, Sample

MS = 1_000_000
NOW = 100_000 * MS


def odometry(stamp: int = NOW, **changes: object) -> Sample:
    return Sample(stamp, "odom", "base_link", (0.0,) * 6, 0.5)._replace(**changes)  # type: ignore[arg-type]


def fresh(**values: object) -> Freshness:
    """An input with a time-out of 0.5 s and a tolerance of 0.1 s."""
    return Freshness(0.5, FreshnessParameters(**values), "odom", "base_link")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("sample", "reason"),
    [
        (odometry(), Reason.NONE),
        (odometry(NOW - 500 * MS), Reason.NONE),
        (odometry(NOW - 500 * MS - 1), Reason.STAMP_OLD),
        (odometry(NOW - 5000 * MS), Reason.STAMP_OLD),
        (odometry(NOW + 100 * MS), Reason.NONE),
        (odometry(NOW + 100 * MS + 1), Reason.STAMP_FUTURE),
        (odometry(NOW + 30_000 * MS), Reason.STAMP_FUTURE),
        (odometry(frame="map"), Reason.WRONG_FRAME),
        (odometry(frame="", child_frame=""), Reason.NONE),
        (odometry(child_frame="other/base_link"), Reason.WRONG_FRAME),
        (odometry(values=(0.0, math.nan)), Reason.NOT_FINITE),
        (odometry(values=(0.0, -math.inf)), Reason.NOT_FINITE),
        (odometry(covariance=2.1), Reason.UNCERTAIN),
        (odometry(covariance=math.nan), Reason.UNCERTAIN),
    ],
)
def test_a_sample_is_taken_or_refused_with_its_reason(sample: Sample, reason: Reason) -> None:
    odom = fresh(covariance_limit=2.0)
    assert odom.accept(sample, NOW, 0) is reason
    assert odom.refused == ({reason: 1} if reason else {})
    assert odom.last == (None if reason else sample.stamp)


def test_duplicates_and_reorderings_are_dropped_and_counted() -> None:
    odom = fresh()
    stamps = [0, 10, 10, 5, 20, 15, 20]
    reasons = [odom.accept(odometry(NOW + stamp * MS), NOW, 0) for stamp in stamps]
    taken = [stamp for stamp, reason in zip(stamps, reasons, strict=True) if reason is Reason.NONE]
    assert taken == [0, 10, 20]
    assert odom.refused == {Reason.DUPLICATE: 2, Reason.OUT_OF_ORDER: 2}


def test_the_first_sample_decides_which_of_several_frames_is_taken_until_a_reset() -> None:
    odom = Freshness(0.5, FreshnessParameters(), ("odom", "map"), ("base_link",))
    given = ["", "map", "odom", "map", "earth"]
    reasons = [odom.accept(odometry(NOW + k, frame=frame), NOW, 0) for k, frame in enumerate(given)]
    assert reasons == [Reason.NONE, Reason.NONE, Reason.WRONG_FRAME, Reason.NONE, Reason.WRONG_FRAME]
    odom.reset()
    assert odom.accept(odometry(frame="odom"), NOW, 0) is Reason.NONE


def test_the_first_sample_decides_which_of_several_child_frames_is_taken_until_a_reset() -> None:
    odom = Freshness(0.5, FreshnessParameters(), ("odom", "map"), ("base_link", "imu_link"))
    given = [("odom", "imu_link"), ("odom", "base_link"), ("", "imu_link"), ("odom", ""), ("odom", "base_link")]
    taken = [odom.accept(odometry(NOW + k, frame=frame, child_frame=child), NOW, 0) for k, (frame, child) in enumerate(given)]
    assert taken == [Reason.NONE, Reason.WRONG_FRAME, Reason.NONE, Reason.NONE, Reason.WRONG_FRAME]
    odom.reset()
    assert odom.accept(odometry(frame="map", child_frame="base_link"), NOW, 0) is Reason.NONE
    assert odom.accept(odometry(NOW + 1, frame="map", child_frame="imu_link"), NOW, 0) is Reason.WRONG_FRAME


def test_a_covariance_of_zero_is_not_known_and_counts() -> None:
    assert fresh(covariance_limit=0.1).accept(odometry(covariance=0.0), NOW, 0) is Reason.NONE


def test_an_input_is_overdue_by_its_receipt_and_by_its_stamp() -> None:
    odom = fresh()
    assert odom.overdue(NOW, 0) is Reason.NOT_RECEIVED
    odom.accept(odometry(NOW), NOW, 7000 * MS)
    assert odom.overdue(NOW, 7500 * MS) is Reason.NONE
    assert odom.overdue(NOW, 7500 * MS + 1) is Reason.OVERDUE
    assert odom.overdue(NOW + 500 * MS, 7000 * MS) is Reason.NONE
    assert odom.overdue(NOW + 500 * MS + 1, 7000 * MS) is Reason.STAMP_OLD, "the clock jumped ahead"
    assert odom.overdue(NOW - 101 * MS, 7000 * MS) is Reason.STAMP_FUTURE, "the clock was set back"


def test_a_refused_sample_does_not_prolong_the_last_one() -> None:
    odom = fresh()
    odom.accept(odometry(NOW), NOW, 0)
    odom.accept(odometry(NOW + MS, frame="map"), NOW, 400 * MS)
    assert odom.overdue(NOW, 500 * MS) is Reason.NONE
    assert odom.overdue(NOW, 501 * MS) is Reason.WRONG_FRAME, "the reason why the last one is overdue"
    assert odom.overdue(NOW, 901 * MS) is Reason.OVERDUE, "none has come since, not even a wrong one"


def test_a_repetition_that_is_too_old_counts_as_late() -> None:
    odom = fresh()
    odom.accept(odometry(NOW), NOW, 10_000 * MS)
    assert odom.accept(odometry(NOW - 5000 * MS), NOW, 10_100 * MS) is Reason.STAMP_OLD
    assert odom.accept(odometry(NOW), NOW + 501 * MS, 10_501 * MS) is Reason.STAMP_OLD
    assert odom.overdue(NOW + 501 * MS, 10_501 * MS) is Reason.STAMP_OLD


def test_an_input_that_was_refused_from_the_first_sample_on_names_the_refusal() -> None:
    odom = fresh()
    odom.accept(odometry(values=(math.nan,)), NOW, 10_000 * MS)
    assert odom.overdue(NOW, 10_100 * MS) is Reason.NOT_FINITE
    assert odom.overdue(NOW, 10_501 * MS) is Reason.NOT_RECEIVED


def test_repetitions_are_no_reason_why_an_input_is_overdue() -> None:
    odom = fresh()
    odom.accept(odometry(NOW), NOW, 10_000 * MS)
    odom.accept(odometry(NOW), NOW, 10_400 * MS)
    assert odom.overdue(NOW, 10_501 * MS) is Reason.OVERDUE


def test_a_silent_input_is_overdue_although_its_last_stamp_is_a_little_older_than_its_receipt() -> None:
    odom = fresh()
    odom.accept(odometry(NOW), NOW + MS, 7000 * MS)
    assert odom.overdue(NOW + 501 * MS, 7500 * MS) is Reason.OVERDUE


def test_earlier_stamps_are_taken_again_after_a_reset() -> None:
    odom = fresh()
    odom.accept(odometry(NOW), NOW, 0)
    odom.reset()
    assert odom.overdue(NOW, 0) is Reason.NOT_RECEIVED
    assert odom.accept(odometry(NOW - 100 * MS), NOW, 0) is Reason.NONE


def test_any_frame_is_taken_where_frames_are_not_checked_or_not_declared() -> None:
    assert fresh(frames_checked=False).accept(odometry(frame="map"), NOW, 0) is Reason.NONE
    assert Freshness(0.5, FreshnessParameters()).accept(odometry(frame="map"), NOW, 0) is Reason.NONE


def test_after_a_reset_the_reason_of_an_earlier_refusal_is_no_longer_given() -> None:
    odom = fresh()
    odom.accept(odometry(frame="map"), NOW, 0)
    assert odom.overdue(NOW, 0) is Reason.WRONG_FRAME
    odom.reset()
    assert odom.overdue(NOW, 0) is Reason.NOT_RECEIVED
    assert odom.refused == {Reason.WRONG_FRAME: 1}
    assert odom.accept(odometry(NOW - 100 * MS), NOW, 0) is Reason.NONE, "earlier stamps count again"


@pytest.mark.parametrize("value", [LARGEST, math.nextafter(LARGEST, math.inf), 1e30, -1e30, math.inf, math.nan])
def test_a_number_that_no_vessel_can_have_does_not_count(value: float) -> None:
    odom = Freshness(0.5, FreshnessParameters(), "odom", "base_link", LARGEST)
    reason = odom.accept(odometry(values=(0.0, value, 0.0)), NOW, 0)
    assert reason is (Reason.NONE if abs(value) <= LARGEST else Reason.NOT_FINITE)

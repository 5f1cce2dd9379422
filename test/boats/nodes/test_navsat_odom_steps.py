"""Odometry from satellite fixes step by step: inputs that are late, ahead of time, silent, or come again."""

import math
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import QuaternionStamped, TwistStamped
from sensor_msgs.msg import Imu, NavSatFix
from std_msgs.msg import Float64
from stepped_node import SteppedNode

from vessel_hsmc_ros.boats.navsat_odom import NavsatOdometryNode
from vessel_hsmc_ros.core.kinematics import Plane
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.base import OK

DATUM, TIMEOUT = (-33.9, 18.4), 0.5


class Receiver(SteppedNode):
    """A receiver with its antenna at the vessel's origin, and what else the node takes."""

    def __init__(self, bench: Any, monkeypatch: pytest.MonkeyPatch, **parameters: Any) -> None:
        given = {"datum": list(DATUM), "timeout": TIMEOUT, **parameters}
        self.plane = Plane(*(given["datum"] or DATUM))
        super().__init__(bench, monkeypatch, NavsatOdometryNode, (), **given)

    def fix(self, east: float = 0.0, north: float = 0.0, late: float = 0.0) -> NavSatFix:
        message = self.stamped(NavSatFix(), late)
        message.status.status = 0
        message.latitude, message.longitude = self.plane.coordinates(east, north)
        return message

    def imu(self, psi: float, r: float = 0.0, late: float = 0.0) -> None:
        message = self.stamped(Imu(), late)
        message.orientation.z, message.orientation.w, message.angular_velocity.z = math.sin(0.5 * psi), math.cos(0.5 * psi), r
        self.node._on_imu(message)

    def answer(self, fix: NavSatFix) -> Any:
        """The motion that answers a fix; None if none does."""
        count = len(self.sent)
        self.node._on_fix(fix)
        return conv.read_odometry(self.sent[-1][1]) if len(self.sent) > count else None


@pytest.fixture
def receiver(bench: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    return lambda **parameters: Receiver(bench, monkeypatch, **parameters)


@pytest.mark.parametrize("compass", [0.0, 1.0, 2.5, 4.0, 6.0])
def test_a_compass_heading_in_a_quaternion_is_that_of_the_boat_where_it_is_declared(receiver: Any, compass: float) -> None:
    made = receiver(heading="quaternion_ned", heading_offset=0.1)
    for late in (0.1, 0.0):  # turning to starboard by 0.2 rad/s
        message = made.stamped(QuaternionStamped(), late)
        yaw = compass - 0.2 * late
        message.quaternion.z, message.quaternion.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        made.node._on_quaternion(message)
    motion = made.answer(made.fix())
    assert math.remainder(motion.psi - (0.5 * math.pi - compass + 0.1), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert motion.r == pytest.approx(-0.2)


@pytest.mark.parametrize("late", [0.45, 0.1, -0.1, -0.45])
def test_a_heading_before_or_after_the_fix_is_turned_to_its_time(receiver: Any, late: float) -> None:
    made = receiver()
    made.imu(3.0, r=0.5, late=late)
    psi = math.remainder(3.0 + 0.5 * late, 2.0 * math.pi)
    assert made.answer(made.fix())[2] == pytest.approx(psi, abs=1e-6)


@pytest.mark.parametrize("late", [0.55, 30.0, -0.55, -30.0])
def test_a_heading_of_another_time_counts_for_no_fix_and_a_new_one_does_again(receiver: Any, late: float) -> None:
    made = receiver()
    for _ in range(2):
        made.imu(1.0, late=late)
        assert made.answer(made.fix()) is None
        assert "without a heading of its time" in made.node.status()[1]
        made.imu(1.0)
        assert made.answer(made.fix()) is not None


def test_the_yaw_rate_of_orientations_is_that_between_the_last_two_across_a_half_turn_and_a_gap(receiver: Any) -> None:
    made = receiver(heading="quaternion", heading_offset=0.5)
    rates = []
    for gap, psi in ((0.1, 3.0), (0.1, 3.05), (0.2, -3.1 + 2.0 * math.pi), (0.1, 3.1), (5.0, -3.0), (0.1, -3.02)):
        made.wait(gap)
        message = made.stamped(QuaternionStamped())
        message.quaternion.z, message.quaternion.w = math.sin(0.5 * psi), math.cos(0.5 * psi)
        made.node._on_quaternion(message)
        motion = made.answer(made.fix())
        assert motion.psi == pytest.approx(math.remainder(psi + 0.5, 2.0 * math.pi), abs=1e-6)
        rates.append(motion.r)
    turned = 2.0 * math.pi - 3.1 - 3.05
    assert rates == pytest.approx([0.0, 0.5, turned / 0.2, (3.1 - 2.0 * math.pi + 3.1) / 0.1, 0.0, -0.2], abs=1e-6)


def test_two_antennas_give_heading_and_yaw_rate_only_of_fixes_of_one_time(receiver: Any) -> None:
    made = receiver(heading="antennas")
    found = []
    for gap, psi, late in ((0.1, 0.4, 0.0), (0.2, 0.3, 0.05), (0.2, 0.2, 0.15), (0.2, 0.1, 0.0)):
        made.wait(gap)
        made.node._on_second_fix(made.fix(2.0 * math.cos(psi), 2.0 * math.sin(psi), late=late))
        motion = made.answer(made.fix())
        found.append(None if motion is None else (motion.psi, motion.r))
    assert found[2] is None, "the second fix is too old"
    headings, rates = zip(*(each for each in found if each is not None), strict=True)
    assert headings == pytest.approx((0.4, 0.3, 0.1), abs=1e-4)
    assert rates == pytest.approx((0.0, -0.5, -0.5), abs=1e-3)


@pytest.mark.parametrize("without", ["status", "place"])
def test_a_second_antenna_without_a_fix_never_turns_the_heading(receiver: Any, without: str) -> None:
    made = receiver(heading="antennas")
    for _ in range(2):
        made.wait(0.2)
        made.node._on_second_fix(made.fix(2.0, 0.0))
        assert made.answer(made.fix()).psi == pytest.approx(0.0, abs=1e-4)
        for good_before in (True, False):
            made.wait(0.2)
            if good_before:
                made.node._on_second_fix(made.fix(2.0, 0.0))
            lost = made.fix(0.0, 2.0)
            if without == "status":
                lost.status.status = -1
            else:
                lost.latitude = lost.longitude = 0.0
            made.node._on_second_fix(lost)
            assert "fix_2" in made.node.status()[1]
            motion = made.answer(made.fix())
            assert (motion is not None) == good_before
            if motion is not None:
                assert motion.psi == pytest.approx(0.0, abs=1e-4)


def test_two_antennas_give_the_heading_and_the_yaw_rate_of_each_interval(receiver: Any) -> None:
    made = receiver(heading="antennas")
    psi, found, expected = 3.0, [], []
    for k in range(30):
        made.wait(0.1)
        turned = 0.03 * math.sin(k) + 0.02
        psi += turned
        made.node._on_second_fix(made.fix(2.0 * math.cos(psi), 2.0 * math.sin(psi)))
        motion = made.answer(made.fix())
        assert motion.psi == pytest.approx(math.remainder(psi, 2.0 * math.pi), abs=1e-4)
        found.append(motion.r)
        expected.append(turned / 0.1)
    assert found[1:] == pytest.approx(expected[1:], abs=1e-3)


@pytest.mark.parametrize("datum", [(-17.0, 179.9999), (-17.0, -180.0), (65.0, -179.9999), (-89.0, 180.0)])
def test_a_boat_with_two_antennas_crosses_the_date_line_and_loses_its_fix_on_the_way(
    receiver: Any, datum: tuple[float, float]
) -> None:
    made = receiver(datum=list(datum), heading="antennas", velocity="course", antenna=[0.5, 0.2])
    psi, longitudes, found = 0.3, [], []
    c, s = math.cos(psi), math.sin(psi)
    for k in range(60):
        made.wait(0.1)
        way = 0.5 * k - 15.0
        x, y = way * c, way * s
        first = made.fix(x + 0.5 * c - 0.2 * s, y + 0.5 * s + 0.2 * c)
        longitudes.append(first.longitude)
        second = made.fix(x + 2.5 * c - 0.2 * s, y + 2.5 * s + 0.2 * c)
        first.status.status = second.status.status = -1 if 20 <= k < 35 else 0
        made.node._on_second_fix(second)
        made.node._on_course(Float64(data=0.5 * math.pi - psi))
        made.node._on_speed(Float64(data=5.0))
        motion = made.answer(first)
        assert (motion is None) == (20 <= k < 35)
        if motion is not None:
            found.append((motion.x - x, motion.y - y, motion.psi - psi, motion.u - 5.0, motion.v, motion.r))
    assert np.ptp(longitudes) > 359.0, "on both sides of it"
    # The bearings of the antennas are rounded to 1e-9 m over 2 m; near a pole north turns along the way.
    assert np.abs(found).max(axis=0) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("velocity", ["twist", "course"])
def test_a_velocity_counts_for_the_time_out_and_again_when_it_returns(receiver: Any, velocity: str) -> None:
    made = receiver(velocity=velocity)
    for _ in range(2):
        if velocity == "twist":
            message = made.stamped(TwistStamped())
            message.twist.linear.x, message.twist.linear.y = -0.6, 0.8
            made.node._on_velocity(message)
        else:
            made.node._on_course(Float64(data=math.atan2(-0.6, 0.8)))
            made.node._on_speed(Float64(data=1.0))
        speeds = []
        for _ in range(8):
            made.wait(0.1)
            made.imu(0.5 * math.pi)
            speeds.append(made.answer(made.fix())[3:5])
        assert speeds[:4] == [pytest.approx((0.8, 0.6), abs=1e-6)] * 4
        assert speeds[5:] == [(0.0, 0.0)] * 3


@pytest.mark.parametrize("velocity", ["none", "twist", "course"])
def test_a_velocity_that_is_declared_and_does_not_come_is_reported_for_as_long_as_that_lasts(
    receiver: Any, velocity: str
) -> None:
    made = receiver(velocity=velocity)
    for _ in range(3):
        made.node.problem.report(OK, "")
        made.wait(10.0)
        made.imu(0.0)
        assert made.answer(made.fix())[3:5] == (0.0, 0.0)
        assert ("no velocity within 0.5 s of the fix" in made.node.status()[1]) == (velocity != "none")


@pytest.mark.parametrize("course", [275.0, -90.0, 6.5])
def test_a_course_in_degrees_gives_no_velocity_and_is_named(receiver: Any, course: float) -> None:
    made = receiver(velocity="course")
    made.node._on_course(Float64(data=course))
    assert f"course must be in rad, clockwise from north, within 2·pi (got {course:g})" in made.node.status()[1]
    made.node._on_speed(Float64(data=1.0))
    made.imu(0.0)
    assert made.answer(made.fix())[3:5] == (0.0, 0.0)


def test_an_imu_that_declares_its_orientation_as_not_measured_gives_no_heading(receiver: Any) -> None:
    made = receiver()
    message = made.stamped(Imu())
    message.orientation.w, message.orientation_covariance[0] = 1.0, -1.0  # as REP-145 has it; the quaternion is a heading of 0
    made.node._on_imu(message)
    assert "imu must have an orientation" in made.node.status()[1]
    assert made.answer(made.fix()) is None


def test_the_yaw_rate_of_an_imu_that_does_not_measure_it_is_that_of_its_headings(receiver: Any) -> None:
    made = receiver()
    for k in range(3):
        made.wait(0.1)
        message = made.stamped(Imu())
        message.orientation.z, message.orientation.w = math.sin(0.01 * k), math.cos(0.01 * k)
        message.angular_velocity_covariance[0] = -1.0
        made.node._on_imu(message)
        assert made.answer(made.fix())[5] == pytest.approx(0.2 * bool(k), abs=1e-6)


@pytest.mark.parametrize("silent", ["course", "speed"])
def test_a_course_and_a_speed_count_only_together_and_again_when_both_return(receiver: Any, silent: str) -> None:
    made = receiver(velocity="course")
    for lost in ("", silent, "", silent, ""):
        speeds = []
        for _ in range(12):
            made.wait(0.1)
            if lost != "course":
                made.node._on_course(Float64(data=math.atan2(-0.6, 0.8)))
            if lost != "speed":
                made.node._on_speed(Float64(data=1.0))
            made.imu(0.5 * math.pi)
            speeds.append(made.answer(made.fix())[3:5])
        assert speeds[-1] == ((0.0, 0.0) if lost else pytest.approx((0.8, 0.6), abs=1e-6))


def test_while_no_velocity_is_measured_none_is_made_of_the_turn_of_the_antenna(receiver: Any) -> None:
    made = receiver(velocity="twist", antenna=[2.0, 1.0])
    for _ in range(2):
        message = made.stamped(TwistStamped())
        message.twist.linear.x, message.twist.linear.y = 0.8, 0.6
        made.node._on_velocity(message)
        made.imu(0.0, r=0.25)
        assert made.answer(made.fix())[3:5] == pytest.approx((0.8 + 0.25 * 1.0, 0.6 - 0.25 * 2.0), abs=1e-6)
        made.wait(1.0)
        for _ in range(2):
            made.imu(0.0, r=0.25)
            assert made.answer(made.fix())[3:5] == (0.0, 0.0)


def test_a_negative_speed_over_a_course_is_opposite_to_it(receiver: Any) -> None:
    made = receiver(velocity="course")
    made.node._on_course(Float64(data=0.5 * math.pi))
    for speed in (1.5, -1.5):
        made.node._on_speed(Float64(data=speed))
        made.imu(0.0)
        assert made.answer(made.fix())[3:5] == pytest.approx((speed, 0.0), abs=1e-6)


@pytest.mark.parametrize("given", [[], list(DATUM)])
def test_the_datum_is_stated_for_who_comes_later(bench: Any, receiver: Any, given: list[float]) -> None:
    made = receiver(datum=given)
    made.imu(0.0)
    first = made.fix(100.0, 50.0)
    for fix in (first, made.fix(100.0, 50.0)):
        made.answer(fix)
    stated = bench.collect(NavSatFix, "odom/datum", qos.LATCHED)
    bench.until(lambda: stated)
    assert [stated[0].latitude, stated[0].longitude] == (given or [first.latitude, first.longitude])
    assert stated[0].header.frame_id == "odom"


def test_without_a_datum_the_first_fix_is_the_origin_for_good(receiver: Any) -> None:
    made = receiver(datum=[])
    made.imu(0.0)
    assert made.answer(made.fix(100.0, 50.0)) is None, "the next fix has to agree"
    assert "waiting for a second fix" in made.node.status()[1]
    places = []
    for east in (100.0, 130.0, 80.0):
        made.wait(0.1)
        made.imu(0.0)
        places.append(made.answer(made.fix(east, 50.0))[:2])
    assert places == [pytest.approx(place, abs=1e-3) for place in ((0.0, 0.0), (30.0, 0.0), (-20.0, 0.0))]


@pytest.mark.parametrize(("kind", "variances"), [(0, (0.0, 0.0)), (1, (4.0, 9.0)), (3, (4.0, 9.0))])
def test_a_covariance_that_is_not_known_is_zero_and_none_of_an_earlier_fix(
    receiver: Any, kind: int, variances: tuple[float, float]
) -> None:
    made = receiver()
    for each, expected in ((2, (4.0, 9.0)), (kind, variances)):
        made.wait(0.1)
        made.imu(0.0)
        fix = made.fix()
        fix.position_covariance, fix.position_covariance_type = [4.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0], each
        made.answer(fix)
        covariance = made.sent[-1][1].pose.covariance
        assert (covariance[0], covariance[7]) == expected


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 20.0])
@pytest.mark.parametrize("first", ["fix", "fix_2", "drawn"])
def test_the_heading_of_two_antennas_of_a_boat_that_moves_abeam_does_not_depend_on_which_fix_comes_first(
    receiver: Any, rate_hz: float, first: str
) -> None:
    made, rng, found = receiver(heading="antennas"), np.random.default_rng(3), []
    for k in range(40):
        made.wait(1.0 / rate_hz)
        north = 2.0 * k / rate_hz  # 2 m/s abeam, with the antennas 1 m apart along the hull
        fixes = [(made.node._on_fix, made.fix(0.0, north)), (made.node._on_second_fix, made.fix(1.0, north))]
        for take, message in fixes if first == "fix" or (first == "drawn" and rng.random() < 0.5) else fixes[::-1]:
            take(message)
        found += [conv.read_odometry(message) for _, message in made.sent[len(found) :]]
    assert len(found) == 40, "each epoch"
    assert max(abs(motion.psi) for motion in found) < 1e-6
    assert max(abs(motion.y - 2.0 * k / rate_hz) for k, motion in enumerate(found)) < 1e-6


def test_a_second_antenna_of_other_epochs_is_reported_with_the_difference_that_is_allowed(receiver: Any) -> None:
    made = receiver(heading="antennas")
    for _ in range(20):
        made.wait(0.1)
        made.node._on_second_fix(made.fix(1.0, 0.0, late=0.05))
        made.node._on_fix(made.fix())
    assert not made.sent
    assert "no fix and fix_2 are of one time, within 0.05 s" in made.node.status()[1]


@pytest.mark.parametrize(("east", "shown"), [(0.0, "0"), (0.05, "0.05"), (2e3, "2e+03"), (3e5, "300 km")])
def test_two_antennas_that_are_none_of_one_vessel_give_no_heading(receiver: Any, east: float, shown: str) -> None:
    made = receiver(heading="antennas")
    made.node._on_second_fix(made.fix(east, 0.0))
    assert made.answer(made.fix()) is None
    assert f"got {shown}" in made.node.status()[1]


@pytest.mark.parametrize("place", [(63.44, 10.39), (-33.9, 18.4), (10.0, -80.0), (1.0, 179.99)])
@pytest.mark.parametrize("wrong", ["exchanged", "another place", "rounded"])
def test_a_datum_of_another_place_is_refused_with_its_distance(receiver: Any, place: tuple[float, float], wrong: str) -> None:
    datum = {"exchanged": place[::-1], "another place": (50.0, 5.0), "rounded": tuple(map(math.floor, place))}[wrong]
    if abs(datum[0]) >= 90.0:
        pytest.skip("refused at the start")
    made = receiver(datum=[float(part) for part in datum])
    fix = made.fix()
    fix.latitude, fix.longitude = place
    made.imu(0.0)
    answer = made.answer(fix)
    if Plane(*map(float, datum)).distance(*place) <= 50e3:
        assert answer is not None
        return
    assert answer is None
    text = made.node.status()[1]
    assert "fix must be within 50 km of the datum" in text
    assert ("latitude and longitude of the datum exchanged?" in text) == (wrong == "exchanged")


def test_a_wrong_first_fix_is_no_datum_and_a_single_wrong_one_later_moves_nothing(receiver: Any) -> None:
    made = receiver(datum=[])
    fixes = [(9e4, 0.0), (10.0, 20.0), (10.0, 20.0), (15.0, 20.0), (9e4, 0.0), (20.0, 20.0)]
    found = []
    for east, north in fixes:
        made.wait(0.1)
        made.imu(0.0)
        motion = made.answer(made.fix(east, north))
        found.append(None if motion is None else round(motion.x, 3))
        if east > 1e4 and len(found) > 1:
            assert "was the first fix wrong?" in made.node.status()[1]
    assert found == [None, None, 0.0, 5.0, None, 10.0]

"""Recordings whose clocks, stamps, frames or units are wrong are refused with the reason, before anything is estimated."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from boat_bags import EPOCH, sailed, write_boat
from durations import rest_long
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.exceptions import IdentificationError
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.measurements import from_bag, from_csv
from vessel_hsmc_ros.studies.identification.types import Measurements, model

ROWS = sailed()
HALF = 30.0


def both(stamp: Callable[[float], float]) -> Callable[[float], tuple[float, float]]:
    return lambda time: (stamp(time), stamp(time))


def in_parent_frame(row: Array) -> Array:
    c, s = math.cos(row[3]), math.sin(row[3])
    row[4], row[5] = c * row[4] - s * row[5], s * row[4] + c * row[5]
    return row


def in_knots(row: Array) -> Array:
    row[4:6] *= 3600.0 / 1852.0
    return row


def in_degrees_per_second(row: Array) -> Array:
    row[6] = math.degrees(row[6])
    return row


def without_twist(row: Array) -> Array:
    row[4:7] = 0.0
    return row


def ned(row: Array) -> Array:
    """x north, y east, heading and rate clockwise, v to starboard."""
    row[1], row[2] = row[2], row[1]
    row[3], row[5], row[6] = 0.5 * math.pi - row[3], -row[5], -row[6]
    return row


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "wrench 3 s late": ({"stamps": lambda t: (EPOCH + t, EPOCH + t + 3.0)}, "applied_wrench are 3 s ahead of those of /odom"),
    "wrench 3 s early": ({"stamps": lambda t: (EPOCH + t, EPOCH + t - 3.0)}, "applied_wrench are 3 s behind those of /odom"),
    "wrench of another time zone": ({"stamps": lambda t: (EPOCH + t, EPOCH + t + 3600.0)}, "are they in local time"),
    "clock set back": ({"stamps": both(lambda t: EPOCH + t - 60.0 * (t > HALF))}, "have stepped by -60 s"),
    "clock set ahead": ({"stamps": both(lambda t: EPOCH + t + 60.0 * (t > HALF))}, "have stepped by 60 s"),
    "a second pass": ({"stamps": both(lambda t: EPOCH + t % HALF)}, "have stepped by -30 s"),
    "no stamps": ({"stamps": both(lambda _: 0.0)}, r"/odom has no stamps \(0\)"),
    "odometry without stamps": ({"stamps": lambda t: (0.0, EPOCH + t)}, r"/odom has no stamps \(0\)"),
    "wrench without stamps": ({"stamps": lambda t: (EPOCH + t, 0.0)}, r"/applied_wrench has no stamps \(0\)"),
    "stamps in whole seconds": ({"stamps": lambda t: (EPOCH + math.floor(t), EPOCH + t)}, "repeats its stamps"),
    "twist in the frame of the pose": ({"reported": in_parent_frame}, "is the twist in the frame of the pose"),
    "speed in knots": ({"reported": in_knots}, "are they in knots"),
    "yaw rate in degrees": ({"reported": in_degrees_per_second}, "degrees per second"),
}


@pytest.mark.parametrize("fault", rest_long(FAULTS, 8))
def test_a_recording_with_a_fault_is_refused_with_its_reason(tmp_path: Path, fault: str) -> None:
    options, reason = FAULTS[fault]
    path = write_boat(tmp_path / "bag_0.mcap", ROWS, **options)
    with pytest.raises(IdentificationError, match=reason) as error:
        from_bag(path)
    assert "\n" not in str(error.value)


@given(offset=st.floats(0.6, 4000.0), sign=st.sampled_from([-1.0, 1.0]), shift=st.floats(-1e6, 1e6))
@settings(max_examples=15, deadline=None)
def test_whatever_the_offset_of_two_clocks_it_is_named_and_one_of_both_topics_is_none(
    tmp_path_factory: pytest.TempPathFactory, offset: float, sign: float, shift: float
) -> None:
    folder, rows = tmp_path_factory.mktemp("clocks"), ROWS[:200]

    def stamps(time: float) -> tuple[float, float]:
        return EPOCH + shift + time, EPOCH + shift + time + sign * offset

    with pytest.raises(IdentificationError, match=f"{'ahead of' if sign > 0.0 else 'behind'} those of /odom"):
        from_bag(write_boat(folder / "apart.mcap", rows, stamps=stamps))
    same = from_bag(write_boat(folder / "same.mcap", rows, stamps=both(lambda time: EPOCH + shift + time)))
    np.testing.assert_allclose(same.wrench[:, 0], rows[:, 7])


@given(back=st.floats(3.0, 29.0), at=st.floats(20.0, 40.0))
@settings(max_examples=15, deadline=None)
def test_a_clock_that_is_set_back_at_any_time_is_named_also_where_the_log_times_go_back_with_it(
    tmp_path_factory: pytest.TempPathFactory, back: float, at: float
) -> None:
    rows = ROWS.copy()
    rows[:, 0] -= back * (rows[:, 0] > at)
    with pytest.raises(IdentificationError, match=r"stepped by -|s are covered twice"):
        from_bag(write_boat(tmp_path_factory.mktemp("back") / "bag_0.mcap", rows))


def test_messages_that_are_repeated_as_they_are_count_once(tmp_path: Path) -> None:
    found = from_bag(write_boat(tmp_path / "twice.mcap", np.repeat(ROWS[:200], 2, axis=0)))
    np.testing.assert_array_equal(found.pose, from_bag(write_boat(tmp_path / "once.mcap", ROWS[:200])).pose)


def test_velocities_that_are_not_filled_in_are_those_of_the_positions_and_that_is_a_warning(tmp_path: Path) -> None:
    found = from_bag(write_boat(tmp_path / "bag_0.mcap", ROWS, reported=without_twist))
    assert np.isnan(found.velocity).all()
    assert "the velocities are 0 in all samples" in found.doubts[0]


def table(folder: Path, rows: Array, factor: float = 1.0, velocities: bool = True) -> Path:
    """The rows as a CSV file whose time is in another unit."""
    columns = [0, 1, 2, 3, *((4, 5, 6) if velocities else ()), 7, 8]
    names = ["time", "x", "y", "heading", *(("u", "v", "r") if velocities else ()), "surge_force", "yaw_moment"]
    path = folder / "run.csv"
    scaled = rows.copy()
    scaled[:, 0] *= factor
    np.savetxt(path, scaled[:, columns], delimiter=",", header=",".join(names), comments="")
    return path


@pytest.mark.parametrize("velocities", [True, False])
@pytest.mark.parametrize("factor", [1e3, 1e6, 1e9])
def test_times_that_are_not_in_seconds_are_refused_at_once(tmp_path: Path, factor: float, velocities: bool) -> None:
    with pytest.raises(IdentificationError, match=r"time must be in s|velocities|positions"):
        identify([from_csv(table(tmp_path, ROWS, factor, velocities))], model("paper"))


def test_a_table_whose_velocities_contradict_its_positions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(IdentificationError, match="is the twist in the frame of the pose"):
        from_csv(table(tmp_path, np.array([in_parent_frame(row.copy()) for row in ROWS])))


@pytest.mark.long
def test_a_force_that_never_changes_ends_with_a_reason_and_no_traceback() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    motion = np.column_stack([time, 0.1 * np.sin(time), 0.1 * np.sin(0.5 * time)])
    run = Measurements(time, motion, np.full((600, 3), np.nan), np.tile([200.0, 0.0, 10.0], (600, 1)))
    with pytest.raises(IdentificationError):
        identify([run], model("paper"))


def test_where_no_ship_fits_the_doubts_are_the_reason(tmp_path: Path) -> None:
    run = from_bag(write_boat(tmp_path / "bag_0.mcap", ROWS, reported=ned))
    doubtful = run._replace(doubts=("sign of moment: positive yaw moment drives to starboard",))
    with pytest.raises(IdentificationError, match="positive yaw moment drives to starboard; the"):
        identify([doubtful], model("paper"))

"""Measurements from runs and CSV files, and the errors of those that do not serve."""

from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, TYPES, message, serialized, topic
from cybership2_runs import cybership2

from vessel_hsmc_ros import load_scenario, simulate
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import IdentificationError, ParameterError
from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.measurements import checked, from_bag, from_csv, from_run
from vessel_hsmc_ros.studies.identification.types import model


def written(folder: Path, header: str, rows: object) -> Path:
    """A CSV file."""
    path = folder / "run.csv"
    np.savetxt(path, np.asarray(rows), delimiter=",", header=header, comments="")
    return path


def test_a_run_gives_its_measured_motion_and_applied_wrench() -> None:
    run = simulate(load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 2.0}))
    found = from_run(run)
    np.testing.assert_array_equal(found.velocity, run.measured[:, 3:])
    np.testing.assert_array_equal(found.wrench[:, [0, 2]], run.wrench[:, [0, -1]])
    assert not found.wrench[:, 1].any()


def test_a_csv_file_is_read_by_the_names_of_its_columns(tmp_path: Path) -> None:
    time = np.arange(100) * 0.1
    rows = np.column_stack([time, np.sin(time), time, 90.0 + 100.0 * time, 2.0 * np.ones(100)])
    found = from_csv(written(tmp_path, "t,x,y,heading_deg,surge_force", rows), {"time": "t"})
    np.testing.assert_allclose(found.pose[:, 2], np.radians(90.0 + 100.0 * time))
    assert np.isnan(found.velocity).all()
    assert (found.wrench == (2.0, 0.0, 0.0)).all()


def test_a_heading_in_radians_takes_precedence_over_one_in_degrees(tmp_path: Path) -> None:
    time = np.arange(100) * 0.1
    rows = np.column_stack([time, np.sin(time), time, 0.01 * time, 7.0 + time, 2.0 * np.ones(100)])
    for header in ("time,x,y,heading,heading_deg,surge_force", "time,x,y,heading, heading_deg ,surge_force"):
        np.testing.assert_allclose(from_csv(written(tmp_path, header, rows)).pose[:, 2], 0.01 * time)


@pytest.mark.parametrize("begin", [0.0, -180.0])
@pytest.mark.parametrize("unit", ["heading", "heading_deg"])
def test_a_heading_goes_on_where_it_wraps_to_either_side(tmp_path: Path, unit: str, begin: float) -> None:
    time = np.arange(200) * 0.1
    heading = 300.0 * np.sin(0.5 * time)
    given = begin + np.mod(heading - begin, 360.0)
    given = np.radians(given) if unit == "heading" else given
    rows = np.column_stack([time, np.sin(time), time, given, 2.0 * np.ones(200)])
    found = from_csv(written(tmp_path, f"time,x,y,{unit},surge_force", rows)).pose[:, 2]
    np.testing.assert_allclose(found - found[0], np.radians(heading - heading[0]), atol=1e-9)


@pytest.mark.parametrize(
    ("header", "names", "message"),
    [
        ("time,x,heading,surge_force,u", {}, "has no column y"),
        ("time,x,y,course,surge_force", {}, "has no column heading"),
        ("time,x,y,heading,surge_force", {"u": "speed"}, "has no column speed"),
        ("time,x,y,heading,surge_force", {"speed": "x"}, "speed is not a column"),
    ],
)
def test_a_missing_column_is_named(tmp_path: Path, header: str, names: dict[str, str], message: str) -> None:
    with pytest.raises(IdentificationError, match=message):
        from_csv(written(tmp_path, header, np.ones((60, 5))), names)


def test_velocities_count_only_where_all_of_them_are_measured(tmp_path: Path) -> None:
    time = np.arange(100) * 0.1
    rows = np.column_stack([time, time, np.sin(time), 0.1 * time, 1.0 + 0.0 * time, 0.2 + 0.0 * time, 0.1 + 0.0 * time, time])
    rows[10, 5] = rows[20, 4] = rows[30, 6] = np.nan
    velocity = from_csv(written(tmp_path, "time,x,y,heading,u,v,r,surge_force", rows)).velocity
    assert np.isnan(velocity[[10, 20, 30]]).all()
    assert np.isfinite(np.delete(velocity, [10, 20, 30], axis=0)).all()


@pytest.mark.parametrize("width", [0.0, 1.0])
def test_the_wrench_between_the_samples_of_a_slow_sensor_is_averaged(tmp_path: Path, width: float) -> None:
    number = np.arange(120)
    held = number // 3 * 3
    rows = np.column_stack([0.1 * number, 0.1 * held, width * np.sin(0.1 * held), 0.01 * number, number, -number])
    found = from_csv(written(tmp_path, "time,x,y,heading,surge_force,yaw_moment", rows))
    np.testing.assert_allclose(found.time, 0.1 * number[::3])
    np.testing.assert_allclose(found.wrench, np.outer(number[1::3], [1.0, 0.0, -1.0]))


def test_a_wrench_of_other_stamps_holds_until_the_next_in_whatever_order_they_were_recorded(tmp_path: Path) -> None:
    found = []
    for number, order in enumerate((np.arange(100), np.random.default_rng(3).permutation(100))):
        writer, rng = BagWriter(tmp_path / f"bag_{number}"), np.random.default_rng(1)
        for name, later in (("odom", 0), ("applied_wrench", PERIOD // 3)):
            written = topic(f"/{name}", TYPES[name])
            writer.add_topic(written)
            made = [message(written.kind, k * PERIOD + later, rng) for k in range(100)]
            for at, k in enumerate(order):
                writer.write(written, serialized(made[k], written.kind), at, at)
        writer.close()
        found.append(from_bag(writer.directory))
    np.testing.assert_array_equal(found[0].wrench, found[1].wrench)
    assert len(found[0].time) == 99, "before the first wrench there is none"
    assert found[0].wrench[0, 0] == made[0].wrench.force.x
    np.testing.assert_array_equal(found[0].velocity, found[1].velocity)


@pytest.mark.parametrize("word", ["fast", "1_0", "\u0661"])
def test_a_file_that_is_not_a_table_is_one_line(tmp_path: Path, word: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(f"time,x\n1,2\n3,{word}\n", encoding="utf-8")
    with pytest.raises(IdentificationError, match=r"cannot read .*run\.csv") as caught:
        from_csv(path)
    assert "\n" not in str(caught.value)


def test_samples_that_do_not_serve_are_refused_with_their_place() -> None:
    run = cybership2(0, duration=60.0)
    broken, late = run.pose.copy(), run.time.copy()
    broken[7, 1] = np.nan
    late[100:] += 30.0
    for given, text in (
        (run._replace(pose=broken), "pose of sample 7 is not finite"),
        (run._replace(time=run.time[::-1]), "must increase"),
        (run._replace(time=late), r"no sample for 30\.2 s at t = 19\.8 s"),
        (run._replace(wrench=0.0 * run.wrench), "no force or moment"),
        (type(run)(run.time[:20], run.pose[:20], run.velocity[:20], run.wrench[:20]), "has 20 samples"),
    ):
        with pytest.raises(IdentificationError, match=text):
            checked(given)
    with pytest.raises(IdentificationError, match="at least one window of 90 s"):
        identify([run], model("paper"), window=90.0)


def test_a_parameter_that_does_not_exist_gets_a_suggestion() -> None:
    with pytest.raises(ParameterError, match="did you mean yaw_damping"):
        model(["yaw_dampin"])
    with pytest.raises(ParameterError, match="is not a model"):
        model("papers")

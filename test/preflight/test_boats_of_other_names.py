"""Bags of real boats: odometry and wrench have other names, and there is neither a scenario nor a plant."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from boat_bags import EPOCH, ODOMETRY, WRENCH, odometry, sailed, wrench, write_boat
from click.testing import CliRunner
from mcap.writer import Writer

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.cli.command import cli
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError
from vessel_hsmc_ros.messages.topics import definition
from vessel_hsmc_ros.preflight.expected import connection_in
from vessel_hsmc_ros.report.from_bag import of_bag
from vessel_hsmc_ros.studies.identification.measurements import from_bag

ROWS = sailed(duration=20.0)

BOATS = {
    "robot_localization": ("/odometry/filtered", "/cmd_wrench"),
    "mavros": ("/mavros/local_position/odom", "/cmd_wrench"),
    "namespace": ("/heron/odom", "/heron/cmd_wrench"),
    "stray namespaces": ("/heron/localisation/odom", "/heron/control/cmd_wrench"),
    "names of their own": ("/state/estimate", "/thrust/total"),
    "own": ("/odom", "/applied_wrench"),
}


def also(*topics: tuple[str, str]) -> Callable[[Writer], None]:
    """Writes further topics of odometry and wrench, with other numbers."""

    def write(writer: Writer) -> None:
        for name, kind in topics:
            schema = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            channel = writer.register_channel(name, "cdr", schema)
            for row in ROWS:
                made = (odometry if kind == ODOMETRY else wrench)(EPOCH + row[0], 7.0 * row)
                writer.add_message(channel, round((EPOCH + row[0]) * 1e9), made, 0)

    return write


@pytest.mark.parametrize(
    "beside", [(), (("/controller/estimate", ODOMETRY), ("/normalised_wrench", WRENCH), ("/disturbance", WRENCH))]
)
@pytest.mark.parametrize("boat", BOATS)
def test_odometry_and_wrench_of_one_boat_are_found_under_any_name(
    tmp_path: Path, boat: str, beside: tuple[tuple[str, str], ...]
) -> None:
    path = write_boat(tmp_path / "bag_0.mcap", ROWS, topics=BOATS[boat], extra=also(*beside))
    found, record = from_bag(path), of_bag(path)
    np.testing.assert_allclose(found.pose[:, :2], ROWS[:, 1:3], atol=1e-9)
    np.testing.assert_allclose(found.wrench[:, [0, 2]], ROWS[:, [7, 8]])
    np.testing.assert_allclose(record.run.measured[:, :2], ROWS[:, 1:3], atol=1e-9)
    commanded = record.run.control["commanded"] if "cmd_wrench" in BOATS[boat][1] else record.run.wrench
    np.testing.assert_allclose(commanded, ROWS[:, [7, 8]])
    connection = connection_in(open_bag(path))
    assert connection.topic(connection.roles[0]).name == BOATS[boat][0]


def test_of_several_topics_one_is_chosen_and_the_choice_is_named(tmp_path: Path) -> None:
    extra = also(("/odometry/gps", ODOMETRY), ("/wrench/port", WRENCH))
    path = write_boat(tmp_path / "bag_0.mcap", ROWS, topics=("/odometry/filtered", "/wrench/sum"), extra=extra)
    with pytest.raises(BagError, match="choose one of /odometry/filtered, /odometry/gps by --odometry"):
        from_bag(path)
    found = from_bag(path, odometry="/odometry/filtered", wrench="/wrench/sum")
    np.testing.assert_allclose(found.pose[:, :2], ROWS[:, 1:3], atol=1e-9)
    np.testing.assert_allclose(open_bag(path, odometry="/odometry/gps").run().state[:, 0], 7.0 * ROWS[:, 1], atol=1e-9)
    with pytest.raises(BagError, match=rf"has no {ODOMETRY} on /wrench/sum: it has /odometry/filtered, /odometry/gps"):
        open_bag(path, odometry="/wrench/sum")


def test_the_options_of_report_choose_the_topics(tmp_path: Path) -> None:
    extra = also(("/odometry/gps", ODOMETRY))
    path = write_boat(tmp_path / "bag_0.mcap", ROWS, topics=("/odometry/filtered", "/wrench/sum"), extra=extra)
    page = tmp_path / "page.html"
    arguments = ["report", str(path), "--file", str(page), "--odometry", "/odometry/filtered", "--wrench", "/wrench/sum", "--csv"]
    CliRunner().invoke(cli, arguments, catch_exceptions=False, standalone_mode=False)
    (motion,) = tmp_path.glob("*csv/motion.csv")
    lines = motion.read_text().splitlines()
    x = float(lines[-1].split(",")[lines[0].split(",").index("x")])
    assert x == pytest.approx(ROWS[-1, 1])


def test_a_bag_of_a_real_boat_has_a_run_without_what_it_lacks(tmp_path: Path) -> None:
    path = write_boat(tmp_path / "bag_0.mcap", ROWS, topics=("/odom", "/cmd_wrench"))
    run = open_bag(path).run()
    np.testing.assert_allclose(run.state[:, :2], ROWS[:, 1:3], atol=1e-9)
    np.testing.assert_allclose(run.time, ROWS[:, 0], atol=1e-6)
    assert np.isnan(run.reference).all()
    assert np.isnan(run.disturbance).all()
    with pytest.raises(ScenarioError, match=r"recorder\.scenario_file stores it"):
        open_bag(path).scenario()

"""Bags of offline runs; test/processes compares their messages with those of the nodes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from durations import rest_long
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags import run_to_bag
from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import topics
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop

SHORT = {"vessel_sim.duration": 1.0}


def completed(name: str, **changes: object) -> ClosedLoop:
    loop = ClosedLoop(load_scenario(name, {**SHORT, **{key.replace("__", "."): value for key, value in changes.items()}}))
    loop.run()
    return loop


def written(folder: Path, name: str, **changes: object) -> tuple[Bag, ClosedLoop]:
    """A bag of a short offline run, and the run."""
    loop = completed(name, **changes)
    run_to_bag.write_bag(folder / "bag", loop.published(), load_scenario(name, SHORT))
    return open_bag(folder / "bag"), loop


@pytest.mark.parametrize("name", rest_long(["case2_tracking", "realistic", "waypoints"], 2))
def test_the_run_of_an_offline_bag_is_bit_identical_to_the_run(tmp_path: Path, name: str) -> None:
    bag, loop = written(tmp_path, name)
    read, run = bag.run(), loop.result()
    for field in ("time", "state", "measured", "reference", "wrench", "disturbance", "unforced_acceleration"):
        np.testing.assert_array_equal(getattr(read, field), getattr(run, field), err_msg=field)
    assert read.control.keys() - run.control.keys() == {"compute_time", "missed_periods", "operation", "reason"}
    for field, values in run.control.items():
        np.testing.assert_array_equal(read.control[field], values, err_msg=field)
    assert bag.complete
    assert bag.recording["mode"] == "offline"
    assert bag.recording["messages_dropped"] == "0"


def test_messages_are_in_the_order_of_their_stamps_across_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_to_bag, "BLOCK", 7)
    bag, _ = written(tmp_path, "realistic")
    stamps = [raw.log_time for raw in bag.raw_messages()]
    assert stamps == sorted(stamps)
    assert bag.topics["/odom"].count == 101
    assert bag.topics["/controller/state"].count == 51
    assert bag.topics["/reference"].count == 102  # as in lockstep, where the reference ship is one period ahead


def test_each_message_has_the_frames_of_the_node_that_publishes_it(tmp_path: Path) -> None:
    prefixes = {f"{node}.frame_prefix": f"{node}/" for node in ("vessel_sim", "reference_ship", "controller")}
    scenario = load_scenario("realistic", {"vessel_sim.duration": 0.02, **prefixes})
    loop = ClosedLoop(scenario, interpreted=True)
    loop.run()
    run_to_bag.write_bag(tmp_path / "bag", loop.published(), scenario)
    bag = open_bag(tmp_path / "bag")
    frames = {name.strip("/"): {*series["header.frame_id"]} for name, series in bag.topics.items() if "header.frame_id" in series}
    plant = ("applied_wrench", "disturbance", "dynamics/truth")
    assert frames == {
        **{name: {"vessel_sim/odom"} for name in ("odom", "odom/truth")},
        **{name: {"vessel_sim/base_link"} for name in plant},
        **{name: {"reference_ship/odom"} for name in ("reference", "reference/pose")},
        "controller/estimate": {"controller/odom"},
        **{name: {"controller/base_link"} for name in ("cmd_wrench", "controller/state")},
    }
    children = {name.strip("/"): {*series["child_frame_id"]} for name, series in bag.topics.items() if "child_frame_id" in series}
    assert children == {
        **{name: {"vessel_sim/base_link"} for name in ("odom", "odom/truth")},
        "controller/estimate": {"controller/base_link"},
    }


def test_rosbags_reads_an_offline_bag(tmp_path: Path) -> None:
    written(tmp_path, "case2_tracking")
    with AnyReader([tmp_path / "bag"]) as reader:
        assert reader.message_count == 9 * 101 + 2
        connection, _, data = next(reader.messages([c for c in reader.connections if c.topic == "/odom"]))
        message: Any = reader.deserialize(data, connection.msgtype)
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    assert message.pose.pose.position.x == 5.0
    information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["message_count"] == 9 * 101 + 2


def test_references_between_two_steps_are_in_the_bag(tmp_path: Path) -> None:
    bag, _ = written(tmp_path, "case2_tracking", reference_ship__rate_hz=200.0)
    assert bag.topics["/reference"].count == 202
    np.testing.assert_array_equal(np.diff(bag["reference"].stamp), 5_000_000)


def test_a_run_without_a_completed_step_gives_an_empty_bag(tmp_path: Path) -> None:
    scenario = load_scenario("case2_tracking", SHORT)
    assert run_to_bag.write_bag(tmp_path / "bag", ClosedLoop(scenario).published(), scenario) == 0
    assert open_bag(tmp_path / "bag").count == 0


def test_without_any_ros_message_package_the_types_of_a_bag_are_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with_packages, _ = written(tmp_path / "with", "case2_tracking")
    monkeypatch.setattr(topics, "prefixes", lambda: [tmp_path])
    topics._text.cache_clear()
    without, _ = written(tmp_path / "without", "case2_tracking")
    topics._text.cache_clear()
    for name, series in without.topics.items():
        assert series.type_hash == with_packages.topics[name].type_hash
        assert series.fields == with_packages.topics[name].fields
    with pytest.raises(BagError, match="no_such_msgs/msg/Odometry is not installed"):
        topics.definition("no_such_msgs/msg/Odometry")


# -- paths --------------------------------------------------------------------------------------------------------------


def test_a_run_folder_is_opened_as_its_bag(tmp_path: Path) -> None:
    written(tmp_path, "case2_tracking")
    assert open_bag(tmp_path).path == tmp_path / "bag"
    assert open_bag(next((tmp_path / "bag").glob("*.mcap"))).count == open_bag(tmp_path).count


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (["run.json", "report.html"], r"run folder .* has no bag: the run was made with --no-bag"),
        (["first/bag/metadata.yaml", "second/bag/metadata.yaml"], r"it holds 2 run folder\(s\), choose one, such as .*second"),
        (["notes.txt"], r"holds no MCAP file, but notes\.txt"),
        ([], "holds no MCAP file, but nothing"),
    ],
)
def test_a_folder_without_a_bag_is_refused_with_what_it_holds(tmp_path: Path, files: list[str], message: str) -> None:
    for name in files:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("")
    with pytest.raises(BagError, match=message):
        open_bag(tmp_path)

"""`open_bag`: the columns of topics equal what other readers find message by message."""

import math
import platform
import runpy
import shutil
import sys
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_making import PERIOD, STATUS, TYPES, message, serialized, status, topic, write_run
from mcap.writer import Writer
from message_reading import read_acceleration, read_disturbance
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.core.version import __version__
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_sim_node.plant import VesselParameters

VESSEL = VesselParameters().coefficients()
Recorded = tuple[Path, dict[str, list[bytes]]]
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "open_bag.py"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    directory = tmp_path_factory.mktemp("recorded") / "bag"
    return directory, write_run(directory, 300)


def read_by_rosbags(directory: Path) -> dict[str, list[Any]]:
    """Messages by topic, read by PyPI's rosbags."""
    messages: dict[str, list[Any]] = {}
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            messages.setdefault(connection.topic, []).append(reader.deserialize(data, connection.msgtype))
    return messages


def test_every_column_equals_what_rosbags_reads(recorded: Recorded) -> None:
    bag = open_bag(recorded[0])
    for name, messages in read_by_rosbags(recorded[0]).items():
        series = bag.topics[name]
        assert series.count == len(series) == len(messages)
        for field in series.fields:
            expected = [attrgetter(field)(each) for each in messages]
            if field == "status":
                assert [s.message for row in series[field] for s in row] == [s.message for row in expected for s in row]
            else:
                np.testing.assert_array_equal(series[field], np.array(expected), err_msg=f"{name} {field}")


def test_columns_have_the_types_of_the_message_fields(recorded: Recorded) -> None:
    state = open_bag(recorded[0])["controller/state"]
    assert state["surge_error"].dtype == np.float64
    assert state["missed_periods"].dtype == np.uint64
    assert state["yaw_saturated"].dtype == bool
    assert state["yaw_weights"].shape == (300, 27)
    assert state["header.frame_id"].tolist() == ["odom"] * 300
    assert state.stamp.dtype == np.int64
    np.testing.assert_array_equal(state.stamp, np.arange(300) * PERIOD)


def test_columns_are_read_on_first_use_and_kept(recorded: Recorded, tmp_path: Path) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    bag = open_bag(tmp_path / "bag")
    bag.load("odom", "reference")
    covariance = bag["odom"]["pose.covariance"]
    (tmp_path / "bag" / "bag_0.mcap").unlink()  # from here on only columns that have been read are there
    assert bag["cmd_wrench"].count == 300
    for name in ("odom", "reference"):
        assert bag[name].stamp[-1] == 299 * PERIOD
    assert bag["odom"]["pose.covariance"] is covariance
    with pytest.raises(BagError, match=r"bag_0\.mcap cannot be read: No such file"):
        bag["reference"]["twist.linear.x"].sum() + bag["cmd_wrench"]["wrench.force.x"].sum()


def test_a_bag_describes_its_topics_times_and_metadata(recorded: Recorded) -> None:
    bag = open_bag(recorded[0])
    assert {name: series.type for name, series in bag.topics.items() if name != "/diagnostics"} == {
        name if name.startswith("/") else f"/{name}": kind for name, kind in TYPES.items()
    }
    assert bag.complete
    assert bag.count == 10 * 300 + 3
    assert (bag.start_time, bag.end_time) == (0, 299 * PERIOD)
    assert bag["odom"].type_hash.startswith("RIHS01_")
    assert bag["odom"].qos[0]["reliability"] == "reliable"
    assert bag.information["version"] == 9


def test_raw_messages_are_the_written_bytes_in_the_written_order(recorded: Recorded) -> None:
    directory, sent = recorded
    got: dict[str, list[bytes]] = {name: [] for name in sent}
    order = []
    for raw in open_bag(directory).raw_messages():
        got[raw.topic].append(raw.data)
        order.append(raw.log_time)
    assert got == sent
    assert order == sorted(order)


Rows = list[Any]


def rows_of_messages(messages: dict[str, list[Any]]) -> tuple[Rows, Rows, Rows, Rows]:
    """State, reference, wrench and disturbance as the nodes read them from single messages."""
    odometry = [conversions.read_odometry(m) for m in messages["/odom"]]
    reference = [conversions.read_reference(m)[0] for m in messages["/reference"]]
    wrench = [conversions.read_wrench(m) for m in messages["/applied_wrench"]]
    forces = [read_disturbance(m) for m in messages["/disturbance"]]
    return odometry, reference, wrench, [(u / VESSEL.m11, v / VESSEL.m22, r / VESSEL.m33) for u, v, r in forces]


def test_a_run_is_bit_identical_to_what_single_messages_give(recorded: Recorded) -> None:
    run = open_bag(recorded[0]).run(VESSEL)
    messages = read_by_rosbags(recorded[0])
    odometry, reference, wrench, disturbance = rows_of_messages(messages)
    np.testing.assert_array_equal(run.measured, odometry)
    np.testing.assert_array_equal(run.state, [conversions.read_odometry(m) for m in messages["/odom/truth"]])
    unforced = [read_acceleration(m) for m in messages["/dynamics/truth"]]
    np.testing.assert_array_equal(run.unforced_acceleration, unforced)
    np.testing.assert_array_equal(run.reference, reference)
    np.testing.assert_array_equal(run.wrench, wrench)
    np.testing.assert_array_equal(run.disturbance, disturbance)
    np.testing.assert_array_equal(run.time, np.arange(300) * PERIOD * 1e-9)
    assert run.control["surge_weights"].shape == (300, 27)
    assert "surge_weights" not in open_bag(recorded[0]).run(VESSEL, weights=False).control


def test_a_reference_with_another_stamp_is_extrapolated_to_that_of_the_odometry(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    writer = BagWriter(tmp_path / "bag")
    topics = {name: topic(f"/{name}", TYPES[name]) for name in ("odom", "applied_wrench", "disturbance", "reference")}
    made = {}
    for name, each in topics.items():
        writer.add_topic(each)
        for k in range(4):
            stamp = k * PERIOD + (PERIOD // 4 if name == "reference" else 0)
            made[name, k] = message(each.kind, stamp, rng)
            writer.write(each, serialized(made[name, k], each.kind), stamp, stamp)
    writer.close()
    run = open_bag(tmp_path / "bag").run(VESSEL)
    for k in range(4):
        state, acceleration = conversions.read_reference(made["reference", max(0, k - 1)])
        interval = (-PERIOD // 4 if k == 0 else PERIOD - PERIOD // 4) * 1e-9
        np.testing.assert_array_equal(run.state[k], run.measured[k])
        assert np.isnan(run.unforced_acceleration[k]).all()
        np.testing.assert_array_equal(run.reference[k], extrapolate(state, acceleration, interval))


@pytest.mark.parametrize("compression", ["none", "lz4"])
def test_a_bag_that_was_cut_off_is_read_up_to_where_it_breaks_off(tmp_path: Path, compression: str) -> None:
    sent = write_run(tmp_path / "bag", 300, compression)
    path = tmp_path / "bag" / "bag_0.mcap"
    content = path.read_bytes()
    counts = []
    for part in (0.4, 0.7, 0.98):
        path.write_bytes(content[: int(part * len(content))])
        bag = open_bag(tmp_path / "bag")
        assert not bag.complete
        counts.append(bag["odom"].count)
        assert [raw.data for raw in bag.raw_messages("odom")] == sent["/odom"][: counts[-1]]
        assert len(bag["odom"]["pose.pose.position.x"]) == counts[-1]
    assert counts == sorted(counts)
    assert counts[-1] > 200


def test_of_two_vessels_one_is_chosen_by_namespace(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    write_run(None, 10, namespace="/alpha/", close=False, writer=writer)
    write_run(None, 20, namespace="/beta/", writer=writer)
    bag = open_bag(tmp_path / "bag")
    assert bag.namespaces == ["/alpha/", "/beta/"]
    assert len(bag.run(VESSEL, "beta").time) == 20
    assert bag["/alpha/odom"].count == 10
    with pytest.raises(BagError, match="several vessels, in the namespaces /alpha/, /beta/: choose one"):
        bag.run(VESSEL)
    with pytest.raises(BagError, match="has 2 topics named odom: it has /alpha/odom, /beta/odom"):
        bag["odom"]


def test_messages_outside_of_chunks_are_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    each = topic("/odom", TYPES["odom"])
    with (tmp_path / "plain.mcap").open("wb") as stream:
        writer = Writer(stream, use_chunking=False)
        writer.start(profile="ros2")
        schema = writer.register_schema(each.kind, "ros2msg", each.definition.encode())
        channel = writer.register_channel(each.name, "cdr", schema, {})
        for k in range(5):
            writer.add_message(channel, k, serialized(message(each.kind, k, rng), each.kind), k)
        writer.finish()
    series = open_bag(tmp_path / "plain.mcap")["odom"]
    assert series.stamp.tolist() == [0, 1, 2, 3, 4]
    assert series.qos == []


def test_columns_of_messages_written_out_of_order_are_in_order_of_log_time(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    writer = BagWriter(tmp_path / "bag")
    each = topic("/odom", TYPES["odom"])
    writer.add_topic(each)
    for k in (2, 0, 1):
        writer.write(each, serialized(message(each.kind, k, rng), each.kind), k, k)
    writer.close()
    series = open_bag(tmp_path / "bag")["odom"]
    assert series.stamp.tolist() == series.log_time.tolist() == [0, 1, 2]
    assert series["pose.covariance"].shape == (3, 36)


def test_lists_of_different_lengths_are_columns_of_objects(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    writer = BagWriter(tmp_path / "bag")
    each = topic("/controller/state", TYPES["controller/state"])
    writer.add_topic(each)
    sizes = [3, 27, 3, 8]
    for k, size in enumerate(sizes):
        made = message(each.kind, k, rng, yaw_weights=np.arange(float(size)))
        writer.write(each, serialized(made, each.kind), k, k)
    writer.close()
    series = open_bag(tmp_path / "bag")["controller/state"]
    assert [len(row) for row in series["yaw_weights"]] == sizes
    assert series.stamp.tolist() == [0, 1, 2, 3]


def test_a_topic_without_messages_has_empty_columns(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/odom", TYPES["odom"]))
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag["odom"].count == len(bag["odom"]["pose.pose.position.x"]) == len(bag["odom"].stamp) == 0
    with pytest.raises(BagError, match="has no message on /odom"):
        bag.run(VESSEL)


def test_a_bag_without_a_scenario_takes_params_yaml_beside_it(recorded: Recorded, tmp_path: Path) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    with pytest.raises(ScenarioError, match=r"was recorded without its scenario, and .*params.yaml does not exist"):
        open_bag(tmp_path / "bag").scenario()
    scenario = load_scenario("case2_tracking", {"vessel_sim.vessel.surge_inertia": 2e5})
    (tmp_path / "params.yaml").write_text(dump_scenario(scenario))
    bag = open_bag(tmp_path / "bag")
    assert bag.scenario().vessel_sim.vessel.surge_inertia == 2e5
    assert (
        bag.scenario(
            {"controller.rate_hz": 200.0, "vessel_sim.rate_hz": 200.0, "reference_ship.rate_hz": 200.0}
        ).controller.rate_hz
        == 200.0
    )
    assert math.isclose(bag.run().disturbance[0, 0] * 2.0, bag.run(VESSEL).disturbance[0, 0] * VESSEL.m11 / 1e5)


def run_example(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["open_bag.py", str(bag)])
    runpy.run_path(str(EXAMPLE), run_name="__main__")


def test_the_example_describes_a_run(
    recorded: Recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    (tmp_path / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    run_example(tmp_path / "bag", monkeypatch)
    printed = capsys.readouterr().out
    assert "3003 messages in 2.99 s" in printed
    assert "/odom: 300 of nav_msgs/msg/Odometry" in printed
    assert "the law was hierarchical" in printed


def test_the_example_lists_the_topics_of_a_bag_without_a_run_and_ends_with_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/clock", TYPES["/clock"]))
    writer.close()
    with pytest.raises(SystemExit) as ended:
        run_example(tmp_path / "bag", monkeypatch)
    assert "/clock: 0 of rosgraph_msgs/msg/Clock" in capsys.readouterr().out
    assert str(ended.value).startswith("no run in this bag: bag ")
    assert "\n" not in str(ended.value)


def test_messages_written_out_of_order_are_replayed_in_order_of_log_time(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    topics = [topic(f"/{name}", TYPES[name]) for name in ("odom", "reference")]
    for each in topics:
        writer.add_topic(each)
    rng = np.random.default_rng(6)
    written = [3, 0, 2, 1, 4]
    for k in written:
        for each in topics:
            writer.write(each, serialized(message(each.kind, k, rng), each.kind), k, k)
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert [raw.log_time for raw in bag.raw_messages("odom")] == written
    assert [raw.log_time for raw in bag.ordered_messages("odom")] == [0, 1, 2, 3, 4]
    assert [(raw.log_time, raw.topic) for raw in bag.ordered_messages()] == [
        (k, name) for k in range(5) for name in ("/odom", "/reference")
    ]


def test_the_last_diagnostics_of_each_node_are_given_by_vessel(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    each = topic("/diagnostics", STATUS)
    odometry = [topic(f"{prefix}odom", TYPES["odom"]) for prefix in ("/", "/alpha/")]
    for added in (each, *odometry):
        writer.add_topic(added)
    rng = np.random.default_rng(7)
    for k, (node, text) in enumerate([("controller", "waiting"), ("alpha/controller", "other"), ("controller", "running")]):
        writer.write(each, serialized(status(k, rng, text, node), STATUS), k, k)
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag.diagnostics("/") == {"controller": {"message": "running"}}
    assert bag.diagnostics("alpha") == {"controller": {"message": "other"}}


def test_the_recording_names_the_versions_that_computed_it(recorded: Recorded) -> None:
    recording = open_bag(recorded[0]).recording
    assert recording["version"] == __version__
    assert recording["numpy"] == np.__version__
    assert recording["python"] == platform.python_version()
    assert open_bag(recorded[0]).information["custom_data"] == recording

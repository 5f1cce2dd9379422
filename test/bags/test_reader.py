"""`open_bag`: the columns of topics equal what other readers find message by message."""

import shutil
from dataclasses import astuple
from operator import attrgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bag_making import PERIOD, TYPES, Recorded, made_run, message, serialized, topic, write_run
from mcap.writer import Writer
from message_reading import read_acceleration, read_disturbance
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.run_from_bag import matched
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters

VESSEL = VesselParameters().coefficients()


def read_by_rosbags(directory: Path) -> dict[str, list[Any]]:
    """Messages by topic, read by PyPI's rosbags."""
    messages: dict[str, list[Any]] = {}
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            messages.setdefault(connection.topic, []).append(reader.deserialize(data, connection.msgtype))
    return messages


@pytest.mark.parametrize("namespace", ["/", "/alpha/"])
def test_velocities_that_the_controller_took_in_the_frame_of_the_pose_are_resolved_along_the_hull(
    tmp_path: Path, namespace: str
) -> None:
    def run_of(name: str, attached: str) -> Any:
        writer = BagWriter(tmp_path / name)
        write_run(None, 50, namespace=namespace, writer=writer, close=False)
        writer.attach("parameters.yaml", attached)
        writer.close()
        return open_bag(tmp_path / name).run(VESSEL)

    frame = "{node}: {{ros__parameters: {{odometry: {{twist_frame: {frame}}}}}}}"
    along_hull = run_of("child", frame.format(node=f"{namespace}controller", frame="child")).measured
    resolved = run_of("parent", frame.format(node=f"{namespace}controller", frame="parent")).measured
    psi = along_hull[:, 2]
    u, v = (
        along_hull[:, 3] * np.cos(psi) + along_hull[:, 4] * np.sin(psi),
        along_hull[:, 4] * np.cos(psi) - along_hull[:, 3] * np.sin(psi),
    )
    np.testing.assert_allclose(resolved[:, 3:5], np.column_stack((u, v)), atol=1e-12)
    np.testing.assert_array_equal(resolved[:, [0, 1, 2, 5]], along_hull[:, [0, 1, 2, 5]])
    for attached in (frame.format(node="/beta/controller", frame="parent"), "a: [1"):
        np.testing.assert_array_equal(run_of(f"other {len(attached)}", attached).measured, along_hull)


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


def write_apart(path: Path, steps: list[int], references: list[int]) -> dict[tuple[str, int], Any]:
    """Write a bag whose references have other stamps than the steps of the plant; returns the messages by topic and stamp."""
    rng = np.random.default_rng(1)
    writer = BagWriter(path)
    made = {}
    for name in ("odom", "applied_wrench", "disturbance", "reference"):
        each = topic(f"/{name}", TYPES[name])
        writer.add_topic(each)
        for stamp in references if name == "reference" else steps:
            made[name, stamp] = message(each.kind, stamp, rng)
            writer.write(each, serialized(made[name, stamp], each.kind), stamp, stamp)
    writer.close()
    return made


def test_a_reference_with_another_stamp_is_extrapolated_to_that_of_the_odometry(tmp_path: Path) -> None:
    steps = [k * PERIOD for k in range(4)]
    references = [stamp + PERIOD // 4 for stamp in steps]
    made = write_apart(tmp_path / "bag", steps, references)
    run = open_bag(tmp_path / "bag").run(VESSEL)
    for k in range(4):
        state, acceleration = conversions.read_reference(made["reference", references[max(0, k - 1)]])
        interval = (-PERIOD // 4 if k == 0 else PERIOD - PERIOD // 4) * 1e-9
        np.testing.assert_array_equal(run.state[k], run.measured[k])
        assert np.isnan(run.unforced_acceleration[k]).all()
        np.testing.assert_array_equal(run.reference[k], extrapolate(state, acceleration, interval))


def test_a_reference_is_not_extrapolated_over_a_pause(tmp_path: Path) -> None:
    resumed = 1000 * PERIOD
    made = write_apart(tmp_path / "bag", [0, resumed], [0, resumed + PERIOD // 4])
    run = open_bag(tmp_path / "bag").run(VESSEL)
    state, acceleration = conversions.read_reference(made["reference", resumed + PERIOD // 4])
    np.testing.assert_array_equal(run.reference[1], extrapolate(state, acceleration, -PERIOD // 4 * 1e-9))


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


@pytest.mark.parametrize("back", [50, 500, 2000, 5000])
def test_a_bag_with_a_damaged_summary_is_read_without_it(recorded: Recorded, tmp_path: Path, back: int) -> None:
    shutil.copytree(recorded[0], tmp_path / "bag")
    path = tmp_path / "bag" / "bag_0.mcap"
    content = bytearray(path.read_bytes())
    content[-back] ^= 1
    path.write_bytes(content)
    bag, undamaged = open_bag(tmp_path / "bag"), open_bag(recorded[0])
    assert not bag.complete
    assert {name: (s.type, s.count, s.qos) for name, s in bag.topics.items()} == {
        name: (s.type, s.count, s.qos) for name, s in undamaged.topics.items()
    }
    assert [raw.data for raw in bag.raw_messages("odom")] == recorded[1]["/odom"]


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
    sent = {k: message(each.kind, k, rng) for k in (2, 0, 1)}
    for k, made in sent.items():
        writer.write(each, serialized(made, each.kind), k, k)
    writer.close()
    series = open_bag(tmp_path / "bag")["odom"]
    assert series.stamp.tolist() == series.log_time.tolist() == [0, 1, 2]
    # Read later than the others, as all wide columns are.
    np.testing.assert_array_equal(series["pose.covariance"], [sent[k].pose.covariance for k in range(3)])


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


def test_a_run_whose_law_was_not_computed_at_times_has_tables_and_weights_of_one_shape(
    recorded: Recorded, tmp_path: Path
) -> None:
    given, writer, rng = open_bag(recorded[0]), BagWriter(tmp_path / "bag"), np.random.default_rng(7)
    topics = {name: topic(name, series.type) for name, series in given.topics.items()}
    for each in topics.values():
        writer.add_topic(each)
    none = dict.fromkeys(("surge_weights", "sway_weights", "yaw_weights"), np.empty(0))
    for raw in given.raw_messages():
        idle = raw.topic == "/controller/state" and raw.log_time // PERIOD in (0, 5, 6)
        kind = topics[raw.topic].kind
        data = serialized(message(kind, raw.log_time, rng, **none), kind) if idle else raw.data
        writer.write(topics[raw.topic], data, raw.log_time, raw.log_time)
    writer.close()
    run, whole = open_bag(tmp_path / "bag").run(VESSEL), given.run(VESSEL)
    for name in none:
        assert run.control[name].shape == (300, 27)
        assert np.flatnonzero(np.isnan(run.control[name]).all(axis=1)).tolist() == [0, 5, 6]
        np.testing.assert_array_equal(run.control[name][7:], whole.control[name][7:])
    assert list(run.control_dataframe().columns) == list(whole.control_dataframe().columns)


def test_a_topic_without_messages_has_empty_columns(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/odom", TYPES["odom"]))
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag["odom"].count == len(bag["odom"]["pose.pose.position.x"]) == len(bag["odom"].stamp) == 0
    with pytest.raises(BagError, match="has no message on /odom"):
        bag.run(VESSEL)


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


def test_the_message_of_a_stamp_is_found_among_messages_out_of_their_order(tmp_path: Path) -> None:
    stamps = np.array([30, 10, 40, 20, 10])
    index, found = matched(np.array([10, 20, 25, 30, 40]), SimpleNamespace(stamp=stamps))  # type: ignore[arg-type]
    assert found.tolist() == [True, True, False, True, True]
    assert index[found].tolist() == [4, 3, 0, 2], "the last one of a stamp"


@pytest.mark.parametrize("missing", [None, "disturbance"])
def test_a_run_is_the_same_in_whatever_order_its_messages_came(tmp_path: Path, missing: str | None) -> None:
    """Also of a recording of somebody else, which lacks a topic."""
    runs = []
    for order in (range(40), np.random.default_rng(2).permutation(40).tolist()):
        writer = BagWriter(tmp_path / f"bag_{len(runs)}")
        for name in [name for name in TYPES if name not in ("controller/state", "/clock", missing)]:
            written = topic(f"/{name}", TYPES[name])
            writer.add_topic(written)
            messages = [data for _, of, _, data in made_run(40) if of == name]
            for at, k in enumerate(order):
                writer.write(written, messages[k], at, at)
        writer.close()
        runs.append(open_bag(writer.directory).record("/", VESSEL).run)
    for first, second in zip(astuple(runs[0]), astuple(runs[1]), strict=True):
        np.testing.assert_array_equal(first, second)
    assert len(runs[0].time) == 40


def test_a_step_in_a_pause_near_its_beginning_has_the_reference_before_it(tmp_path: Path) -> None:
    resumed = 1000 * PERIOD
    made = write_apart(tmp_path / "bag", [0, resumed // 4, resumed], [0, resumed])
    run = open_bag(tmp_path / "bag").run(VESSEL)
    state, acceleration = conversions.read_reference(made["reference", 0])
    np.testing.assert_array_equal(run.reference[1], extrapolate(state, acceleration, resumed // 4 * 1e-9))

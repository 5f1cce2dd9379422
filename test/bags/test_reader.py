"""`open_bag`: columns of whole topics, the same numbers that foreign readers find message by message."""

import math
import runpy
import shutil
import sys
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, TYPES, message, serialized, topic, write_run
from mcap.writer import Writer
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, ScenarioError
from vessel_hsmc_ros.core.kinematics import extrapolate
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario
from vessel_sim_node.plant import VesselParameters

VESSEL = VesselParameters().coefficients()
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "open_bag.py"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    directory = tmp_path_factory.mktemp("recorded") / "bag"
    return directory, write_run(directory, 300)


def foreign(directory):
    """Messages by topic, by PyPI's rosbags."""
    messages = {}
    with AnyReader([directory]) as reader:
        for connection, _, data in reader.messages():
            messages.setdefault(connection.topic, []).append(reader.deserialize(data, connection.msgtype))
    return messages


def test_every_field_of_every_topic_is_what_rosbags_reads(recorded):
    bag = open_bag(recorded[0])
    for name, messages in foreign(recorded[0]).items():
        series = bag.topics[name]
        assert series.count == len(series) == len(messages)
        for field in series.fields:
            expected = [attrgetter(field)(each) for each in messages]
            if field == "status":
                assert [s.message for row in series[field] for s in row] == [s.message for row in expected for s in row]
            else:
                np.testing.assert_array_equal(series[field], np.array(expected), err_msg=f"{name} {field}")


def test_columns_are_typed(recorded):
    state = open_bag(recorded[0])["controller/state"]
    assert state["surge_error"].dtype == np.float64
    assert state["missed_periods"].dtype == np.uint64
    assert state["yaw_saturated"].dtype == bool
    assert state["yaw_weights"].shape == (300, 27)
    assert state["header.frame_id"].tolist() == ["odom"] * 300
    assert state.stamp.dtype == np.int64
    np.testing.assert_array_equal(state.stamp, np.arange(300) * PERIOD)


def test_nothing_is_read_before_it_is_asked_for_and_nothing_twice(recorded, monkeypatch):
    bag = open_bag(recorded[0])
    passes = []
    blocks = bag._blocks
    monkeypatch.setattr(bag, "_blocks", lambda: passes.append(1) or blocks())
    assert bag["odom"].count == 300
    assert not passes
    bag.load("odom", "reference")
    for name in ("odom", "reference"):
        assert bag[name].stamp[-1] == 299 * PERIOD
    assert len(passes) == 1
    assert bag["odom"]["pose.covariance"].shape == (300, 36)
    assert bag["odom"]["pose.covariance"] is bag["odom"]["pose.covariance"]
    assert len(passes) == 2


def test_it_says_what_it_holds(recorded):
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


def test_raw_messages_are_the_bytes_that_were_written_in_their_order(recorded):
    directory, sent = recorded
    got = {name: [] for name in sent}
    order = []
    for raw in open_bag(directory).raw_messages():
        got[raw.topic].append(raw.data)
        order.append(raw.log_time)
    assert got == sent
    assert order == sorted(order)


def slow_run(messages):
    """State, reference, wrench and disturbance as the nodes read single messages."""
    odometry = [conversions.read_odometry(m) for m in messages["/odom"]]
    reference = [conversions.read_reference(m)[0] for m in messages["/reference"]]
    wrench = [conversions.read_wrench(m) for m in messages["/applied_wrench"]]
    pushes = [conversions.read_disturbance(m) for m in messages["/disturbance"]]
    return odometry, reference, wrench, [(u / VESSEL.m11, v / VESSEL.m22, r / VESSEL.m33) for u, v, r in pushes]


def test_a_run_has_the_bits_that_single_messages_give(recorded):
    run = open_bag(recorded[0]).run(VESSEL)
    messages = foreign(recorded[0])
    odometry, reference, wrench, pushes = slow_run(messages)
    np.testing.assert_array_equal(run.measured, odometry)
    np.testing.assert_array_equal(run.state, [conversions.read_odometry(m) for m in messages["/odom/truth"]])
    unforced = [conversions.read_acceleration(m) for m in messages["/dynamics/truth"]]
    np.testing.assert_array_equal(run.unforced_acceleration, unforced)
    np.testing.assert_array_equal(run.reference, reference)
    np.testing.assert_array_equal(run.wrench, wrench)
    np.testing.assert_array_equal(run.disturbance, pushes)
    np.testing.assert_array_equal(run.time, np.arange(300) * PERIOD * 1e-9)
    assert run.control["surge_weights"].shape == (300, 27)
    assert "surge_weights" not in open_bag(recorded[0]).run(VESSEL, weights=False).control


def test_where_the_reference_is_of_another_time_it_is_carried_over(tmp_path):
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
def test_a_bag_that_was_cut_off_is_read_up_to_where_it_breaks(tmp_path, compression):
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


def test_two_vessels_are_told_apart(tmp_path):
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


def test_messages_outside_of_chunks_are_read_too(tmp_path):
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


def test_messages_out_of_order_are_put_in_order(tmp_path):
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


def test_lists_of_different_lengths_come_as_objects(tmp_path):
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


def test_a_topic_without_messages_has_empty_columns(tmp_path):
    writer = BagWriter(tmp_path / "bag")
    writer.add_topic(topic("/odom", TYPES["odom"]))
    writer.close()
    bag = open_bag(tmp_path / "bag")
    assert bag["odom"].count == len(bag["odom"]["pose.pose.position.x"]) == len(bag["odom"].stamp) == 0
    with pytest.raises(BagError, match="has no message on /odom"):
        bag.run(VESSEL)


def test_a_bag_without_its_scenario_looks_beside_itself(recorded, tmp_path):
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


def test_the_example_runs(recorded, tmp_path, monkeypatch, capsys):
    shutil.copytree(recorded[0], tmp_path / "bag")
    (tmp_path / "params.yaml").write_text(dump_scenario(load_scenario("case2_tracking")))
    monkeypatch.setattr(sys, "argv", ["open_bag.py", str(tmp_path / "bag")])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    told = capsys.readouterr().out
    assert "3003 messages in 2.99 s" in told
    assert "/odom: 300 of nav_msgs/msg/Odometry" in told
    assert "the law was hierarchical" in told

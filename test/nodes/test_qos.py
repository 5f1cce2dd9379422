from itertools import product
from typing import Any

import pytest
from driving import STEP
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.nodes.reference_ship import ReferenceShipNode
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_sim_node.node import VesselSimNode


@pytest.mark.parametrize(("lockstep", "history"), [(True, HistoryPolicy.KEEP_ALL), (False, HistoryPolicy.KEEP_LAST)])
def test_data_topics_are_reliable_and_keep_all_messages_in_lockstep(lockstep: bool, history: HistoryPolicy) -> None:
    assert qos.data(lockstep).history == history
    assert qos.data(lockstep).reliability == ReliabilityPolicy.RELIABLE


def test_in_lockstep_a_reader_that_falls_behind_loses_nothing(bench: Any) -> None:
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=True)
    received = bench.collect(WrenchStamped, "cmd_wrench", qos.data(True))
    bench.until(publisher.get_subscription_count)
    message = conv.new_wrench()
    for k in range(500):  # the test's thread does not spin, so the reader takes nothing
        conv.write_wrench(message, conv.time_message(k * STEP), (float(k), 0.0))
        publisher.publish(message)
    bench.until(lambda: len(received) == 500)
    assert [m.wrench.force.x for m in received] == list(range(500))


RARE = ("/diagnostics", "/rosout", "/parameter_events", "/events", "/controller/transition_event", "/reference/path")
"""Topics of the nodes of a run that have no message for each step."""


@pytest.mark.parametrize("node_class", [VesselSimNode, ReferenceShipNode, ControllerNode])
def test_in_lockstep_every_topic_of_the_steps_keeps_all_messages(bench: Any, node_class: Any) -> None:
    node = bench.start(node_class)
    kept = {publisher.topic_name for publisher in node.publishers if publisher.qos_profile.history == HistoryPolicy.KEEP_ALL}
    assert kept == {publisher.topic_name for publisher in node.publishers} - set(RARE)
    assert kept


def test_the_clock_of_lockstep_goes_on_without_readers_and_a_late_one_receives_the_present_time(bench: Any) -> None:
    publisher = bench.probe.create_publisher(Clock, "/clock", qos.CLOCK_OF_LOCKSTEP)
    for k in range(5500):  # more than the publisher keeps
        publisher.publish(Clock(clock=conv.time_message(k * STEP)))
    received = bench.collect(Clock, "/clock", qos.CLOCK)
    bench.until(lambda: received and conv.nanoseconds(received[-1].clock) == 5499 * STEP)


def test_a_reader_of_the_newest_that_falls_behind_takes_none_that_is_too_old_for_the_controller(bench: Any) -> None:
    """At the default rate and time-out: a busy node that took older ones first would refuse every message, for ever."""
    publisher = bench.publisher(WrenchStamped, "cmd_wrench", lockstep=False)
    received = bench.collect(WrenchStamped, "cmd_wrench", qos.newest(False))
    bench.until(publisher.get_subscription_count)
    message, count = conv.new_wrench(), 300
    for k in range(count):  # the test's thread does not spin, so the reader takes nothing
        conv.write_wrench(message, conv.time_message(k * STEP), (float(k), 0.0))
        publisher.publish(message)
    bench.until(lambda: received and received[-1].wrench.force.x == count - 1)
    parameters = ControllerParameters()
    assert (count - 1 - received[0].wrench.force.x) / parameters.rate_hz < 0.5 * parameters.input_timeout


def test_in_lockstep_the_newest_is_as_lossless_as_all() -> None:
    assert qos.newest(True) == qos.data(True)


RELIABLE, LOSSY = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
LATCHED, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
PROFILES = [QoSProfile(depth=1, reliability=r, durability=d) for r in (RELIABLE, LOSSY) for d in (LATCHED, VOLATILE)]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_recorder_requests_what_every_publisher_of_a_topic_offers_and_no_less(count: int) -> None:
    for offers in product(PROFILES, repeat=count):
        found = qos.recorded(offers)
        assert found.history == HistoryPolicy.KEEP_ALL
        assert all(qos.compatible(offered, found) for offered in offers), "it receives from each of them"
        assert (found.reliability is RELIABLE) == all(offered.reliability is RELIABLE for offered in offers)
        assert (found.durability is LATCHED) == all(offered.durability is LATCHED for offered in offers)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_replay_offers_what_all_recorded_publishers_did(count: int) -> None:
    entries = [{"reliability": r, "durability": d} for r in ("reliable", "best_effort") for d in ("transient_local", "volatile")]
    for offers in product(entries, repeat=count):
        found = qos.replayed(offers)
        assert (found.reliability is RELIABLE) == all(offered["reliability"] == "reliable" for offered in offers)
        assert (found.durability is LATCHED) == (bool(offers) and all(o["durability"] == "transient_local" for o in offers))

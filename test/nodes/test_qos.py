from typing import Any

import pytest
from driving import STEP
from geometry_msgs.msg import WrenchStamped
from rclpy.qos import HistoryPolicy, ReliabilityPolicy

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos


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

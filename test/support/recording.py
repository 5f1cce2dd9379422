"""A recorder under test, and the content of its bag."""

from pathlib import Path
from typing import Any

from rcl_interfaces.msg import Log
from rosbags.highlevel import AnyReader

from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes.recorder import RecorderNode


def wrench(k: Any) -> Any:
    message = conv.new_wrench()
    conv.write_wrench(message, conv.time_message(k * 10_000_000), (float(k), -0.5 * k))
    return message


def record(bench: Any, tmp_path: Path, **parameters: Any) -> Any:
    parameters = {"topics": ["cmd_wrench", "reference"], **parameters}
    return bench.start(RecorderNode, directory=str(tmp_path / "bag"), **parameters)


def recorded_topics(node: Any) -> Any:
    return {subscription.topic_name for subscription in node.direct_subscriptions}


def warnings(bench: Any) -> Any:
    """The warnings of the recorder on /rosout; the list grows while the bench spins."""
    logs = bench.collect(Log, "/rosout", qos.CLOCK)
    return lambda: [log.msg for log in logs if log.name == "recorder" and log.level == 30]


def read(tmp_path: Path) -> Any:
    with AnyReader([tmp_path / "bag"]) as reader:
        return [(c.topic, stamp, bytes(data)) for c, stamp, data in reader.messages()]

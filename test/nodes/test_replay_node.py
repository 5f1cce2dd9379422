import itertools
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from bag_making import PERIOD, made_run, write_run
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool
from vessel_hsmc_msgs.msg import ControlState

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import conversions
from vessel_hsmc_ros.messages.raw import message_class
from vessel_hsmc_ros.nodes import qos
from vessel_hsmc_ros.nodes import replay as replay_module
from vessel_hsmc_ros.nodes.replay import Playing, ReplayNode

STEPS = 30
KINDS = {"/odom": Odometry, "/cmd_wrench": WrenchStamped, "/controller/state": ControlState, "/clock": Clock}


@pytest.fixture
def bag(tmp_path: Path) -> Any:
    write_run(tmp_path / "bag", STEPS)
    return open_bag(tmp_path / "bag")


def replay(bench: Any, bag: Any, **playing: Any) -> Any:
    node = ReplayNode(bag, Playing(**playing), context=bench.context)
    bench.nodes.append(node)
    return node


def listen(bench: Any, node: Any, *names: Any) -> Any:
    """Lists of the serialized messages of some topics, filled while the bench spins; the subscriptions are connected."""
    found: dict[str, list[Any]] = {name: [] for name in names}
    for name, messages in found.items():
        bench.probe.create_subscription(KINDS[name], name, messages.append, qos.LOSSLESS, raw=True)
    outputs = [publisher for publisher in node.publishers if publisher.topic_name in names]
    bench.until(lambda: all(publisher.get_subscription_count() for publisher in outputs))
    return found


def stamps(kind: Any, messages: Any) -> Any:
    made = [deserialize_message(data, kind) for data in messages]
    return [conversions.nanoseconds(m.clock if kind is Clock else m.header.stamp) // PERIOD for m in made]


def test_a_replay_publishes_the_recorded_messages_at_the_given_rate(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=2.0)
    found = listen(bench, node, *KINDS)
    began = time.monotonic()
    node.play(lambda: True)
    assert time.monotonic() - began >= (STEPS - 1) * 0.01 / 2.0 - 0.002
    bench.until(lambda: all(len(messages) == STEPS for messages in found.values()))
    for name, messages in found.items():
        assert messages == [data for _, topic, _, data in made_run(STEPS) if topic in (name, name[1:])]
    assert node.published == bag.count


def test_a_paused_replay_publishes_nothing_until_it_is_resumed(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=100.0, paused=True)
    found = listen(bench, node, "/odom")
    client = bench.probe.create_client(SetBool, "/replay/pause")
    bench.until(client.service_is_ready)
    looks = 0

    def running() -> Any:
        nonlocal looks
        looks += 1
        bench.spin(0.0)
        bench.serve()
        if looks == 5:
            assert not found["/odom"]
            client.call_async(SetBool.Request(data=False))
        return looks < 10_000

    node.play(running)
    assert not node.paused
    assert node.published == bag.count


def test_a_pause_delays_what_follows_it(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=2.0, paused=True)
    began = time.monotonic()
    resumed: list[float] = []

    def running() -> bool:
        if node.paused and time.monotonic() - began > 2 * STEPS * 0.01 / 2.0:  # longer than the bag
            node.paused = False
            resumed.append(time.monotonic())
        return True

    node.play(running)
    assert time.monotonic() - resumed[0] >= (STEPS - 1) * 0.01 / 2.0 - 0.002


def test_a_looped_replay_begins_again_until_it_is_stopped(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=1000.0, loop=True, topics=["odom"])
    found = listen(bench, node, "/odom")
    node.play(lambda: node.published < 3 * STEPS)
    bench.until(lambda: len(found["/odom"]) == 3 * STEPS)
    assert stamps(Odometry, found["/odom"]) == [*range(STEPS)] * 3


def test_without_a_recorded_clock_one_is_made(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=100.0, topics=["odom"])
    found = listen(bench, node, "/clock")
    node.play(lambda: True)
    bench.until(lambda: len(found["/clock"]) == STEPS)
    assert stamps(Clock, found["/clock"]) == [*range(STEPS)]


def test_a_bag_without_messages_is_refused(bench: Any, tmp_path: Path) -> None:
    BagWriter(tmp_path / "bag").close()
    with pytest.raises(BagError, match="has no message that could be published"):
        ReplayNode(open_bag(tmp_path / "bag"), Playing(), context=bench.context)


def test_no_message_is_replayed_before_the_time_of_its_recording_is_known(bench: Any, bag: Any) -> None:
    node = replay(bench, bag, rate=100.0, topics=["odom"])
    order: list[str] = []

    def noting(name: str, publish: Any) -> Any:
        def note(message: Any) -> None:
            order.append(name)
            publish(message)

        return note

    for name, publisher in (("clock", node._ticker), ("odom", node._outputs["/odom"])):
        publisher.publish = noting(name, publisher.publish)
    node.play(lambda: True)
    assert order == ["clock", "odom"] * STEPS


def test_each_pause_on_the_way_delays_what_follows_and_no_more(bench: Any, bag: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a clock of the test, which advances with each wait."""
    now, found = [50.0], []
    monkeypatch.setattr(replay_module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    node = replay(bench, bag, rate=0.5, topics=["odom"])
    publisher = node._outputs["/odom"]
    monkeypatch.setattr(node, "_outputs", {"/odom": SimpleNamespace(publish=lambda _: found.append(now[0]))})
    monkeypatch.setattr(node, "_ticker", None)
    assert publisher
    waits = [0]

    def spin_once(timeout_sec: float) -> None:
        now[0] += timeout_sec
        waits[0] += 1
        node.paused = len(found) in (10, 20) and 100 * len(found) < waits[0] < 100 * len(found) + 200

    def running() -> bool:
        if len(found) in (10, 20) and waits[0] < 100 * len(found):
            waits[0], node.paused = 100 * len(found), True
        return True

    node._play_once(SimpleNamespace(spin_once=spin_once), running)
    gaps = [after - before for before, after in itertools.pairwise(found)]
    assert len(gaps) == STEPS - 1
    assert [k for k, gap in enumerate(gaps, 1) if gap > 1.0] == [10, 20]
    usual = [gap for gap in gaps if gap < 1.0]
    assert max(usual) < 0.025, "nothing catches up, and nothing is later"
    assert min(usual) > 0.015


@pytest.mark.parametrize("error", [ImportError, AttributeError])
def test_a_topic_whose_type_is_not_installed_is_left_out_and_the_others_are_replayed(
    bench: Any, bag: Any, monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    """A package that is missing, and one of another version that has no such message."""

    def installed(kind: str) -> Any:
        if kind == "vessel_hsmc_msgs/msg/ControlState":
            raise error
        return message_class(kind)

    monkeypatch.setattr(replay_module, "message_class", installed)
    node = replay(bench, bag, rate=1000.0)
    node.play(lambda: True)
    assert set(node._outputs) == set(bag.topics) - {"/controller/state"}
    assert node.published == bag.count - bag["controller/state"].count

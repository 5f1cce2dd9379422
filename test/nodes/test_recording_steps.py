"""The recorder's count of gaps, and the black box, at the second time."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.serialization import serialize_message

from vessel_hsmc_ros.bags.reader import open_bag
from vessel_hsmc_ros.bags.writer import Topic
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.messages import raw
from vessel_hsmc_ros.messages.topics import definition
from vessel_hsmc_ros.nodes import black_box
from vessel_hsmc_ros.nodes.recorder import RecorderNode

KIND = "geometry_msgs/msg/WrenchStamped"


def recorder_of(
    bench: Any, folder: Path, awaited: bool, alone: bool = True, name: str = "/cmd_wrench", **parameters: Any
) -> tuple[Any, Any]:
    """A recorder, for which the publishers of a topic wait, and its callback for that topic."""
    given = {"lockstep": False, "recorded": awaited, **parameters}
    node = bench.start(RecorderNode, directory=str(folder / "bag"), **given)
    topic = Topic(name, KIND, definition(KIND), "", [])
    node._writer.add_topic(topic)
    record = node._recorder_of(topic, raw.message_class(KIND), alone)

    def receive(*numbers: int) -> None:
        for number in numbers:
            record(
                b"\0\1\0\0" + bytes(80), {"publication_sequence_number": number, "received_timestamp": 5, "source_timestamp": 4}
            )

    return node, receive


@pytest.mark.parametrize(
    ("awaited", "numbers", "dropped"),
    [
        (True, (1, 2, 3), 0),
        (True, (3, 4), 2),
        (True, (1, 4, 5, 9), 2 + 3),
        (False, (7, 8, 9), 0),
        (False, (7, 9, 12), 1 + 2),
        (True, (1, 2, 1, 2, 9), 0),
        (True, (1, 5, 1, 9, 30), 3),
    ],
)
def test_each_gap_counts_until_another_publisher_takes_over(
    bench: Any, tmp_path: Path, awaited: bool, numbers: tuple[int, ...], dropped: int
) -> None:
    node, receive = recorder_of(bench, tmp_path, awaited)
    receive(*numbers)
    assert node.status()[2]["dropped"] == dropped
    assert node.status()[2]["messages"] == len(numbers)
    node.close()


def test_the_longest_wait_is_that_since_the_last_diagnostics(bench: Any, tmp_path: Path) -> None:
    node, receive = recorder_of(bench, tmp_path, True)
    waits = []
    for received in (True, False, True):
        if received:
            receive(1)
        queue = next(task for task in node.diagnostic_tasks() if task.name == "queue")
        waits.append(queue.values["longest_wait"])
    assert min(waits[0], waits[2]) > 1e6, "its messages were received in 1970"
    assert waits[1] == 0.0
    node.close()


def test_of_several_publishers_no_gap_counts(bench: Any, tmp_path: Path) -> None:
    node, receive = recorder_of(bench, tmp_path, True, alone=False)
    receive(1, 5, 2, 9)
    assert node.status()[2]["dropped"] == 0
    node.close()


def test_no_gap_counts_on_a_topic_of_other_programs(bench: Any, tmp_path: Path) -> None:
    node, receive = recorder_of(bench, tmp_path, True, name="/goal_pose")
    receive(4, 9)
    assert node.status()[2]["dropped"] == 0
    node.close()


def test_in_lockstep_a_message_has_its_stamp_for_both_of_its_times_and_the_wall_clock_for_none(
    bench: Any, tmp_path: Path
) -> None:
    node, _ = recorder_of(bench, tmp_path, True, lockstep=True)
    topic = Topic("/other", KIND, definition(KIND), "", [])
    node._writer.add_topic(topic)
    record, message = node._recorder_of(topic, raw.message_class(KIND), True), conv.new_wrench()
    message.header.stamp = conv.time_message(7_250_000_000)
    record(
        serialize_message(message), {"publication_sequence_number": 1, "received_timestamp": 10**18, "source_timestamp": 10**18}
    )
    node.close()
    (found,) = open_bag(tmp_path / "bag").raw_messages()
    assert (found.log_time, found.publish_time) == (7_250_000_000, 7_250_000_000)


def test_a_black_box_writes_again_after_a_minute_and_no_more_bags_than_allowed(
    bench: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, now, written = bench.probe, [0.0], []
    parameters: Any = SimpleNamespace(duration=30.0, directory="")
    box = black_box.BlackBox(node, parameters, lambda: round(now[0] * 1e9))
    monkeypatch.setattr(black_box, "time", SimpleNamespace(monotonic=lambda: now[0], monotonic_ns=lambda: round(1e9 * now[0])))
    monkeypatch.setattr(box, "_write", written.append)
    box.write("before any message")
    box.keep("/cmd_wrench", conv.new_wrench())
    times = [0.0, 59.9, 60.1, 119.0, 120.2, *(200.0 + 61.0 * k for k in range(20))]
    for at in times:
        now[0] = at
        box.write(f"{at:g}")
        box.close()
    assert written == ["0", "60.1", "120.2", *(f"{200.0 + 61.0 * k:g}" for k in range(7))]


def test_what_a_black_box_keeps_is_what_came_within_its_time_each_time(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(black_box, "time", SimpleNamespace(monotonic_ns=lambda: round(now[0] * 1e9)))
    parameters: Any = SimpleNamespace(duration=2.0, directory="")
    box = black_box.BlackBox(bench.probe, parameters, lambda: round(now[0] * 1e9))
    for at in (0.0, 1.0, 2.0, 2.5, 9.0, 9.5):
        now[0] = at
        box.keep("/cmd_wrench", conv.new_wrench())
        kept = [stamp * 1e-9 for stamp, _ in box._kept]
        assert kept == [each for each in (0.0, 1.0, 2.0, 2.5, 9.0, 9.5) if at - 2.0 <= each <= at]
        assert box._size == sum(len(data) for _, (*_, data) in box._kept)


@pytest.mark.parametrize("simulated", [True, False])
def test_in_real_time_a_message_has_the_time_of_its_receipt_by_the_clock_of_the_run(
    bench: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, simulated: bool
) -> None:
    node, receive = recorder_of(bench, tmp_path, True, use_sim_time=simulated)
    for number, now in enumerate((3_000_000_000, 7_000_000_000), 1):
        monkeypatch.setattr(node, "now", lambda now=now: now)
        receive(number)
    node.close()
    times = [message.log_time for message in open_bag(tmp_path / "bag").raw_messages()]
    assert times == ([3_000_000_000, 7_000_000_000] if simulated else [5, 5])

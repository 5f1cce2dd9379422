"""The black box of the controller: its last messages, written as a bag when an error occurs."""

import io
import itertools
import math
import pickle
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bag_making import CLOCK, PERIOD, clock
from driving import ACCELERATION, REFERENCE, STATE, Plant
from rcl_interfaces.msg import Log
from rclpy.serialization import serialize_message

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError
from vessel_hsmc_ros.messages import conversions as conv
from vessel_hsmc_ros.nodes import black_box
from vessel_hsmc_ros.nodes.controller import ControllerNode
from vessel_hsmc_ros.scenario.parameter_groups import BlackBoxParameters

TOPICS = {"/odom", "/reference", "/cmd_wrench", "/controller/state", "/diagnostics", "/rosout"}


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(black_box, "AFTERWARDS", 0.1)


@pytest.fixture
def steering(bench: Any, tmp_path: Path) -> Any:
    """A controller in real time with a black box, which has published some commands; and its plant."""
    plant = Plant(bench, lockstep=False)
    settings = {
        "law": "los_pid",
        "input_timeout": 60.0,
        "black_box__duration": 30.0,
        "black_box__directory": str(tmp_path / "boxes"),
    }
    node = plant.connect(bench.start(ControllerNode, lockstep=False, **settings))

    def drive() -> int:
        now = bench.probe.get_clock().now().nanoseconds
        plant.send_reference(now, REFERENCE, ACCELERATION)
        plant.send_odometry(now, STATE)
        return len(plant.commands)

    bench.until(lambda: drive() >= 5)
    return plant, node


def the_bag(bench: Any, folder: Path) -> Bag:
    bench.until(lambda: list(folder.glob("*/metadata.yaml")))
    (made,) = folder.iterdir()
    return open_bag(made)


def test_an_input_that_is_not_finite_writes_the_last_inputs_outputs_diagnostics_and_log_lines(
    bench: Any, steering: Any, tmp_path: Path
) -> None:
    plant, node = steering
    plant.send_odometry(bench.probe.get_clock().now().nanoseconds, STATE * math.nan)
    bench.until(
        lambda: any(b"odometry must be finite numbers (got x = nan" in data for _, (_, topic, _, data) in node.black_box._kept)
    )
    bench.until(lambda: node.black_box._writing)
    node.black_box.close()
    bag = the_bag(bench, tmp_path / "boxes")
    assert set(bag.topics) >= TOPICS
    assert bag["cmd_wrench"].count >= 5
    bag.load("/odom")
    states = bag["odom"]["pose.pose.position.x"]
    assert math.isnan(states[-1])
    np.testing.assert_allclose(states[:-1], STATE[0])
    lines = [message.msg for _, _, message in bag.messages("/rosout")]
    assert any("odometry must be finite numbers (got x = nan" in line for line in lines)
    assert bag.parameters["/controller"]["law"] == "los_pid"


def test_the_error_that_ends_a_node_is_in_its_black_box(bench: Any, steering: Any, tmp_path: Path) -> None:
    _, node = steering
    node.fail("the law failed")
    node.close()
    lines = [message.msg for _, _, message in the_bag(bench, tmp_path / "boxes").messages("/rosout")]
    assert "the law failed" in lines


def test_the_memory_of_a_black_box_is_bounded_in_time_and_size(
    bench: Any, steering: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, node = steering
    box, wrench = node.black_box, conv.new_wrench()
    monkeypatch.setattr(black_box, "MEMORY", 2000)
    for _ in range(100):
        box.keep("/cmd_wrench", wrench)
    assert 1000 < sum(len(data) for _, (*_, data) in box._kept) <= 2000
    box._span = 0
    box.keep("/cmd_wrench", wrench)
    assert len(box._kept) == 1


@pytest.mark.parametrize("over", [-200, 0, 1, 5000])
def test_a_message_that_is_larger_than_the_memory_neither_ends_the_node_nor_displaces_the_others(
    bench: Any, steering: Any, monkeypatch: pytest.MonkeyPatch, over: int
) -> None:
    _, node = steering
    box = node.black_box
    monkeypatch.setattr(black_box, "MEMORY", 10_000)
    message = conv.new_odometry()
    message.header.frame_id = "x" * (black_box.MEMORY + over - len(serialize_message(message)))
    first = box.receiver("/odom", type(message), lambda _: None)
    for _ in range(5):
        box.keep("/cmd_wrench", conv.new_wrench())
    kept = len(box._kept)
    first(serialize_message(message))
    too_large = len(serialize_message(message)) > black_box.MEMORY
    assert (len(box._kept) == kept) is too_large
    box.keep("/cmd_wrench", conv.new_wrench())
    assert sum(len(data) for _, (*_, data) in box._kept) <= 10_000


@pytest.mark.parametrize("step", [3600, -3600, 31])
def test_a_clock_that_is_set_does_not_empty_a_black_box(monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    boxes, stamps = Boxes(monkeypatch), []
    for k in range(40):
        stamps.append((5000 + (step if k >= 20 else 0)) * 10**9 + k)
        monkeypatch.setattr(boxes.box, "_stamp", lambda: stamps[-1])
        boxes.box.keep("/cmd_wrench", conv.new_wrench(), bytes([k]))
    boxes.write("an error")
    assert boxes.written == [[wrench(bytes([k]), stamp) for k, stamp in enumerate(stamps)]]


def wrench(data: bytes, stamp: int = 5) -> Any:
    return stamp, "/cmd_wrench", "geometry_msgs/msg/WrenchStamped", data


def content(folder: Path) -> tuple[bytes, list[bytes]]:
    """What the writing process is given: the head, and messages of two topics in turns."""
    head = str(folder), "fault", "/controller:\n  ros__parameters: {gain: 1.5}\n"
    return pickle.dumps(head), [pickle.dumps((k * PERIOD, TURNS[k % 2], CLOCK, clock(k * PERIOD))) for k in range(5)]


TURNS = ("/clock", "/other/clock")


def test_a_content_that_is_cut_off_anywhere_gives_a_bag_of_all_messages_before(tmp_path: Path) -> None:
    every = [(TURNS[k % 2], k * PERIOD, clock(k * PERIOD)) for k in range(5)]
    _, messages = content(tmp_path)
    ends = [0, *itertools.accumulate(map(len, messages))]
    for cut in (0, 13, 14, ends[1] - 1, ends[1], ends[2] + 3, ends[4] + 15, ends[-1] - 1, ends[-1]):
        folder = tmp_path / f"box_{cut}"
        head, messages = content(folder)
        black_box.write(io.BytesIO(head + b"".join(messages)[:cut]))
        bag = open_bag(folder)
        assert bag.complete
        assert bag.recording["reason"] == "fault"
        assert bag.parameters == {"/controller": {"gain": 1.5}}
        found = [(raw.topic, raw.log_time, raw.data) for raw in bag.raw_messages()]
        assert found == every[: sum(end <= cut for end in ends[1:])]


def test_a_folder_that_exists_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("of another")
    head, _ = content(tmp_path)
    with pytest.raises(BagError, match="File exists"):
        black_box.write(io.BytesIO(head))
    assert (tmp_path / "notes.txt").read_text() == "of another"


@pytest.mark.parametrize("failing", ["_begin_file", "close"])
def test_of_a_bag_that_cannot_be_written_nothing_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str) -> None:
    def fail(_bag: BagWriter) -> None:
        raise OSError(28, "No space left on device") if failing == "_begin_file" else BagError("No space left on device")

    monkeypatch.setattr(BagWriter, failing, fail)
    head, messages = content(tmp_path / "full")
    with pytest.raises(BagError, match="No space left"):
        black_box.write(io.BytesIO(head + messages[0]))
    assert not (tmp_path / "full").exists()


def messages_of(content: bytes) -> Iterator[Any]:
    """The messages in what the writing process is given."""
    stream = io.BytesIO(content)
    pickle.load(stream)  # noqa: S301
    while stream.tell() < len(content):
        yield pickle.load(stream)  # noqa: S301


class Boxes:
    """Black boxes of a node without ROS, whose bags are not written: `written` has what the writing process would get."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.written: list[Any] = []
        clock = SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=5))
        log = SimpleNamespace(warning=lambda _: None, error=lambda _: None, name="alpha.controller")
        node = SimpleNamespace(
            get_fully_qualified_name=lambda: "/alpha/controller",
            get_logger=lambda: log,
            get_clock=lambda: clock,
            parameters=BlackBoxParameters(),
        )
        monkeypatch.setattr(subprocess, "run", lambda *_, **given: self.written.append([*messages_of(given["input"])]))
        self.box = black_box.BlackBox(node, BlackBoxParameters(duration=30.0, directory="x"), lambda: 5)  # type: ignore[arg-type]

    def write(self, reason: str, ends: bool = False) -> None:
        self.box.write(reason, ends)
        assert self.box._writing is not None
        self.box._writing.join(30.0)
        assert not self.box._writing.is_alive()


@pytest.mark.parametrize("count", [1, 50])
def test_every_message_of_a_black_box_reaches_its_bag(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    boxes = Boxes(monkeypatch)
    for k in range(count):
        boxes.box.keep("/cmd_wrench", conv.new_wrench(), bytes([k] * 3))
    boxes.write("an error")
    assert boxes.written == [[wrench(bytes([k] * 3)) for k in range(count)]]


def test_the_log_of_other_nodes_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = Boxes(monkeypatch)
    for name in ("alpha.controller", "alpha.vessel_sim", "controller"):
        boxes.box.keep_log(Log(name=name, msg=name))
    boxes.write("an error")
    ((message,),) = boxes.written
    assert (message[1], message[2]) == ("/rosout", "rcl_interfaces/msg/Log")
    assert b"alpha.controller" in message[3]


def test_a_second_error_within_a_minute_writes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = Boxes(monkeypatch)
    for number in range(3):
        boxes.box.keep("/cmd_wrench", conv.new_wrench(), bytes([number]))
        boxes.write("an error")
    assert boxes.written == [[wrench(bytes([0]))]]


def test_a_node_writes_as_many_bags_as_it_may_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(black_box, "LEAST_INTERVAL", -1.0)
    monkeypatch.setattr(black_box, "MOST_BAGS", 3)
    boxes = Boxes(monkeypatch)
    boxes.box.keep("/cmd_wrench", conv.new_wrench())
    for _ in range(5):
        boxes.write("an error")
    assert len(boxes.written) == 3


@pytest.mark.parametrize(
    ("code", "reason"), [("exit 1", "returned non-zero exit status 1"), ("echo no space left >&2; exit 2", "no space left")]
)
def test_a_bag_that_the_writing_process_cannot_write_is_an_error_with_its_reason(
    monkeypatch: pytest.MonkeyPatch, code: str, reason: str
) -> None:
    run = subprocess.run
    boxes, lines = Boxes(monkeypatch), []
    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(black_box, "COMMAND", ("sh", "-c", f"cat > /dev/null; {code}"))
    log = SimpleNamespace(error=lines.append, name="controller")
    monkeypatch.setattr(boxes.box._node, "get_logger", lambda: log)
    boxes.box.keep("/cmd_wrench", conv.new_wrench())
    boxes.write("an error", ends=True)
    (line,) = lines
    assert line.startswith("the black box is not written: ")
    assert reason in line


def test_the_line_that_names_a_black_box_has_its_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes, lines = Boxes(monkeypatch), []
    monkeypatch.setattr(boxes.box._node, "get_logger", lambda: SimpleNamespace(warning=lines.append, name="controller"))
    boxes.box.keep("/cmd_wrench", conv.new_wrench())
    boxes.write("safe: another node publishes as well", ends=True)
    (line,) = lines
    assert line.startswith("safe: another node publishes as well: the black box is in x/")


def test_an_error_that_ends_the_node_does_not_wait_for_what_follows_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(black_box, "AFTERWARDS", 1000.0)
    boxes = Boxes(monkeypatch)
    boxes.box.keep("/cmd_wrench", conv.new_wrench())
    boxes.box.write("an error")
    boxes.write("the last one, within a minute", ends=True)
    assert len(boxes.written) == 1


def test_a_message_that_ends_the_node_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = Boxes(monkeypatch)

    def fail(_message: Any) -> None:
        raise RuntimeError("the law failed")

    receive = boxes.box.receiver("/cmd_wrench", type(conv.new_wrench()), fail)
    with pytest.raises(RuntimeError, match="the law failed"):
        receive(serialize_message(conv.new_wrench()))
    assert len(boxes.box._kept) == 1


def test_what_follows_an_error_for_a_while_is_in_its_bag(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = Boxes(monkeypatch)
    boxes.box.keep("/cmd_wrench", conv.new_wrench(), b"before")
    waited = SimpleNamespace(wait=lambda _: boxes.box.keep("/cmd_wrench", conv.new_wrench(), b"after"))
    monkeypatch.setattr(boxes.box, "_ending", waited)
    boxes.write("an error")
    assert boxes.written == [[wrench(b"before"), wrench(b"after")]]

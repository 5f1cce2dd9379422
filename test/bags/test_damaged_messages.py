"""Messages that are damaged within an undamaged file: they are left out of the columns, and a warning counts them."""

from pathlib import Path

import numpy as np
import pytest
from bag_making import PERIOD, message, serialized, topic

from vessel_hsmc_ros.bags.reader import Bag, open_bag
from vessel_hsmc_ros.bags.writer import BagWriter
from vessel_hsmc_ros.core.exceptions import BagError, BagWarning

ODOMETRY = "nav_msgs/msg/Odometry"
COUNT = 20

DAMAGE = {
    "cut off": lambda data: data[:100],
    "empty": lambda _: b"",
    "a text without an end": lambda data: data[:16] + b"\xff" * 8 + data[24:],
    "a text that is not UTF-8": lambda data: data[:16] + b"\xff" + data[17:],
    "in another encapsulation": lambda data: b"\x07" + data[1:],
}


def written(folder: Path, damaged: dict[int, str]) -> Bag:
    """A bag of odometry, whose messages of some numbers are damaged."""
    writer, odometry, rng = BagWriter(folder / "bag"), topic("/odom", ODOMETRY), np.random.default_rng(1)
    writer.add_topic(odometry)
    for k in range(COUNT):
        data = serialized(message(ODOMETRY, k * PERIOD, rng), ODOMETRY)
        writer.write(odometry, DAMAGE[damaged[k]](data) if k in damaged else data, k * PERIOD, k * PERIOD)
    writer.close()
    return open_bag(folder / "bag")


@pytest.mark.parametrize("kind", DAMAGE)
@pytest.mark.parametrize("numbers", [(0,), (7,), (COUNT - 1,), (0, 7, 8)])
def test_damaged_messages_are_left_out_of_every_column_and_counted_by_one_warning(
    tmp_path: Path, kind: str, numbers: tuple[int, ...]
) -> None:
    whole = written(tmp_path / "whole", {})["odom"]
    bag = written(tmp_path / "damaged", dict.fromkeys(numbers, kind))
    kept = np.setdiff1d(np.arange(COUNT), numbers)
    text = f"{len(numbers)} of {COUNT} messages of /odom are damaged and left out"
    with pytest.warns(BagWarning, match=text) as warned:
        times = bag["odom"].log_time
    np.testing.assert_array_equal(times, kept * PERIOD)
    for name in (*whole.fields, "publish_time"):  # wide ones too, which are read later
        np.testing.assert_array_equal(bag["odom"][name], whole[name][kept])
    np.testing.assert_array_equal(bag["odom"].stamp, kept * PERIOD)
    assert len(warned) == 1
    assert str(tmp_path / "damaged") in str(warned[0].message)
    assert bag.count == COUNT


def test_a_topic_without_an_undamaged_message_is_refused_with_the_reason(tmp_path: Path) -> None:
    bag = written(tmp_path, dict.fromkeys(range(COUNT), "cut off"))
    with pytest.raises(BagError, match=r"a message of /odom is not a nav_msgs/msg/Odometry"):
        bag.load("odom")


def test_other_topics_of_a_bag_with_damaged_messages_are_read_without_a_warning(tmp_path: Path) -> None:
    writer, topics = BagWriter(tmp_path / "bag"), [topic(name, ODOMETRY) for name in ("/odom", "/alpha/odom")]
    data = serialized(message(ODOMETRY, 0, np.random.default_rng(1)), ODOMETRY)
    for each in topics:
        writer.add_topic(each)
        writer.write(each, data[:50] if each is topics[0] else data, 0, 0)
    writer.close()
    assert len(open_bag(tmp_path / "bag")["/alpha/odom"].stamp) == 1
